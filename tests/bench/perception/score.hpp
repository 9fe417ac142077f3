#pragma once

#include "common/scene.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <vector>

namespace breakshot::bench {

/// A circle that a method found.
struct FoundDisc {
  Vector2 p_WD{0.0, 0.0};
  double radius = 0.0;
  bool has_covariance = false;
  Matrix2 covariance{Matrix2::Zero()};
  double radius_sigma = 0.0;
};

/// What a method makes of one picture.
struct Finding {
  std::vector<FoundDisc> discs;
  std::vector<std::pair<std::size_t, std::size_t>> touching;  ///< pairs of them that it calls touching, the smaller index first
  std::size_t foreign = 0;                                    ///< objects that it calls neither disc nor table
  double cpu_ms = 0.0;
};

/// Errors of one method over many pictures of one lighting.
class Score {
 public:
  void add(const Finding& finding, std::span<const sim_bridge::DiscState> truth);

  bool verbose = false;  ///< name every disc that is missed or measured poorly
  double f1() const noexcept;
  /// Metrics as in design.md, section 7, without the method's name.
  nlohmann::json metrics() const;
  void print_row(const std::string& lighting, const std::string& method) const;
  static void print_head();

  int scenes = 0, discs = 0, missed = 0, invented = 0;
  int foreign = 0;         ///< alarms, all of them false: there are but discs
  int false_contacts = 0;  ///< pairs called touching that are at least kFar apart: the kind of the paper's Fig. 12e
  double centre2 = 0.0, centre_max = 0.0, radius2 = 0.0, radius_max = 0.0, radius_sum = 0.0;
  int gaps = 0;
  double gap2 = 0.0, gap_sum = 0.0, gap_max = 0.0, gap_nees = 0.0;
  std::vector<double> cpu_ms;

 private:
  static constexpr double kTouch = 0.5e-3;   // m: pairs nearer than this touch
  static constexpr double kFar = 1.0e-3;     // m
  static constexpr double kClear = 0.15e-3;  // m about kTouch within which neither answer counts in f1_clear
  static constexpr double kMatch = 5e-3;     // m from a disc's centre within which a circle is that disc's

  int tp_ = 0, fp_ = 0, fn_ = 0, fp_clear_ = 0, fn_clear_ = 0;
  double nees_ = 0.0, radius_nees_ = 0.0;
  int with_covariance_ = 0, scenes_in_band_ = 0, scenes_with_covariance_ = 0;
};

}  // namespace breakshot::bench
