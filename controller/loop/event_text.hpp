#pragma once

#include "controller/loop/channels.hpp"

#include <string>

namespace breakshot::control {

/// All causes of a set, for people: "no fresh joint state; a stop was asked for".
std::string describe(safety::CauseSet causes);
/// An event, for people: what was found and what is allowed.
std::string describe(const LoopEvent& event);

}  // namespace breakshot::control
