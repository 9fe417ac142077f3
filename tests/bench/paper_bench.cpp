// `./breakshot bench paper`: the paper's strategy beside its two baselines, on the nine formations and on random clusters, in the in-process cell.

#include "tests/bench/singulation.hpp"

int main(int argc, char** argv) {
  breakshot::bench::SingulationArguments defaults;
  defaults.bench = "paper";
  defaults.strategies = {"paper", "random_hybrid", "random_push"};
  return breakshot::bench::run_singulation(
      defaults,
      "Runs the paper's strategy and its baselines over formations in the in-process cell (ODE world, rendered camera, real controller).",
      argc, argv);
}
