#include "perception/node/perception_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"perception", "Turns camera images into scenes: discs, gaps and contacts."}, argc, argv,
                                         breakshot::perception::run_perception);
}
