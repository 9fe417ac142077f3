#include "controller/flight/flight_files.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <iterator>
#include <system_error>
#include <vector>

namespace breakshot::control::flight {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "flight-";
constexpr std::string_view kUnfinished = ".unfinished";
/// Two seconds take 1 to 3 MB; a file that is far larger is not ours and is not read into memory.
constexpr std::uintmax_t kLargest = std::uintmax_t{256} << 20U;

std::string ending(Trigger trigger) { return fmt::format("-{}.flight", to_string(trigger)); }

std::string utc(std::int64_t ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  return fmt::format("{:%Y%m%dT%H%M%S}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(ns / kSecond)), ns % kSecond / 1'000'000);
}

std::string failed(const char* what, const fs::path& path, int error) {
  return fmt::format("cannot {} {}: {}", what, path.string(), std::system_category().message(error));
}

/// Opens, does something with the descriptor, and closes. @return 0 or the errno
template <typename Use>
int with_file(const fs::path& path, int flags, const Use& use) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC, 0640);
  if (fd < 0) return errno;
  int error = use(fd) ? 0 : errno;
  if (close(fd) != 0 && error == 0) error = errno;
  return error;
}

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Names rise with time, so the first ones are the oldest.
void remove_oldest(const fs::path& folder, Trigger trigger, std::size_t keep) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator{folder, error}) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kPrefix)) continue;
    // One controller writes here at a time: what it did not finish, an earlier life left behind.
    if (name.ends_with(kUnfinished)) fs::remove(entry.path(), error);
    if (name.ends_with(ending(trigger))) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i + keep < files.size(); ++i) fs::remove(files[i], error);
}

}  // namespace

Result<fs::path, std::string> store(const fs::path& folder, const FlightRecord& record, std::size_t keep) {
  std::error_code made;
  fs::create_directories(folder, made);
  if (made) return failed("make", folder, made.value());
  const fs::path file = folder / fmt::format("{}{}{}", kPrefix, utc(record.written_utc_ns), ending(record.trigger));
  fs::path unfinished = file;
  unfinished += kUnfinished;

  const std::string bytes = encode(record);
  const int written = with_file(unfinished, O_WRONLY | O_CREAT | O_TRUNC, [&](int fd) { return write_all(fd, bytes) && fsync(fd) == 0; });
  if (written != 0) {
    unlink(unfinished.c_str());
    return failed("write", unfinished, written);
  }
  if (rename(unfinished.c_str(), file.c_str()) != 0) return failed("rename", unfinished, errno);
  // The name is on the disk only when its folder is.
  const int synced = with_file(folder, O_RDONLY | O_DIRECTORY, [](int fd) { return fsync(fd) == 0; });
  if (synced != 0) return failed("sync", folder, synced);
  remove_oldest(folder, record.trigger, keep);
  return file;
}

Result<FlightRecord, std::string> load(const fs::path& file) {
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) return std::string{"cannot be read: "} + error.message();
  if (size > kLargest) return fmt::format("{} bytes; a flight record has at most {}", size, kLargest);
  std::ifstream stream{file, std::ios::binary};
  const std::string bytes{std::istreambuf_iterator<char>{stream}, {}};
  if (!stream) return std::string{"cannot be read"};
  return decode(bytes);
}

}  // namespace breakshot::control::flight
