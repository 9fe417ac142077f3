#include "mes_gateway/protocol/messages.hpp"

#include <fmt/core.h>

#include <random>

namespace breakshot::mes {

namespace {

/// The name at the value's place, or "invalid" for a number that came from outside the enumeration.
template <std::size_t N, typename E>
const char* name_of(const std::array<const char*, N>& names, E value) noexcept {
  const auto index = static_cast<std::size_t>(value);
  return index < N ? names[index] : "invalid";
}

}  // namespace

const char* to_string(Verb verb) noexcept {
  static constexpr std::array kNames{"STORE", "STORE_AND_START", "START", "PAUSE",    "RESUME",    "CANCEL",     "STOP",
                                     "ABORT", "CLEAR",           "RESET", "SET_MODE", "ACK_ALARM", "ACK_RESULT", "QUERY"};
  return name_of(kNames, verb);
}

const char* to_string(Verdict verdict) noexcept {
  static constexpr std::array kNames{"ACCEPTED", "REJECTED", "DUPLICATE"};
  return name_of(kNames, verdict);
}

const char* to_string(JobPhase phase) noexcept {
  static constexpr std::array kNames{"NOT_ALLOWED_TO_START", "ALLOWED_TO_START", "RUNNING", "INTERRUPTED", "ENDED", "ABORTED"};
  return name_of(kNames, phase);
}

const char* to_string(PackState state) noexcept {
  static constexpr std::array kNames{"STOPPED",   "RESETTING",    "IDLE",    "STARTING", "EXECUTE",  "COMPLETING",
                                     "COMPLETE",  "ABORTING",     "ABORTED", "STOPPING", "CLEARING", "SUSPENDING",
                                     "SUSPENDED", "UNSUSPENDING", "HOLDING", "HELD",     "UNHOLDING"};
  return name_of(kNames, state);
}

const char* to_string(Reason reason) noexcept {
  static constexpr std::array kNames{"R_NONE",
                                     "R_MALFORMED",
                                     "R_VERSION",
                                     "R_UNKNOWN_ORDER",
                                     "R_OUTDATED_REV",
                                     "R_SAME_REV_DIFFERS",
                                     "R_OTHER_ORDER_ACTIVE",
                                     "R_QUEUE_FULL",
                                     "R_BAD_STATE",
                                     "R_BAD_MODE",
                                     "R_UNSUPPORTED_PARAM",
                                     "R_OUT_OF_LIMITS",
                                     "R_STALE",
                                     "R_NOT_AUTHORISED",
                                     "R_SAFETY_STOP",
                                     "R_NOT_READY",
                                     "R_ORDER_CLOSED",
                                     "R_INTERNAL"};
  return name_of(kNames, reason);
}

std::string to_text(const Id& id) {
  std::string text;
  for (std::size_t i = 0; i < id.size(); ++i) {
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += fmt::format("{:02x}", id[i]);
  }
  return text;
}

Id random_id() {
  std::random_device device;
  Id id{};
  for (auto& byte : id) byte = static_cast<std::uint8_t>(device());
  id[6] = static_cast<std::uint8_t>((id[6] & 0x0fU) | 0x40U);  // version 4: random (RFC 9562)
  id[8] = static_cast<std::uint8_t>((id[8] & 0x3fU) | 0x80U);
  return id;
}

}  // namespace breakshot::mes
