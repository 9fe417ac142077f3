#include "launcher/run_directory.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <array>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>

namespace breakshot::launcher {
namespace {

namespace fs = std::filesystem;
constexpr const char* kLockFile = "launcher.lock";
constexpr const char* kStateFile = "state.json";

/// A POSIX record lock over the whole file: unlike flock(2) it tells who holds it.
struct flock whole_file() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

ProcessState state_from(std::string_view text) {
  for (const ProcessState state : {ProcessState::kStarting, ProcessState::kReady, ProcessState::kStopping, ProcessState::kRestarting,
                                   ProcessState::kExited, ProcessState::kFailed}) {
    if (text == to_string(state)) return state;
  }
  return ProcessState::kStopped;
}

}  // namespace

RunDirectory::RunDirectory(fs::path folder) : folder_{std::move(folder)} {
  fs::create_directories(folder_ / "log");
  const fs::path path = folder_ / kLockFile;
  lock_ = UniqueFd{::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
  if (!lock_) throw std::system_error{errno, std::generic_category(), path.string()};
  struct flock lock = whole_file();
  if (::fcntl(lock_.get(), F_SETLK, &lock) != 0) throw AlreadyUp{holder(folder_).value_or(0)};
  for (const auto& entry : fs::directory_iterator{folder_ / "log"}) {
    if (entry.path().extension() == ".log") fs::remove(entry.path());
  }
}

fs::path RunDirectory::log_file(const std::string& process) const { return folder_ / "log" / (process + ".log"); }

void RunDirectory::write(const CellState& state) const noexcept {
  try {
    nlohmann::json json{{"launcher", state.launcher},
                        {"phase", state.phase},
                        {"config_file", state.config_file},
                        {"started_utc_s", state.started_utc_s},
                        {"processes", nlohmann::json::array()}};
    for (const ProcessInfo& info : state.processes) {
      json["processes"].push_back({{"name", info.name},
                                   {"state", to_string(info.state)},
                                   {"pid", info.pid},
                                   {"restarts", info.restarts},
                                   {"status", info.status},
                                   {"reason", info.reason},
                                   {"ran_s", to_seconds(info.ran)},
                                   {"cpu_s", to_seconds(info.cpu_time)},
                                   {"peak_rss_bytes", info.peak_rss_bytes}});
    }
    const fs::path next = folder_ / (std::string{kStateFile} + ".new");
    std::ofstream{next} << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    fs::rename(next, folder_ / kStateFile);
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): see the declaration
  }
}

std::optional<pid_t> RunDirectory::holder(const fs::path& folder) {
  const UniqueFd file{::open((folder / kLockFile).c_str(), O_RDWR | O_CLOEXEC)};
  struct flock lock = whole_file();
  if (!file || ::fcntl(file.get(), F_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) return std::nullopt;
  return lock.l_pid;
}

std::optional<CellState> RunDirectory::read(const fs::path& folder) {
  try {
    std::ifstream file{folder / kStateFile};
    const nlohmann::json json = nlohmann::json::parse(file);
    CellState state{json.at("launcher"), json.at("phase"), json.at("config_file"), json.at("started_utc_s")};
    for (const auto& entry : json.at("processes")) {
      ProcessInfo info;
      info.name = entry.at("name");
      info.state = state_from(entry.at("state").get<std::string>());
      info.pid = entry.at("pid");
      info.restarts = entry.at("restarts");
      info.status = entry.at("status");
      info.reason = entry.at("reason");
      info.ran = from_seconds(entry.at("ran_s"));
      info.cpu_time = from_seconds(entry.at("cpu_s"));
      info.peak_rss_bytes = entry.at("peak_rss_bytes");
      state.processes.push_back(std::move(info));
    }
    return state;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace breakshot::launcher
