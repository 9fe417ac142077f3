#pragma once

#include "common/geometry.hpp"
#include "common/time.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace breakshot {

// What tests and scoring say to the simulator and hear from it. No process of the cell but sim_bridge knows these topics: ground truth
// must not leak into perception or planning.

/// A disc as it truly is.
struct SimDisc {
  Vector2 p_WD{0.0, 0.0};    ///< m
  Vector2 v_WD_W{0.0, 0.0};  ///< m/s
  double yaw = 0.0;          ///< rad
  double radius = 0.030;     ///< m
  double height = 0.020;     ///< m
  double mass = 0.1;         ///< kg
  std::uint8_t colour = 0;   ///< index into the colour table of the configuration
  bool on_table = true;      ///< false once it slid over the table's edge
};

/// Travels on `sim/control`.
struct SimControl {
  enum class Verb : std::uint8_t {
    kReset = 0,     ///< put discs on the table: `formation` when not empty, else `discs`; the arm stays where it is
    kSetFault = 1,  ///< see sim_bridge/faults.hpp
    kClearFaults = 2,
  };
  std::uint64_t seq = 0;  ///< echoed in SimTruth::control_seq when it was carried out
  Verb verb = Verb::kReset;
  std::uint8_t fault = 0;
  double fault_value = 0.0;
  std::string formation;       ///< a formation spec ("fig11", "random:n=6,seed=3"); at most 255 characters
  std::vector<SimDisc> discs;  ///< of kReset; with the fault that is a block: one, of which place, radius and height count
};

/// Travels on `sim/truth` at 100 Hz.
struct SimTruth {
  std::uint64_t seq = 0;
  std::uint64_t control_seq = 0;  ///< last SimControl::seq carried out
  Time stamp{};
  Vector3 p_WT{Vector3::Zero()};  ///< striker tip, m
  Vector3 v_WT_W{Vector3::Zero()};
  double kinetic_energy = 0.0;  ///< of the discs, J
  std::uint32_t strikes = 0;    ///< striker-disc contact episodes since the last reset
  std::vector<SimDisc> discs;
};

}  // namespace breakshot
