// `./breakshot bench ik`: inverse kinematics beside KDL's solvers, on the same reachable poses, in turns, for any arm that a URDF describes.

#include "common/urdf/arm_description.hpp"
#include "controller/kinematics/general_ik.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"
#include "tests/support/random_pose.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include <ctime>
#include <filesystem>
#include <iostream>
#include <optional>
#include <random>

namespace breakshot::bench {
namespace {

using kinematics::ArmKinematics;
using support::difference;
using support::random_joints;

/// What counts as solved, for every solver: m and rad. TRAC-IK's published table has the same.
constexpr double kTolerance = 1e-5;
/// KDL's iterations: NR_JL as in its own examples; LMA its default.
constexpr unsigned kNewtonIterations = 100;
constexpr int kLmaIterations = 500;
/// The solvers take turns by so many poses: often enough that what else the machine does hits all alike, and each still runs warm.
constexpr std::size_t kBlock = 100;

struct Arguments {
  std::vector<std::string> urdfs;
  std::string base = "base_link";
  std::string tip = "tip";
  int n = 10'000;
  std::uint32_t seed = 1;
  std::string json_file;
};

/// CPU time of this thread, s: what else the machine does counts less.
double cpu_time() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// One solver's tally.
struct Tally {
  std::size_t solved = 0, within = 0, poses = 0;
  std::vector<double> us;

  /// Runs a solver on one pose. It returns joints, which are checked here and not believed.
  template <typename Solver>
  void run(const ArmKinematics& arm, const Pose& X_WT, Solver&& solver) {
    const double start = cpu_time();
    const std::optional<JointVector> q = solver(X_WT);
    us.push_back(1e6 * (cpu_time() - start));
    ++poses;
    if (!q) return;
    const auto error = difference(arm.tip_in_world(*q), X_WT);
    if (!(error.position <= kTolerance && error.rotation <= kTolerance)) return;
    ++solved;
    if (arm.within_limits(*q)) ++within;
  }

  double solved_pct() const noexcept { return 100.0 * static_cast<double>(solved) / static_cast<double>(poses); }
  double within_pct() const noexcept { return 100.0 * static_cast<double>(within) / static_cast<double>(poses); }
};

KDL::Frame to_kdl(const Pose& X) {
  const Matrix3 R = X.linear();
  return {KDL::Rotation{R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)},
          KDL::Vector{X.translation().x(), X.translation().y(), X.translation().z()}};
}

KDL::JntArray to_kdl(const JointVector& q) {
  KDL::JntArray array{static_cast<unsigned>(q.size())};
  array.data = q;
  return array;
}

/// Mean CPU time of a call, us.
template <typename Call>
double mean_time(const std::vector<JointVector>& joints, Call&& call) {
  constexpr int kRounds = 20;
  const double start = cpu_time();
  for (int round = 0; round < kRounds; ++round) {
    for (const JointVector& q : joints) call(q);
  }
  return 1e6 * (cpu_time() - start) / (kRounds * static_cast<double>(joints.size()));
}

struct ArmResult {
  Tally general, closed_form, nr_jl, lma;
  bool has_closed_form = false;
  double fk_jacobian_us = 0.0, kdl_fk_jacobian_us = 0.0;
};

ArmResult measure(const ArmKinematics& arm, int n, std::uint32_t seed) {
  ArmResult result;
  const kinematics::GeneralIk general{arm};
  const kinematics::InverseKinematics inverse{arm};
  result.has_closed_form = inverse.has_closed_form();
  KDL::ChainFkSolverPos_recursive fk{arm.chain()};
  KDL::ChainIkSolverVel_pinv ik_velocity{arm.chain()};
  KDL::ChainIkSolverPos_NR_JL nr_jl{arm.chain(), to_kdl(arm.lower()), to_kdl(arm.upper()), fk, ik_velocity, kNewtonIterations, kTolerance};
  Eigen::Matrix<double, 6, 1> weights = Eigen::Matrix<double, 6, 1>::Ones();  // its default lets rotations be off by a milliradian
  KDL::ChainIkSolverPos_LMA lma{arm.chain(), weights, kTolerance, kLmaIterations};

  const JointVector middle = 0.5 * (arm.lower() + arm.upper());  // every solver begins here
  const KDL::JntArray kdl_middle = to_kdl(middle);
  KDL::JntArray kdl_q{static_cast<unsigned>(arm.joints())};
  const auto solve_general = [&](const Pose& X_WT) -> std::optional<JointVector> {
    const auto found = general.solve(X_WT, middle);
    if (!found.solved) return std::nullopt;
    return found.q;
  };
  const auto solve_closed_form = [&](const Pose& X_WT) -> std::optional<JointVector> {
    const auto found = inverse.solve(X_WT, middle);
    if (found.empty()) return std::nullopt;
    return found.q[0];
  };
  const auto solve_nr_jl = [&](const Pose& X_WT) -> std::optional<JointVector> {
    if (nr_jl.CartToJnt(kdl_middle, to_kdl(X_WT), kdl_q) < 0) return std::nullopt;
    return JointVector{kdl_q.data};
  };
  const auto solve_lma = [&](const Pose& X_WT) -> std::optional<JointVector> {
    if (lma.CartToJnt(kdl_middle, to_kdl(X_WT), kdl_q) < 0) return std::nullopt;
    // It knows no limits; the turns that bring its answer inside are granted to it.
    const JointVector q{kdl_q.data};
    return kinematics::nearest_turns(arm, q, middle).value_or(q);
  };

  std::mt19937 random{seed};
  std::vector<JointVector> joints;
  std::vector<Pose> block;
  const auto run_block = [&](Tally& tally, auto&& solve) {
    for (const Pose& X_WT : block) tally.run(arm, X_WT, solve);
  };
  for (int i = 0; i < n; ++i) {
    block.push_back(arm.tip_in_world(joints.emplace_back(random_joints(arm, random))));
    if (block.size() < kBlock && i + 1 < n) continue;
    run_block(result.general, solve_general);
    if (result.has_closed_form) run_block(result.closed_form, solve_closed_form);
    run_block(result.nr_jl, solve_nr_jl);
    run_block(result.lma, solve_lma);
    block.clear();
  }

  double sum = 0.0;  // keeps the calls from being optimised away
  kinematics::Jacobian J_W;
  result.fk_jacobian_us = mean_time(joints, [&](const JointVector& q) { sum += arm.tip_in_world(q, J_W).translation().x() + J_W(0, 0); });
  KDL::ChainJntToJacSolver jacobian{arm.chain()};
  KDL::Jacobian J_kdl{static_cast<unsigned>(arm.joints())};
  KDL::Frame X;
  result.kdl_fk_jacobian_us = mean_time(joints, [&](const JointVector& q) {
    kdl_q.data = q;
    fk.JntToCart(kdl_q, X);
    jacobian.JntToJac(kdl_q, J_kdl);
    sum += X.p.x() + J_kdl(0, 0);
  });
  if (!(sum < 1e300)) throw std::runtime_error("forward kinematics is not finite");
  return result;
}

void print_row(const std::string& arm, const char* solver, const Tally& tally) {
  fmt::print("{:<14}{:<14}{:>10.2f}{:>15.2f}{:>11.1f}{:>11.1f}\n", arm, solver, tally.solved_pct(), tally.within_pct(), mean(tally.us),
             quantile(tally.us, 0.99));
}

void add(nlohmann::json& metrics, nlohmann::json& goals, const std::string& arm, const ArmResult& result) {
  const auto goal = [&](const std::string& name, double value, double bound, bool at_least) {
    goals[arm + "." + name] = {{"value", value}, {"goal", bound}, {"met", at_least ? value >= bound : value <= bound}};
  };
  const auto put = [&](const std::string& prefix, const Tally& tally) {
    metrics[arm + "." + prefix + "solved_pct"] = tally.solved_pct();
    metrics[arm + "." + prefix + "in_limits_pct"] = tally.within_pct();
    metrics[arm + "." + prefix + "mean_us"] = mean(tally.us);
    metrics[arm + "." + prefix + "p99_us"] = quantile(tally.us, 0.99);
  };
  put("", result.general);
  put("kdl_nr_jl_", result.nr_jl);
  put("kdl_lma_", result.lma);
  goal("in_limits_pct", result.general.within_pct(), 99.9, true);
  goal("p99_us", quantile(result.general.us, 0.99), 1000.0, false);
  if (result.has_closed_form) {
    put("closed_form_", result.closed_form);
    goal("closed_form_in_limits_pct", result.closed_form.within_pct(), 100.0, true);
    goal("closed_form_mean_us", mean(result.closed_form.us), 10.0, false);
  }
  metrics[arm + ".fk_jacobian_us"] = result.fk_jacobian_us;
  metrics[arm + ".kdl_fk_jacobian_us"] = result.kdl_fk_jacobian_us;
  goal("fk_jacobian_us", result.fk_jacobian_us, 2.0, false);
}

int run(const Arguments& arguments) {
  struct Chain {
    std::string urdf, base, tip;
  };
  std::vector<Chain> chains;
  for (const std::string& urdf : arguments.urdfs) chains.push_back({urdf, arguments.base, arguments.tip});
  if (chains.empty()) {
    const std::string root = BREAKSHOT_SOURCE_DIR;
    chains.push_back({root + "/config/arms/ur5e_striker.urdf", "base_link", "striker_tip"});
    for (const char* name : {"panda", "xarm7", "irb2400"}) {
      chains.push_back({root + "/tests/support/arms/" + name + ".urdf", "base_link", "tip"});
    }
  }

  nlohmann::json metrics;
  nlohmann::json goals;
  fmt::print("{:<14}{:<14}{:>10}{:>15}{:>11}{:>11}\n", "arm", "solver", "solved %", "and in limits %", "mean us", "p99 us");
  for (const Chain& chain : chains) {
    const ArmKinematics arm{load_arm(chain.urdf, chain.base, chain.tip), Pose::Identity()};
    const ArmResult result = measure(arm, arguments.n, arguments.seed);
    const std::string name = std::filesystem::path{chain.urdf}.stem();
    print_row(name, "general", result.general);
    if (result.has_closed_form) print_row("", "closed form", result.closed_form);
    print_row("", "KDL NR_JL", result.nr_jl);
    print_row("", "KDL LMA", result.lma);
    fmt::print("{:<14}forward kinematics and Jacobian: {:.2f} us, KDL {:.2f} us\n", "", result.fk_jacobian_us, result.kdl_fk_jacobian_us);
    add(metrics, goals, name, result);
  }
  int missed = 0;
  for (const auto& [name, goal] : goals.items()) {
    if (goal["met"].get<bool>()) continue;
    ++missed;
    fmt::print("missed: {} is {:.4g}, goal {:.4g}\n", name, goal["value"].get<double>(), goal["goal"].get<double>());
  }
  if (missed == 0) fmt::print("all {} goals met\n", goals.size());
  fmt::print(
      "({} poses per arm, each made from joints drawn evenly from their ranges; solved: within {} m and rad by forward kinematics; CPU "
      "time of the thread)\n",
      arguments.n, kTolerance);
  const nlohmann::json args{{"n", arguments.n}, {"seed", arguments.seed}, {"urdf", arguments.urdfs}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report("ik", args, metrics, goals).dump(2) + "\n");
  return 0;
}

}  // namespace
}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{
      "Inverse kinematics on reachable random poses, beside KDL's NR_JL and LMA. Without --urdf: the cell's UR5e, a Panda, an xArm7, an "
      "IRB2400.",
      "bench ik"};
  app.add_option("--urdf", arguments.urdfs, "An arm's description (repeatable)")->allow_extra_args(false)->check(CLI::ExistingFile);
  app.add_option("--base", arguments.base, "Its base link")->capture_default_str();
  app.add_option("--tip", arguments.tip, "Its tip link")->capture_default_str();
  app.add_option("--n", arguments.n, "Poses per arm")->check(CLI::Range(10, 1'000'000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same poses")->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench ik: " << error.what() << '\n';
    return 1;
  }
}
