// `./breakshot bench singulation`: strategies on worlds that differ from what the planner believes in every way of singulation.md's protocol.

#include "tests/bench/singulation.hpp"

int main(int argc, char** argv) {
  breakshot::bench::SingulationArguments defaults;
  defaults.bench = "singulation";
  defaults.strategies = {"paper", "robust"};
  defaults.formations = {"random"};
  defaults.spread = breakshot::bench::protocol_spread();
  return breakshot::bench::run_singulation(
      defaults,
      "Plays strategies in pairs on worlds drawn about the configured one (gaps, mu with a map, e, stroke speed, aim, latency; the planner "
      "is told "
      "none of it) in the in-process cell: ODE world, real controller, perception on rendered images or its error model.",
      argc, argv);
}
