#include "client/demo/pictures.hpp"

#include "perception/annotate.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace breakshot::client {

PictureBook::PictureBook(std::filesystem::path folder, const CellConfig& cell) : folder_{std::move(folder)}, cell_{cell} {
  std::filesystem::create_directories(folder_);
}

bool PictureBook::write(const std::string& file, const DecisionRecord& record, const CameraModel& camera,
                        const std::string& headline) const {
  if (!record.frame) return false;
  perception::Annotation annotation;
  annotation.workspace = cell_.workspace;
  annotation.disc_height = cell_.disc_height;
  annotation.striker_radius = cell_.striker_radius;
  annotation.target_gap = cell_.target_gap;
  annotation.headline = headline;
  annotation.detail = record.plan.why;
  if (record.plan.stroke.kind != StrokeKind::kPark) annotation.stroke = record.plan.stroke;
  annotation.predicted_p_WD = record.plan.predicted_p_WD;
  ColorFrame picture = perception::annotate(*record.frame, record.scene, camera, annotation);
  const cv::Mat rgb{picture.height, picture.width, CV_8UC3, picture.rgb.data()};
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return cv::imwrite((folder_ / file).string(), bgr);
}

}  // namespace breakshot::client
