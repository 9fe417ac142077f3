#include "sim_bridge/node/sim_bridge_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"sim_bridge", "Simulates the cell's hardware: arm, drives, striker, table, discs and camera."},
                                         argc, argv, breakshot::sim_bridge::run_sim_bridge);
}
