#pragma once

#include "common/dds/topic.hpp"
#include "idl/mesPubSubTypes.h"
#include "mes_gateway/protocol/messages.hpp"

namespace breakshot::dds {

/// Declares Topic<mes::VALUE>, which travels as the generated type WIRE.
#define BREAKSHOT_MES_TOPIC(VALUE, WIRE, NAME, PROFILE)            \
  template <>                                                      \
  struct Topic<mes::VALUE> {                                       \
    using Wire = breakshot_mes_msgs::msg::WIRE;                    \
    using WireSupport = breakshot_mes_msgs::msg::WIRE##PubSubType; \
    static constexpr const char* kName = "rt/" NAME;               \
    static constexpr Profile kProfile = PROFILE;                   \
    static void encode(const mes::VALUE& value, Wire& wire);       \
    static Result<mes::VALUE, Invalid> decode(const Wire& wire);   \
  }

// A command with absurd numbers or an unknown verb still gets through this door, because the sender is owed an ack that says what is wrong: see
// mes_gateway/order_desk.hpp. The other topics are checked here.
BREAKSHOT_MES_TOPIC(Command, JobCommand, "mes/command", Profile::kRequest);
BREAKSHOT_MES_TOPIC(Ack, CommandAck, "mes/ack", Profile::kRequest);
BREAKSHOT_MES_TOPIC(JobState, JobState, "mes/job", Profile::kLatched);
BREAKSHOT_MES_TOPIC(RobotStatus, RobotStatus, "mes/status", Profile::kLatched);
BREAKSHOT_MES_TOPIC(Alarm, AlarmState, "mes/alarm", Profile::kLatched);
BREAKSHOT_MES_TOPIC(Heartbeat, Heartbeat, "mes/heartbeat", Profile::kStream);

#undef BREAKSHOT_MES_TOPIC

}  // namespace breakshot::dds
