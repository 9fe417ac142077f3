#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>

namespace breakshot::perception {

/// What a file (`pictures`: a list of maps, each with an `image`) says of each picture, by its file's name.
template <typename Value>
struct PictureList {
  std::filesystem::path file;
  std::map<std::string, Value> pictures;

  /// @throws std::runtime_error when the file does not name the picture
  const Value& of(const std::string& picture) const {
    const auto found = pictures.find(picture);
    if (found == pictures.end()) throw std::runtime_error(file.string() + ": found nothing of the picture " + picture);
    return found->second;
  }
};

/// Where the arm's joints were: `q_deg`; here rad. @param joints  of the arm. @throws ConfigError
PictureList<JointVector> load_joints_file(const std::filesystem::path& file, int joints);

/// Where on the table the board lay: `p_WP` and `yaw_deg`, as in the board's own file. @throws ConfigError
PictureList<Pose> load_places_file(const std::filesystem::path& file);

}  // namespace breakshot::perception
