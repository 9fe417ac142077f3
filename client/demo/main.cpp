#include "client/demo/observer.hpp"
#include "client/demo/pictures.hpp"
#include "client/demo/report.hpp"
#include "client/order_client.hpp"
#include "common/config/cell_config.hpp"
#include "mes_gateway/mes_gateway_config.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>

namespace breakshot::client {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

// Exit statuses.
constexpr int kSingulated = 0;
constexpr int kNotSingulated = 1;
constexpr int kNoCell = 3;

constexpr Duration kCellPatience = seconds{30};
constexpr Duration kAckPatience = seconds{5};
constexpr Duration kPoll = milliseconds{50};
// The order's own time limit is the cell's to keep; this one is for a cell that died.
constexpr Duration kSilence = seconds{90};

std::atomic<bool> interrupted{false};
extern "C" void on_interrupt(int /*signal*/) { interrupted = true; }

struct Arguments {
  std::string config;
  std::vector<std::string> overrides;
  std::string out;
  std::string formation;
};

void say(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

class Demo {
 public:
  Demo(const Arguments& arguments, const CellConfig& cell, const mes::MesGatewayConfig& gateway, std::string strategy)
      : cell_{cell},
        book_{arguments.out, cell},
        observer_{cell.dds.cell},
        client_{cell.dds.mes, gateway.orders.robot_id, gateway.interfaces} {
    run_.formation = arguments.formation;
    run_.strategy = std::move(strategy);
    run_.target_gap = cell.target_gap;
    run_.workspace = cell.workspace;
  }

  int run() {
    std::string why;
    if (!client_.wait_until_accepting(kCellPatience, why)) {
      say("the cell takes no order: " + why);
      return kNoCell;
    }
    if (!wait_for_picture("before.png", "before")) {
      say("no scene with its camera frame was heard within 30 s: is perception up?");
      return kNoCell;
    }
    const mes::Id order = mes::random_id();
    const auto began = steady_clock::now();
    const auto ack = client_.send(client_.command(mes::Verb::kStoreAndStart, order), kAckPatience);
    if (!ack || ack->verdict == mes::Verdict::kRejected) {
      say(ack ? fmt::format("the order was refused: {} {}", mes::to_string(ack->reason), ack->text) : "the order was not answered");
      return kNotSingulated;
    }
    say(fmt::format("order {} accepted; strategy {}, gap {:.1f} mm", mes::to_text(order), run_.strategy, cell_.target_gap * 1e3));
    follow(order);
    run_.wall = steady_clock::now() - began;
    finish();
    return succeeded(run_) ? kSingulated : kNotSingulated;
  }

 private:
  /// Shows decisions and outcomes as they come until the order has ended.
  void follow(const mes::Id& order) {
    auto heard = steady_clock::now();
    bool cancelled = false;
    while (steady_clock::now() - heard < kSilence) {
      if (interrupted && !cancelled) {
        cancelled = true;
        say("interrupted: cancelling the order");
        client_.send(client_.command(mes::Verb::kCancel, order), kAckPatience);
      }
      if (const auto job = client_.next_job(order, kPoll)) {
        heard = steady_clock::now();
        run_.job = job;
      }
      show_changes(Duration::zero());
      if (run_.job && (run_.job->phase == mes::JobPhase::kEnded || run_.job->phase == mes::JobPhase::kAborted)) return;
    }
    say(fmt::format("the cell has said nothing for {:.0f} s", to_seconds(kSilence)));
  }

  void show_changes(Duration wait) {
    while (const auto index = observer_.next_change(wait)) {
      const DecisionRecord record = observer_.decision(*index);
      if (record.outcome) {
        say(outcome_line(record.plan, *record.outcome));
        continue;
      }
      const std::string line = decision_line(*index, record.plan);
      say(line);
      if (const auto camera = observer_.camera()) {
        const auto& stroke = record.plan.stroke;
        book_.write(fmt::format("decision-{:02}.png", *index + 1), record, *camera,
                    fmt::format("decision {}: {} at {:.2f} m/s", *index + 1, to_string(stroke.kind), stroke.speed));
      }
    }
  }

  bool wait_for_picture(const std::string& file, const std::string& headline) {
    const auto give_up = steady_clock::now() + kCellPatience;
    while (steady_clock::now() < give_up && !interrupted) {
      const auto newest = observer_.newest();
      const auto camera = observer_.camera();
      if (newest && camera) return book_.write(file, *newest, *camera, headline);
      observer_.next_change(kPoll);
    }
    return false;
  }

  void finish() {
    show_changes(milliseconds{300});  // the last outcome may come a little after the order's end
    wait_for_picture("after.png", "after");
    for (std::size_t i = 0; i < observer_.decision_count(); ++i) {
      run_.decisions.push_back(observer_.decision(i));
      run_.decisions.back().frame.reset();
    }
    run_.task = observer_.task();
    run_.truth = observer_.truth();
    run_.healths = observer_.healths();
    run_.scene_rate = observer_.scene_rate();
    std::ofstream{book_.folder() / "run.json"} << to_json(run_).dump(2) << '\n';
    say(summary(run_));
    say("  pictures and run.json   " + book_.folder().string());
  }

  const CellConfig& cell_;
  PictureBook book_;
  CellObserver observer_;
  OrderClient client_;
  RunRecord run_;
};

}  // namespace

}  // namespace breakshot::client

int main(int argc, char** argv) {
  using namespace breakshot;
  client::Arguments arguments;
  CLI::App app{"Orders the table of a running cell to be singulated, shows every stroke, and leaves pictures and a record.",
               "breakshot-demo"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->required();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--out", arguments.out, "Folder for before.png, after.png, decision-NN.png and run.json")->required();
  app.add_option("--formation", arguments.formation, "What lies on the table; for the record only");
  CLI11_PARSE(app, argc, argv);
  try {
    const auto document = load_cell_document(arguments.config, arguments.overrides);
    const CellConfig cell = load_cell_config(document);
    const auto gateway = mes::load_mes_gateway_config(document.section("mes_gateway"), cell);
    const std::string strategy = document.section("planner").text("strategy");
    std::signal(SIGINT, client::on_interrupt);
    std::signal(SIGTERM, client::on_interrupt);
    return client::Demo{arguments, cell, gateway, strategy}.run();
  } catch (const std::exception& error) {
    std::cerr << "breakshot-demo: " << error.what() << '\n';
    return client::kNoCell;
  }
}
