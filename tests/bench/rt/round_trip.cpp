#include "tests/bench/rt/round_trip.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/scheduling.hpp"
#include "controller/rt/periodic_timer.hpp"
#include "controller/rt/wakeup.hpp"
#include "tests/bench/rt/bare_endpoint.hpp"
#include "tests/bench/rt/child_program.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <stdexcept>
#include <vector>

namespace breakshot::bench {

namespace {

using WireCommand = breakshot_msgs::msg::JointCommand;
using WireCommandSupport = breakshot_msgs::msg::JointCommandPubSubType;
using WireState = breakshot_msgs::msg::JointState;
using WireStateSupport = breakshot_msgs::msg::JointStatePubSubType;
using BarePinger = BareEndpoint<WireCommand, WireCommandSupport, WireState, WireStateSupport>;
using BareEcho = BareEndpoint<WireState, WireStateSupport, WireCommand, WireCommandSupport>;

// Not the cell's own names: nothing that this program sends may ever reach drives.
constexpr const char* kOurCommands = "rt/bench/ours/joint_command";
constexpr const char* kOurStates = "rt/bench/ours/joint_state";
constexpr const char* kBareCommands = "rt/bench/bare/joint_command";
constexpr const char* kBareStates = "rt/bench/bare/joint_state";

constexpr int kTurn = 250;
constexpr Duration kPeriod = std::chrono::milliseconds{1};
constexpr Duration kLost = std::chrono::milliseconds{100};
/// For the other process to start and to be discovered.
constexpr Duration kMeet = std::chrono::seconds{15};

/// Where the state that acknowledges a command comes in.
class Answers {
 public:
  /// On a DDS thread.
  void arrived(std::uint64_t command_seq) noexcept {
    const Time now = rt::monotonic_now();
    when_ns_.store(to_ns(now), std::memory_order_relaxed);
    command_seq_.store(command_seq, std::memory_order_release);
    came_.notify();
  }
  /// Waits for the answer to this command. @return when it arrived; nothing when it did not
  std::optional<Time> wait(std::uint64_t command_seq) noexcept {
    const Time until = rt::monotonic_now() + kLost;
    while (command_seq_.load(std::memory_order_acquire) != command_seq) {
      const Time now = rt::monotonic_now();
      if (now >= until) return std::nullopt;
      came_.wait(until - now);
    }
    return time_from_ns(when_ns_.load(std::memory_order_relaxed));
  }

 private:
  std::atomic<std::uint64_t> command_seq_{0};
  std::atomic<std::int64_t> when_ns_{0};
  rt::WakeupSignal came_;
};

JointCommand a_command() {
  JointCommand command;
  command.session = 1;
  command.q = command.qd = command.qdd = JointVector::Constant(6, 0.5);
  return command;
}

JointState a_state() {
  JointState state;
  state.session = 2;
  state.q = state.qd = state.tau = JointVector::Constant(6, 0.5);
  return state;
}

/// A round trip of either kind: sends a command with this number.
template <typename Send>
std::optional<Duration> ping(std::uint64_t seq, Answers& answers, Send&& send) {
  const Time sent = rt::monotonic_now();
  send(seq);
  const auto arrived = answers.wait(seq);
  if (!arrived) return std::nullopt;
  return *arrived - sent;
}

/// Until the other side answers. @return the next number to send
template <typename Send>
std::uint64_t meet(const char* kind, Answers& answers, Send&& send) {
  std::uint64_t seq = 1;
  const Time until = rt::monotonic_now() + kMeet;
  while (!ping(seq++, answers, send)) {
    if (rt::monotonic_now() > until) throw std::runtime_error(fmt::format("the {} echo process does not answer", kind));
  }
  return seq;
}

}  // namespace

double RoundTrips::ratio(double p) const noexcept { return to_seconds(ours.quantile(p)) / to_seconds(bare.quantile(p)); }

RoundTrips measure_round_trips(const RoundTripSettings& settings) {
  const auto echo = [&](const char* kind) {
    return std::vector<std::string>{fmt::format("--echo={}", kind), fmt::format("--echo-domain={}", settings.domain),
                                    fmt::format("--echo-priority={}", settings.priority)};
  };
  const ChildProgram our_echo{echo("ours")};
  const ChildProgram bare_echo{echo("bare")};

  // This thread sends, as CommandSender's does, and DDS's threads inherit its scheduling.
  const process::InheritedFifo fifo{settings.priority};
  Answers our_answers;
  dds::Participant participant{settings.domain, "breakshot-bench-rt"};
  dds::Writer<JointCommand> commands{participant, kOurCommands};
  const dds::Subscription<JointState> states{participant, [&our_answers](JointState&& state) { our_answers.arrived(state.command_seq); },
                                             kOurStates};
  JointCommand command = a_command();
  const auto send_ours = [&](std::uint64_t seq) {
    command.seq = seq;
    commands.write(command);
  };

  Answers bare_answers;
  BarePinger bare{settings.domain, kBareCommands, kBareStates,
                  [&bare_answers](const WireState& state) { bare_answers.arrived(state.command_seq()); }};
  WireCommand wire;
  dds::Topic<JointCommand>::encode(a_command(), wire);
  const auto send_bare = [&](std::uint64_t seq) {
    wire.seq(seq);
    bare.send(wire);
  };

  std::uint64_t our_seq = meet("own", our_answers, send_ours);
  std::uint64_t bare_seq = meet("bare", bare_answers, send_bare);
  RoundTrips trips;
  rt::PeriodicTimer timer{kPeriod, rt::monotonic_now()};
  const auto turn = [&](int count, std::uint64_t& seq, Answers& answers, auto&& send, rt::Histogram& histogram, std::uint64_t& lost) {
    for (int i = 0; i < count; ++i) {
      timer.wait();
      if (const auto span = ping(seq++, answers, send)) {
        histogram.record(*span);
      } else {
        ++lost;
      }
    }
  };
  for (int left = settings.count; left > 0; left -= kTurn) {
    turn(std::min(kTurn, left), our_seq, our_answers, send_ours, trips.ours, trips.lost_ours);
    turn(std::min(kTurn, left), bare_seq, bare_answers, send_bare, trips.bare, trips.lost_bare);
  }
  return trips;
}

void run_echo(Link link, int domain, int priority) {
  const process::InheritedFifo fifo{priority};
  if (link == Link::kOurs) {
    dds::Participant participant{domain, "breakshot-bench-rt-echo"};
    dds::Writer<JointState> states{participant, kOurStates};
    JointState state = a_state();
    const dds::Subscription<JointCommand> commands{participant,
                                                   [&](JointCommand&& command) {
                                                     state.command_seq = command.seq;
                                                     states.write(state);
                                                   },
                                                   kOurCommands};
    while (true) pause();
  }
  WireState state;
  dds::Topic<JointState>::encode(a_state(), state);
  std::atomic<BareEcho*> self{nullptr};
  BareEcho echo{domain, kBareStates, kBareCommands, [&](const WireCommand& command) {
                  BareEcho* const endpoint = self;
                  if (endpoint == nullptr) return;  // not complete yet; the other side asks again
                  state.command_seq(command.seq());
                  endpoint->send(state);
                }};
  self = &echo;
  while (true) pause();
}

}  // namespace breakshot::bench
