#include "controller/node/controller_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"controller", "Plans and runs strokes: the 1 kHz control loop of the arm."}, argc, argv,
                                         breakshot::control::run_controller);
}
