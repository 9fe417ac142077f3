#pragma once

#include "client/demo/observer.hpp"
#include "common/config/cell_config.hpp"

#include <filesystem>
#include <string>

namespace breakshot::client {

/// Writes the pictures of a run into one folder.
class PictureBook {
 public:
  /// Makes the folder. @throws std::filesystem::filesystem_error
  PictureBook(std::filesystem::path folder, const CellConfig& cell);

  /// One annotated picture of a scene; with the stroke and its prediction when `record.plan` has one. Does nothing for a record without its frame.
  /// @param file  e.g. "before.png"
  /// @return whether it was written
  bool write(const std::string& file, const DecisionRecord& record, const CameraModel& camera, const std::string& headline) const;

  const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  std::filesystem::path folder_;
  const CellConfig& cell_;
};

}  // namespace breakshot::client
