#include "planner/node/planner_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"planner", "Decides on strokes and runs tasks to their end."}, argc, argv,
                                         breakshot::planner::run_planner);
}
