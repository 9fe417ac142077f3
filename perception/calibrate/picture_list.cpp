#include "perception/calibrate/picture_list.hpp"

#include "common/config/config_node.hpp"
#include "perception/calibrate/board.hpp"

#include <numbers>

namespace breakshot::perception {
namespace {

template <typename Value, typename Read>
PictureList<Value> load(const std::filesystem::path& file, Read&& read) {
  const ConfigDocument document = ConfigDocument::load(file);
  PictureList<Value> list{file, {}};
  for (const ConfigNode& node : document.root().items("pictures")) {
    const std::string image = node.text("image");
    if (!list.pictures.emplace(image, read(node)).second) node.refuse("image", image + " a second time", "each picture once");
  }
  document.root().finish();
  return list;
}

}  // namespace

PictureList<JointVector> load_joints_file(const std::filesystem::path& file, int joints) {
  return load<JointVector>(file, [&](const ConfigNode& node) -> JointVector {
    const auto degrees = node.numbers("q_deg", static_cast<std::size_t>(joints), {-360.0, 360.0}, "deg");
    return std::numbers::pi / 180.0 * Eigen::Map<const Eigen::VectorXd>{degrees.data(), joints};
  });
}

PictureList<Pose> load_places_file(const std::filesystem::path& file) { return load<Pose>(file, read_place); }

}  // namespace breakshot::perception
