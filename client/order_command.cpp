#include "client/order_command.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot::client {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr Duration kAckPatience = seconds{5};
// The controller waits for the arm to rest, the gateway for the controller: both give up before this.
constexpr Duration kRecoverPatience = seconds{15};
constexpr Duration kPoll = milliseconds{200};
constexpr Duration kRetryEvery = seconds{1};
// A cell that accepted an order tells of it at every change, and a stroke with its settling takes seconds; silence beyond this means that it is gone.
constexpr Duration kJobSilence = seconds{60};

void say(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

std::string gap_text(double gap) { return std::isfinite(gap) ? fmt::format("{:.1f} mm", gap * 1e3) : std::string{"-"}; }

bool is_final(mes::JobPhase phase) { return phase == mes::JobPhase::kEnded || phase == mes::JobPhase::kAborted; }

/// Sends the order; tries again with a fresh command while the cell says that it is not ready yet.
std::optional<mes::Ack> place(OrderClient& client, const OrderOptions& options, const mes::Id& order,
                              const std::atomic<bool>& interrupted) {
  const auto give_up = steady_clock::now() + options.wait_ready;
  std::optional<mes::Ack> ack;
  std::string last_why;
  while (!interrupted) {
    mes::Command command = client.command(mes::Verb::kStoreAndStart, order);
    command.spec = options.spec;
    ack = client.send(command, kAckPatience);
    if (!ack || ack->reason != mes::Reason::kNotReady || steady_clock::now() >= give_up) break;
    if (ack->text != last_why) say("waiting for the cell: " + ack->text);
    last_why = ack->text;
    std::string unused;
    client.wait_until_accepting(std::min<Duration>(kRetryEvery, give_up - steady_clock::now()), unused);
  }
  return ack;
}

}  // namespace

int run_order(OrderClient& client, const OrderOptions& options, const std::atomic<bool>& interrupted) {
  const mes::Id order = mes::random_id();
  say("order " + mes::to_text(order));
  const auto ack = place(client, options, order, interrupted);
  if (!ack) {
    say("no answer from the cell: is it up (./breakshot status), and is this its MES domain? The order may or may not have been taken.");
    return kExitNoAnswer;
  }
  say(fmt::format("{} {}{}", mes::to_string(ack->verdict), mes::to_string(ack->reason), ack->text.empty() ? "" : ": " + ack->text));
  if (ack->verdict == mes::Verdict::kRejected) return kExitRejected;
  if (options.detach) return kExitEnded;

  const auto begin = steady_clock::now();
  auto heard = begin;
  bool cancelled = false;
  while (true) {
    if (interrupted && !cancelled) {
      cancelled = true;
      say("interrupted: cancelling the order");
      client.send(client.command(mes::Verb::kCancel, order), kAckPatience);
    }
    const auto job = client.next_job(order, kPoll);
    const auto now = steady_clock::now();
    if (!job) {
      if (now - heard < kJobSilence) continue;
      say(fmt::format("the cell has said nothing of this order for {:.0f} s", to_seconds(kJobSilence)));
      return kExitNoAnswer;
    }
    heard = now;
    say(fmt::format("{:6.1f} s  {:<16}  {}/{} singulated  {} hits  {} pushes  smallest gap {}{}", to_seconds(now - begin),
                    mes::to_string(job->phase), job->discs_singulated, job->discs_seen, job->hits, job->pushes, gap_text(job->min_gap),
                    job->text.empty() ? "" : "  " + job->text));
    if (is_final(job->phase)) return job->phase == mes::JobPhase::kEnded ? kExitEnded : kExitAborted;
  }
}

int run_recover(OrderClient& client) {
  const auto ack = client.send(client.command(mes::Verb::kClear, {}), kRecoverPatience);
  if (!ack) {
    say("no answer from the cell: is it up (./breakshot status)?");
    return kExitNoAnswer;
  }
  const bool done = ack->verdict != mes::Verdict::kRejected;
  say(fmt::format("{}: {}", done ? "recovered" : "not recovered", ack->text));
  return done ? kExitEnded : kExitRejected;
}

int run_cancel(OrderClient& client) {
  const auto ack = client.send(client.command(mes::Verb::kStop, {}), kAckPatience);
  if (!ack) {
    say("no answer from the cell: is it up (./breakshot status)?");
    return kExitNoAnswer;
  }
  say(fmt::format("{}{}", mes::to_string(ack->verdict), ack->text.empty() ? "" : ": " + ack->text));
  return ack->verdict == mes::Verdict::kRejected ? kExitRejected : kExitEnded;
}

}  // namespace breakshot::client
