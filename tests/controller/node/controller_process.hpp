#pragma once

#include "common/time.hpp"

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace breakshot::control::test {

/// A real breakshot-controller, started with config/cell.yaml and overrides. Its log goes to a file.
class ControllerProcess {
 public:
  explicit ControllerProcess(const std::vector<std::string>& overrides);
  /// Kills it when it still runs.
  ~ControllerProcess();
  ControllerProcess(const ControllerProcess&) = delete;
  ControllerProcess& operator=(const ControllerProcess&) = delete;
  ControllerProcess(ControllerProcess&&) = delete;
  ControllerProcess& operator=(ControllerProcess&&) = delete;

  void signal(int number) const;
  /// Exit status, 128 + signal when one ended it; nothing when it still runs after `patience`.
  std::optional<int> wait(Duration patience);
  std::string log() const;
  /// Whether `text` appears in the log within `patience`.
  bool says(const std::string& text, Duration patience) const;

 private:
  std::string log_path_;
  pid_t pid_ = -1;
};

}  // namespace breakshot::control::test
