#include "controller/loop/loop_config.hpp"

namespace breakshot::control {

safety::StateLimits gate_limits(const LoopConfig& config) noexcept {
  safety::StateLimits limits;
  limits.joints = config.limits;
  limits.position_margin = config.position_margin;
  limits.speed_factor = config.speed_factor;
  limits.max_age = config.max_state_age;
  limits.confirm_session = config.confirm_session;
  return limits;
}

LoopConfig lockstep(LoopConfig config) noexcept {
  config.lead = config.period;
  config.freshness.recover_samples = 1;
  config.confirm_session = 1;
  config.always_answer = true;
  return config;
}

}  // namespace breakshot::control
