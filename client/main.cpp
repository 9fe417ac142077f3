#include "client/order_command.hpp"
#include "client/status_command.hpp"
#include "common/config/cell_config.hpp"
#include "mes_gateway/mes_gateway_config.hpp"

#include <CLI/CLI.hpp>

#include <csignal>
#include <iostream>

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the signal handler may only touch lock-free atomics");

extern "C" void on_interrupt(int /*signal*/) { interrupted = true; }

}  // namespace

int main(int argc, char** argv) {
  using namespace breakshot;
  CLI::App app{"Talks to a running cell as a factory control system would.", "breakshot-client"};
  app.require_subcommand(1);
  std::string config_file;
  std::vector<std::string> overrides;
  app.add_option("--config", config_file, "The cell's configuration file")->required();
  app.add_option("--set", overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);

  client::OrderOptions options;
  auto* order = app.add_subcommand("order", "Send an order to singulate the table, and follow it");
  double gap_mm = 0.0;
  double timeout_s = 0.0;
  double wait_s = 10.0;
  std::vector<double> region;
  order->add_option("--gap-mm", gap_mm, "Smallest gap between any two discs, mm; 0: as configured");
  order->add_option("--region", region, "x_min y_min x_max y_max of the area to stay in, m; default: the whole workspace")->expected(4);
  order->add_option("--expect", options.spec.expect_discs, "Number of discs that must be seen; 0: any");
  order->add_option("--max-hits", options.spec.max_hits, "Give up after so many hits; 0: as configured");
  order->add_option("--max-pushes", options.spec.max_pushes, "Give up after so many pushes; 0: as configured");
  order->add_option("--timeout-s", timeout_s, "Give up after so many seconds; 0: as configured");
  order->add_option("--speed-scale", options.spec.speed_scale, "Scales the fastest hit, above 0 to 1")->capture_default_str();
  order->add_option("--wait-s", wait_s, "How long to wait for a cell that is not ready yet")
      ->check(CLI::Range(0.0, 600.0))
      ->capture_default_str();
  order->add_flag("--detach", options.detach, "Return as soon as the order is accepted");
  auto* stop = app.add_subcommand("stop", "Stop whatever order runs; the arm parks");
  auto* recover = app.add_subcommand("recover", "End the stop that the controller is in, if nothing stands in the way; nothing moves");
  auto* status = app.add_subcommand("status", "Show what every process says of itself");
  bool json = false;
  status->add_flag("--json", json, "One JSON object instead of a table");
  CLI11_PARSE(app, argc, argv);

  try {
    const auto document = load_cell_document(config_file, overrides);
    const CellConfig cell = load_cell_config(document);
    const auto gateway = mes::load_mes_gateway_config(document.section("mes_gateway"), cell);
    client::OrderClient client{cell.dds.mes, gateway.orders.robot_id, gateway.interfaces};
    if (*status) return client::run_status(cell.dds.cell, client, std::chrono::milliseconds{1500}, json);
    if (*stop) return client::run_cancel(client);
    if (*recover) return client::run_recover(client);
    options.spec.min_gap = gap_mm * 1e-3;
    // Not clamped here: an absurd number is for the cell to refuse, in its own words.
    options.spec.timeout_ms = static_cast<std::uint32_t>(std::clamp(timeout_s * 1e3, 0.0, 4e9));
    options.wait_ready = from_seconds(wait_s);
    if (region.size() == 4) options.spec.region = {{region[0], region[1]}, {region[2], region[3]}};
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
    return client::run_order(client, options, interrupted);
  } catch (const std::exception& error) {
    std::cerr << "breakshot-client: " << error.what() << '\n';
    return client::kExitNoAnswer;
  }
}
