#include "launcher/shm_files.hpp"

#include "launcher/unique_fd.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdlib>
#include <fstream>

namespace breakshot::launcher {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
namespace fs = std::filesystem;

class StaleShm : public ::testing::Test {
 protected:
  StaleShm() {
    std::string name = (fs::temp_directory_path() / "breakshot_shm_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~StaleShm() override { fs::remove_all(folder_); }
  StaleShm(const StaleShm&) = delete;
  StaleShm& operator=(const StaleShm&) = delete;
  StaleShm(StaleShm&&) = delete;
  StaleShm& operator=(StaleShm&&) = delete;

  fs::path make(const std::string& name) {
    std::ofstream{folder_ / name} << std::string(4096, 'x');
    return folder_ / name;
  }

  fs::path folder_;
};

TEST_F(StaleShm, RemovesWhatFastDdsLeftAndNothingElse) {
  make("fast_datasharing_01.0f");
  make("fastrtps_port7410");
  make("sem.fastrtps_port7410_mutex");
  make("somebody_elses");
  make("my_fastrtps_notes");
  fs::create_directory(folder_ / "fastrtps_folder");
  fs::create_symlink("somebody_elses", folder_ / "fastrtps_link");
  const ShmCleanup result = remove_stale_shm(folder_);
  EXPECT_THAT(result.removed, UnorderedElementsAre("fast_datasharing_01.0f", "fastrtps_port7410", "sem.fastrtps_port7410_mutex"));
  EXPECT_THAT(result.failed, IsEmpty());
  for (const char* name : {"somebody_elses", "my_fastrtps_notes", "fastrtps_folder", "fastrtps_link"}) {
    EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  }
}

TEST_F(StaleShm, LeavesWhatAProcessHasOpenOrMapped) {
  const fs::path open_path = make("fastrtps_open");
  const fs::path mapped_path = make("fast_datasharing_mapped");
  UniqueFd open_file{::open(open_path.c_str(), O_RDWR | O_CLOEXEC)};
  UniqueFd mapped_file{::open(mapped_path.c_str(), O_RDWR | O_CLOEXEC)};
  void* memory = ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED, mapped_file.get(), 0);
  ASSERT_NE(memory, MAP_FAILED);
  mapped_file.reset();

  EXPECT_THAT(remove_stale_shm(folder_).in_use, UnorderedElementsAre("fastrtps_open", "fast_datasharing_mapped"));
  ::munmap(memory, 4096);
  EXPECT_THAT(remove_stale_shm(folder_).removed, ElementsAre("fast_datasharing_mapped"));
  open_file.reset();
  EXPECT_THAT(remove_stale_shm(folder_).removed, ElementsAre("fastrtps_open"));
}

TEST_F(StaleShm, SaysSoWhenTheFolderCannotBeRead) { EXPECT_THROW(remove_stale_shm(folder_ / "none"), fs::filesystem_error); }

}  // namespace
}  // namespace breakshot::launcher
