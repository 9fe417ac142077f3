#include "tests/bench/episodes.hpp"

#include "common/random.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>
#include <tuple>

namespace breakshot::bench {

WorldSpread protocol_spread() {
  WorldSpread spread;
  spread.friction_map = 0.10;
  spread.stroke_speed = 0.02;
  spread.aim = 0.5 * std::numbers::pi / 180.0;
  spread.latency = std::chrono::milliseconds{20};
  return spread;
}

EpisodeDraw draw_episode(const support::InProcessSettings& settings, const EpisodeSpec& spec, const WorldSpread& spread) {
  SplitMix64 random{spec.seed * 1'000'003U + static_cast<std::uint64_t>(spec.index)};
  RandomCluster cluster = spread.random;
  cluster.seed = random.next();
  EpisodeDraw draw;
  draw.formation = spec.formation == "random" ? random_cluster(cluster, settings.cell) : load_formation(spec.formation, settings.cell);
  jitter(draw.formation, random, spread.gap_jitter);
  support::EpisodeWorld& world = draw.world;
  world.physics = settings.sim.physics;
  world.physics.friction *= 1.0 + random.uniform(-spread.friction, spread.friction);
  world.physics.friction_spread = spread.friction_map;
  world.physics.friction_seed = random.next() >> 1U;  // what a configuration can say
  world.physics.restitution = std::clamp(world.physics.restitution + random.uniform(-spread.restitution, spread.restitution), 0.0, 1.0);
  const auto period = std::chrono::milliseconds{1};
  const Duration late = settings.camera_latency + from_seconds(random.uniform(-1.0, 1.0) * to_seconds(spread.latency));
  world.camera_latency = std::max<Duration>(late / period * period, Duration::zero());
  world.stroke_speed_spread = spread.stroke_speed;
  world.aim_spread = spread.aim;
  world.seed = random.next() >> 32U;
  if (const int later = spec.index % spread.orders; later > 0) {
    EpisodeSpec first = spec;
    first.index -= later;
    world.physics = draw_episode(settings, first, spread).world.physics;
  }
  return draw;
}

bool succeeded(const TaskStatus& task, int truly_lost, double true_gap, double asked_gap) noexcept {
  return task.phase == TaskPhase::kSingulated && truly_lost == 0 && true_gap >= asked_gap - kGapTolerance;
}

EpisodeRecord run_episode(support::InProcessCell& cell, const EpisodeSpec& spec, const WorldSpread& spread, const OrderLimits& limits,
                          estimate::TableEstimate* learnt) {
  const auto& settings = cell.settings();
  const EpisodeDraw draw = draw_episode(settings, spec, spread);
  TaskRequest request = cell.default_request();
  request.max_hits = limits.hits;
  request.max_pushes = limits.pushes;

  EpisodeRecord record;
  record.spec = spec;
  record.result = cell.run(draw.formation, request, spec.strategy, draw.world, learnt);
  record.success = succeeded(record.result.task, record.result.truly_lost, record.result.true_gap, request.min_gap);
  record.friction = draw.world.physics.friction;
  record.restitution = draw.world.physics.restitution;
  record.min_gap = request.min_gap;
  record.time_s = record.success ? to_seconds(record.result.duration) : kFailureTime;
  return record;
}

namespace {

/// The specs that are to be run one after the other, because one planner goes on learning: indices into `specs`.
std::vector<std::vector<std::size_t>> chains_of(const std::vector<EpisodeSpec>& specs, int orders) {
  std::map<std::tuple<std::string, std::string, std::uint64_t, int>, std::size_t> places;
  std::vector<std::vector<std::size_t>> chains;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const EpisodeSpec& spec = specs[i];
    const auto place = places.try_emplace({spec.formation, spec.strategy, spec.seed, spec.index / orders}, chains.size()).first->second;
    if (place == chains.size()) chains.emplace_back();
    chains[place].push_back(i);
  }
  return chains;
}

}  // namespace

std::vector<EpisodeRecord> run_episodes(const support::InProcessSettings& settings, const std::vector<EpisodeSpec>& specs,
                                        const WorldSpread& spread, const OrderLimits& limits, int jobs,
                                        const std::function<void(std::size_t done, const EpisodeRecord&)>& progress) {
  std::vector<EpisodeRecord> records(specs.size());
  const auto chains = chains_of(specs, spread.orders);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      support::InProcessCell cell{settings};
      for (std::size_t chain = next++; chain < chains.size(); chain = next++) {
        estimate::TableEstimate learnt{settings.estimate, settings.strategy};
        for (const std::size_t i : chains[chain]) {
          records[i] = run_episode(cell, specs[i], spread, limits, &learnt);
          const std::lock_guard lock{mutex};
          progress(++done, records[i]);
        }
      }
    } catch (...) {
      const std::lock_guard lock{mutex};
      failure = std::current_exception();
      next = chains.size();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int job = 0; job < jobs; ++job) threads.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
  return records;
}

}  // namespace breakshot::bench
