#include "sim_bridge/node/control_desk.hpp"

#include "common/config/formation.hpp"
#include "common/process/cell_clock.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

namespace breakshot::sim_bridge {
namespace {

/// The same request again within this time is a repetition of one whose answer got lost; later it is a new wish.
constexpr Duration kRepetition = std::chrono::seconds{2};

bool same(const SimControl& a, const SimControl& b) {
  return a.seq == b.seq && a.verb == b.verb && a.fault == b.fault && a.fault_value == b.fault_value && a.formation == b.formation &&
         a.discs.size() == b.discs.size();
}

}  // namespace

Result<WorldOrder, std::string> prepare(const SimControl& request, const SimBridgeConfig& config, const CellConfig& cell) {
  WorldOrder order;
  order.control_seq = request.seq;
  order.verb = request.verb;
  order.fault = request.fault;
  order.fault_value = request.fault_value;
  switch (request.verb) {
    case SimControl::Verb::kReset:
      if (request.formation.empty()) {
        order.discs = request.discs;
        order.what = fmt::format("reset to {} given discs", order.discs.size());
        for (std::size_t i = 0; i < order.discs.size(); ++i) {
          if (order.discs[i].colour < cell.colours.size()) continue;
          return fmt::format("disc {}: colour {}; allowed: 0 to {}", i, order.discs[i].colour, cell.colours.size() - 1);
        }
        break;
      }
      try {
        order.discs = discs_of(load_formation(request.formation, cell), config, cell);
      } catch (const ConfigError& error) {
        return std::string{error.what()};
      }
      order.what = fmt::format("reset to formation {}", request.formation);
      break;
    case SimControl::Verb::kSetFault:
      order.discs = request.discs;
      order.what = fmt::format("set fault {} to {}", to_string(Fault{request.fault}), request.fault_value);
      break;
    case SimControl::Verb::kClearFaults: order.what = "clear all faults"; break;
  }
  return order;
}

ControlDesk::ControlDesk(dds::Participant& participant, const SimBridgeConfig& config, const CellConfig& cell, Mailbox<WorldOrder>& orders)
    : config_{config}, cell_{cell}, orders_{orders}, reader_{participant}, thread_{[this](const std::stop_token& stop) { run(stop); }} {}

ControlDesk::~ControlDesk() {
  thread_.request_stop();
  reader_.wake();
}

void ControlDesk::run(const std::stop_token& stop) {
  SimControl request;
  std::optional<SimControl> last;
  Time last_came{};
  while (!stop.stop_requested()) {
    if (!reader_.take(request, std::chrono::milliseconds{500})) continue;
    const Time now = process::monotonic_now();
    const bool repetition = last && same(*last, request) && now - last_came < kRepetition;
    last_came = now;
    if (repetition) continue;
    last = request;
    auto order = prepare(request, config_, cell_);
    if (order) {
      orders_.put(std::move(*order));
    } else {
      spdlog::error("code=control_refused control={} {}", request.seq, order.error());
    }
  }
}

}  // namespace breakshot::sim_bridge
