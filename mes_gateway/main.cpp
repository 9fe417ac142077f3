#include "mes_gateway/mes_gateway_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"mes_gateway", "Takes orders from the factory (MES) and tells it how they stand."}, argc, argv,
                                         breakshot::mes::run_gateway);
}
