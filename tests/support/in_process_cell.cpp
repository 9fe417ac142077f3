#include "tests/support/in_process_cell.hpp"

#include "common/gap.hpp"
#include "common/random.hpp"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <stdexcept>

namespace breakshot::support {

namespace {

// As in the nodes: the planning side of the controller looks at its channels, and repeats the newest status, this often.
constexpr Duration kExecutorEvery = std::chrono::milliseconds{2};
constexpr Duration kStatusEvery = std::chrono::milliseconds{20};
constexpr Duration kRunnerEvery = std::chrono::milliseconds{50};
// Any task ends by its own time limit; this only catches one that does not.
constexpr Duration kHangs = std::chrono::minutes{15};

constexpr Time kStart = time_from_ns(1'000'000'000);

/// CPU time of the calling thread, s: what a decision costs on a machine that does other things too.
double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool every(Time now, Duration period) { return (now - kStart) % period == Duration::zero(); }

std::size_t pairs_below(const Scene& scene, double min_gap) {
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) pairs += gap_between(scene.discs[i], scene.discs[j]).mean < min_gap ? 1 : 0;
  }
  return pairs;
}

/// The stroke that the arm makes when it is asked for this one. Follows from seed and id, so a request that is sent again stays the same.
StrokeRequest as_made(StrokeRequest stroke, const EpisodeWorld& world) {
  if (stroke.kind == StrokeKind::kPark) return stroke;
  SplitMix64 random{world.seed + 0x9E3779B9U * stroke.id};
  stroke.speed *= 1.0 + random.uniform(-world.stroke_speed_spread, world.stroke_speed_spread);
  stroke.direction_W = Eigen::Rotation2Dd{random.uniform(-world.aim_spread, world.aim_spread)} * stroke.direction_W;
  return stroke;
}

}  // namespace

/// All that begins anew with each episode.
struct InProcessCell::Episode {
  Episode(const InProcessSettings& settings, motion::StrokePlanner& stroke_planner, const sim_bridge::SimSettings& sim,
          const task::TaskSettings& task, const std::string& strategy_name, const EpisodeWorld& truth_of_episode,
          estimate::TableEstimate* learnt)
      : truth{truth_of_episode},
        world{settings.arm, sim},
        loop{settings.loop, *channels},
        executor{stroke_planner, *channels},
        perceiver{settings.perception, settings.camera_model, settings.arm, settings.cell.arm.X_WB},
        noise_model{settings.perception, settings.perception_errors},
        strategy{strategy::make_strategy(strategy_name, settings.strategy)},
        runner{task, strategy_name, 1, settings.strategy},
        prior{settings.estimate, settings.strategy},
        estimate{learnt != nullptr ? *learnt : prior} {}

  struct Exposure {
    sim_bridge::WorldSnapshot snapshot;
    std::uint64_t frame;
    Time due;
  };
  struct Thought {
    std::uint64_t ticket;
    strategy::Decision decision;
    Duration think;
    Time due;
  };

  EpisodeWorld truth;
  sim_bridge::SimWorld world;
  std::unique_ptr<control::LoopChannels> channels = std::make_unique<control::LoopChannels>();
  control::ControlLoop loop;
  control::StrokeExecutor executor;
  perception::JointHistory joints;
  std::vector<Pose> X_WL;
  perception::Perceiver perceiver;
  NoiseModelCamera noise_model;
  std::unique_ptr<strategy::Strategy> strategy;
  task::TaskRunner runner;
  estimate::TableEstimate prior;
  estimate::TableEstimate& estimate;
  std::deque<Exposure> exposures;
  std::optional<Thought> thought;
  bool decided_now = false;  // in this tick
  struct Sending {
    StrokeRequest stroke;
    Time due;
  };
  std::optional<Sending> sending;
  Time next_exposure = kStart;
  ColorFrame color;
  DepthFrame depth;
  EpisodeResult result;
};

InProcessCell::InProcessCell(const InProcessSettings& settings)
    : settings_{settings},
      stroke_planner_{settings.arm, settings.cell.arm.X_WB, settings.motion},
      planners_stroke_planner_{settings.arm, settings.cell.arm.X_WB, settings.motion} {
  if (settings_.sight == Sight::kRendered)
    camera_.emplace(settings_.camera_model, settings_.camera, settings_.arm, settings_.cell.arm.X_WB);
}

InProcessCell::~InProcessCell() = default;

TaskRequest InProcessCell::default_request() const {
  TaskRequest request;
  request.verb = TaskRequest::Verb::kStart;
  request.seq = 1;
  request.order_id[0] = 1;
  request.min_gap = settings_.cell.target_gap;
  request.region = settings_.cell.workspace;
  request.max_hits = 8;
  request.max_pushes = 24;
  request.timeout = std::chrono::seconds{60};
  return request;
}

EpisodeResult InProcessCell::run(const Formation& formation, const TaskRequest& request, const std::string& strategy,
                                 const EpisodeWorld& world, estimate::TableEstimate* learnt) {
  sim_bridge::SimSettings sim = settings_.sim;
  sim.physics = world.physics;
  sim.start = kStart;
  task::TaskSettings task = settings_.task;
  task.seed = world.seed;
  frames_ = world.seed << 20U;  // numbers of frames choose their noise: no two episodes share any

  Episode episode{settings_, stroke_planner_, sim, task, strategy, world, learnt};
  std::vector<SimDisc> discs;
  for (const auto& disc : formation.discs) {
    SimDisc d;
    d.p_WD = disc.p_WD;
    d.radius = disc.radius;
    d.height = settings_.cell.disc_height;
    d.colour = disc.colour;
    const double scale = disc.radius / settings_.disc_mass_radius;
    d.mass = settings_.disc_mass * scale * scale;
    discs.push_back(d);
  }
  episode.world.place(discs);

  // The cell has come up when the order arrives: states flow and the controller holds the arm.
  for (int i = 0; i < 200; ++i) tick(episode);
  const Time began = episode.world.now();
  episode.runner.on_request(request, began);
  carry_out(episode);
  while (episode.runner.running() && episode.world.now() - began < kHangs) tick(episode);
  if (episode.runner.running()) throw std::runtime_error("in-process cell: an order did not end within its time limit");

  EpisodeResult& result = episode.result;
  result.task = episode.runner.status();
  result.duration = episode.world.now() - began;
  result.ahead = episode.runner.ahead_counts();
  for (DecisionPoint& decision : result.decisions) decision.left = episode.world.now() - decision.at;
  const SimTruth truth = episode.world.truth();
  result.truth = truth.discs;
  result.strikes = truth.strikes;
  result.true_gap = smallest_gap_between(truth.discs);
  result.truly_lost = static_cast<int>(std::count_if(truth.discs.begin(), truth.discs.end(),
                                                     [&](const SimDisc& d) { return !d.on_table || !request.region.contains(d.p_WD); }));
  return std::move(result);
}

void InProcessCell::tick(Episode& episode) {
  const JointState state = episode.world.joint_state();
  const Time now = episode.world.now();
  episode.joints.add(state);
  const JointCommand command = episode.loop.tick(&state, now);
  if (command.q.size() != 0) episode.world.command(command);
  if (every(now, kExecutorEvery)) {
    episode.executor.poll(now);
    StrokeStatus status;
    while (episode.executor.next(status)) episode.runner.on_stroke_status(status, now);
  }
  if (every(now, kStatusEvery) && episode.executor.newest()) episode.runner.on_stroke_status(*episode.executor.newest(), now);
  look(episode);
  episode.decided_now = episode.thought && now >= episode.thought->due;
  if (episode.decided_now) {
    auto thought = *std::exchange(episode.thought, std::nullopt);
    episode.runner.on_decision(thought.ticket, std::move(thought.decision), thought.think, now);
  }
  if (every(now, kRunnerEvery)) episode.runner.on_tick(now);
  if (episode.sending && now >= episode.sending->due) episode.executor.submit(std::exchange(episode.sending, std::nullopt)->stroke, now);
  carry_out(episode);
  episode.world.tick();
}

void InProcessCell::look(Episode& episode) {
  const Time now = episode.world.now();
  if (now >= episode.next_exposure) {
    episode.next_exposure += settings_.frame_period;
    Episode::Exposure exposure{{}, ++frames_, now + episode.truth.camera_latency};
    episode.world.snapshot(exposure.snapshot);
    episode.exposures.push_back(std::move(exposure));
  }
  while (!episode.exposures.empty() && now >= episode.exposures.front().due) {
    const auto exposure = std::move(episode.exposures.front());
    episode.exposures.pop_front();
    if (!looked_at(episode, exposure.snapshot)) continue;
    const Scene scene = see(episode, exposure.snapshot, exposure.frame);
    episode.estimate.on_scene(scene);
    if (settings_.learn) episode.runner.on_belief(episode.estimate.belief(scene));
    episode.runner.on_scene(scene, now);
  }
}

Scene InProcessCell::see(Episode& episode, const sim_bridge::WorldSnapshot& snapshot, std::uint64_t frame) {
  if (!camera_) return episode.noise_model.look(snapshot, frame);
  auto& color = episode.color;
  auto& depth = episode.depth;
  color.seq = depth.seq = frame;
  color.exposed = depth.exposed = snapshot.stamp;
  color.width = depth.width = settings_.camera_model.width;
  color.height = depth.height = settings_.camera_model.height;
  const auto pixels = static_cast<std::size_t>(color.width) * static_cast<std::size_t>(color.height);
  color.rgb.resize(3 * pixels);
  depth.depth.resize(pixels);
  camera_->render(snapshot, frame, color.rgb, depth.depth);
  const auto q = episode.joints.at(snapshot.stamp);
  if (!q) return episode.perceiver.process(color, &depth);
  episode.X_WL.resize(static_cast<std::size_t>(q->size()));
  (void)stroke_planner_.kinematics().links_in_world(*q, episode.X_WL);
  return episode.perceiver.process(color, &depth, episode.X_WL);
}

/// Whether anything comes of a frame that arrives now. Rendering is most of what an episode costs, so frames that the planner would throw away
/// are not drawn: it learns from discs that slide, and looks at the table that it waits for once no disc is far too fast to count as at rest.
bool InProcessCell::looked_at(const Episode& episode, const sim_bridge::WorldSnapshot& snapshot) const {
  constexpr double kFastDisc = 0.1;  // m/s; five times what counts as at rest
  double fastest = 0.0;
  for (const SimDisc& disc : snapshot.discs) fastest = std::max(fastest, disc.v_WD_W.norm());
  if (settings_.learn && fastest > 0.0) return true;
  return episode.runner.watches_table() && fastest < kFastDisc;
}

void InProcessCell::think(Episode& episode, const task::RunStrategy& question) {
  const Time now = episode.world.now();
  strategy::DecisionContext context = question.context;
  if (settings_.ask_arm) context.filter = &arm_filter_;
  if (settings_.learn) context.belief = episode.estimate.belief(question.scene);
  const bool revise = !question.earlier.empty();
  if (!revise) episode.result.decisions.push_back({pairs_below(question.scene, question.context.min_gap), now, {}});
  const auto began = std::chrono::steady_clock::now();
  const double cpu_began = thread_cpu_s();
  auto decision =
      revise ? episode.strategy->revise(question.scene, context, question.earlier) : episode.strategy->decide(question.scene, context);
  const double cpu = thread_cpu_s() - cpu_began;
  if (revise) {
    episode.result.revision_cpu_s.push_back(cpu);
  } else {
    episode.result.decision_s.push_back(to_seconds(std::chrono::steady_clock::now() - began));
    episode.result.decision_cpu_s.push_back(cpu);
  }
  Duration charge = settings_.think_charge;
  if (episode.strategy->name() == "robust") charge = revise ? settings_.robust_revise_charge : settings_.robust_think_charge;
  const Duration wait = episode.thought ? settings_.give_up_charge : Duration::zero();
  episode.thought = Episode::Thought{question.ticket, std::move(decision), charge, now + wait + charge};
}

void InProcessCell::carry_out(Episode& episode) {
  const Time now = episode.world.now();
  for (auto& action : episode.runner.take_actions()) {
    if (const auto* send = std::get_if<task::SendStroke>(&action)) {
      const StrokeRequest stroke = as_made(send->stroke, episode.truth);
      const bool charged = stroke.kind == StrokeKind::kPark || episode.decided_now;
      if (charged) {
        episode.executor.submit(stroke, now);
      } else {
        episode.sending = {stroke, now + settings_.stroke_charge};
      }
    } else if (const auto* run = std::get_if<task::RunStrategy>(&action)) {
      think(episode, *run);
    } else if (auto* plan = std::get_if<Plan>(&action)) {
      episode.result.plans.push_back(std::move(*plan));
      episode.result.tables.push_back(episode.world.truth().discs);
    } else if (auto* hit = std::get_if<estimate::ObservedHit>(&action)) {
      episode.estimate.on_hit(*hit);
    } else if (auto* outcome = std::get_if<Outcome>(&action)) {
      episode.result.outcomes.push_back(*outcome);
      episode.result.beliefs.push_back({episode.estimate.friction().belief(), episode.estimate.restitution().belief()});
    }
  }
}

}  // namespace breakshot::support
