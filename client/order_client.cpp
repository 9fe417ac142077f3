#include "client/order_client.hpp"

#include <algorithm>
#include <chrono>

namespace breakshot::client {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

std::int64_t utc_ns() { return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count(); }

// Resent with the same id after this long, then doubling up to the longest (reference/dds-mes-systemd.md 3.3, rule 2).
constexpr Duration kFirstResend = milliseconds{250};
constexpr Duration kLongestResend = milliseconds{2000};

}  // namespace

OrderClient::OrderClient(int domain, std::uint32_t robot_id, const std::vector<std::string>& interfaces)
    : robot_id_{robot_id}, session_{static_cast<std::uint64_t>(utc_ns())}, participant_{domain, "breakshot-client", interfaces} {}

mes::Header OrderClient::header() {
  mes::Header h;
  h.robot_id = robot_id_;
  h.source_id = source_;
  h.session = session_;
  h.seq = ++seq_;
  h.stamp_utc_ns = utc_ns();
  return h;
}

mes::Command OrderClient::command(mes::Verb verb, const mes::Id& order_id) {
  mes::Command c;
  c.header = header();
  c.command_id = mes::random_id();
  c.order_id = order_id;
  c.verb = verb;
  return c;
}

std::optional<mes::Ack> OrderClient::send(mes::Command command, Duration patience) {
  const auto give_up = steady_clock::now() + patience;
  Duration resend = kFirstResend;
  while (steady_clock::now() < give_up) {
    command.header.stamp_utc_ns = utc_ns();
    commands_.write(command);
    const auto resend_at = std::min(give_up, steady_clock::now() + resend);
    mes::Ack ack;
    while (acks_.take(ack, resend_at - steady_clock::now())) {
      if (ack.command_id == command.command_id) return ack;
    }
    resend = std::min(2 * resend, kLongestResend);
  }
  return std::nullopt;
}

std::optional<mes::JobState> OrderClient::next_job(const mes::Id& order_id, Duration timeout) {
  const auto give_up = steady_clock::now() + timeout;
  mes::JobState job;
  while (jobs_.take(job, give_up - steady_clock::now())) {
    if (job.order_id == order_id) return job;
  }
  return std::nullopt;
}

std::optional<mes::RobotStatus> OrderClient::next_status(Duration timeout) {
  const auto give_up = steady_clock::now() + timeout;
  mes::RobotStatus status;
  while (statuses_.take(status, give_up - steady_clock::now())) {
    if (status.header.robot_id == robot_id_) return status;
  }
  return std::nullopt;
}

bool OrderClient::wait_until_accepting(Duration patience, std::string& why) {
  const auto give_up = steady_clock::now() + patience;
  why = "no robot status was heard: is the cell up, and is this its MES domain?";
  while (steady_clock::now() < give_up) {
    const auto status = next_status(give_up - steady_clock::now());
    if (!status) continue;
    if (status->accepting) return true;
    why = std::string{"the robot is "} + mes::to_string(status->state) + " and takes no order now";
  }
  return false;
}

}  // namespace breakshot::client
