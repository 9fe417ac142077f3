#pragma once

#include "common/dds/endpoint.hpp"
#include "mes_gateway/protocol/mes_topics.hpp"

#include <functional>
#include <optional>
#include <string>

namespace breakshot::client {

/// Speaks to a cell as a factory control system would: sends commands until they are acknowledged and follows an order.
///
/// One thread at a time.
class OrderClient {
 public:
  /// @param domain      the cell's MES domain
  /// @param interfaces  IPv4 addresses to bind to; empty: all
  OrderClient(int domain, std::uint32_t robot_id, const std::vector<std::string>& interfaces = {"127.0.0.1"});

  /// A command for this robot with a fresh id, filled in header and the verb.
  mes::Command command(mes::Verb verb, const mes::Id& order_id);

  /// Sends the command, again and again with the same id, until an ack comes.
  /// @return nothing when none came within `patience`: then the fate of the command is unknown, not refused
  std::optional<mes::Ack> send(mes::Command command, Duration patience);

  /// The next change of the job state of an order; nothing when none came within `timeout`.
  std::optional<mes::JobState> next_job(const mes::Id& order_id, Duration timeout);
  /// The next robot status; nothing when none came within `timeout`.
  std::optional<mes::RobotStatus> next_status(Duration timeout);
  /// Waits until the cell would take an order. @return whether it does; `why` gets the last that was heard
  bool wait_until_accepting(Duration patience, std::string& why);

 private:
  mes::Header header();

  std::uint32_t robot_id_;
  mes::Id source_ = mes::random_id();
  std::uint64_t session_;
  std::uint64_t seq_ = 0;
  dds::Participant participant_;
  dds::Writer<mes::Command> commands_{participant_};
  dds::Reader<mes::Ack> acks_{participant_};
  dds::Reader<mes::JobState> jobs_{participant_};
  dds::Reader<mes::RobotStatus> statuses_{participant_};
};

}  // namespace breakshot::client
