#include "common/config/camera_file.hpp"

#include "common/config/config_node.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot {
namespace {

Vector3 read_direction(const ConfigNode& node, std::string_view key) {
  const Vector3 direction = node.vector3(key, {-1.0, 1.0}, "");
  if (direction.norm() < 1e-3) node.refuse(key, "a vector of length zero", "a direction");
  return direction.normalized();
}

Pose read_pose(const ConfigNode& node) {
  const Vector3 forward = read_direction(node, "looks_along_W");
  const Vector3 right = read_direction(node, "image_x_along_W");
  // Within this the two are made exactly orthogonal; more is a mistake in the file and not rounding.
  constexpr double kOrthogonal = 1e-3;
  if (std::abs(forward.dot(right)) > kOrthogonal) {
    node.refuse("image_x_along_W", "a direction that is not orthogonal to looks_along_W", "an orthogonal direction");
  }
  Pose X_WC{Pose::Identity()};
  X_WC.translation() = node.vector3("p_WC", {-5.0, 5.0});
  X_WC.linear().col(2) = forward;
  X_WC.linear().col(0) = (right - forward * forward.dot(right)).normalized();
  X_WC.linear().col(1) = X_WC.linear().col(2).cross(X_WC.linear().col(0));
  return X_WC;
}

/// How steeply the flattest ray of the image falls: the largest z in W of all unit rays through the border, negative when all fall.
double flattest_ray(const CameraModel& camera) {
  double flattest = -1.0;
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Vector2 pixel{x * (camera.width - 1), y * (camera.height - 1)};
      const Vector3 ray_C = Vector3{(pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy, 1.0}.normalized();
      flattest = std::max(flattest, (camera.X_WC.linear() * ray_C).z());
    }
  }
  return flattest;
}

CameraModel read_camera(const ConfigDocument& document) {
  const ConfigNode node = document.section("camera");
  CameraModel camera;
  camera.width = static_cast<int>(node.integer("width", 64, 4096));
  camera.height = static_cast<int>(node.integer("height", 64, 4096));
  camera.fx = node.number("fx", {50.0, 10000.0}, "px");
  camera.fy = node.number("fy", {50.0, 10000.0}, "px");
  camera.cx = node.number("cx", {0.0, camera.width - 1.0}, "px");
  camera.cy = node.number("cy", {0.0, camera.height - 1.0}, "px");
  const auto distortion = node.numbers("distortion", camera.distortion.size(), {-2.0, 2.0}, "");
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  camera.X_WC = read_pose(node);
  document.root().finish();

  if (camera.X_WC.translation().z() < 0.2) node.refuse("p_WC", "a camera lower than 0.2 m above the table", "z >= 0.2 m");
  // A ray flatter than about 5 degrees meets the table metres away, where a pixel is worth nothing.
  if (flattest_ray(camera) > -0.1) node.refuse("looks_along_W", "rays of the image that do not meet the table", "a camera that looks down");
  // The distortion must be one that can be undone over the whole image, or positions near its border would be silently wrong.
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Vector2 pixel{x * (camera.width - 1), y * (camera.height - 1)};
      const Vector2 p_W = camera.point_on_plane(pixel, 0.0);
      const auto back = camera.project({p_W.x(), p_W.y(), 0.0});
      if (!back || !((*back - pixel).norm() < 1e-6)) {
        node.refuse("distortion", "a distortion that cannot be undone at the border of the image", "that of a real lens");
      }
    }
  }
  return camera;
}

std::string list(int decimals, const double* values, int count) {
  std::string text = "[";
  for (int i = 0; i < count; ++i) {
    char number[40];
    std::snprintf(number, sizeof number, "%.*f", decimals, values[i]);
    text += (i == 0 ? "" : ", ") + std::string{number};
  }
  return text + "]";
}

}  // namespace

CameraModel load_camera(const std::filesystem::path& file) { return read_camera(ConfigDocument::load(file)); }
CameraModel parse_camera(std::string_view text, const std::filesystem::path& name) {
  return read_camera(ConfigDocument::parse(text, name));
}

std::string camera_text(const CameraModel& camera, const std::string& note) {
  const Vector3 p = camera.X_WC.translation(), forward = camera.X_WC.linear().col(2), right = camera.X_WC.linear().col(0);
  char head[400];
  std::snprintf(head, sizeof head,
                "camera:\n  width: %d                     # px\n  height: %d\n  fx: %.6f                # px\n  fy: %.6f\n  cx: %.6f       "
                "         # px; pixel "
                "centres are at whole numbers\n  cy: %.6f\n",
                camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy);
  return "# " + note + "\n\n" + head + "  distortion: " + list(9, camera.distortion.data(), 5) +
         "  # Brown-Conrady k1 k2 p1 p2 k3, as OpenCV has them\n" + "  p_WC: " + list(9, p.data(), 3) + "  # m\n" +
         "  looks_along_W: " + list(12, forward.data(), 3) + "\n" + "  image_x_along_W: " + list(12, right.data(), 3) + "\n";
}

}  // namespace breakshot
