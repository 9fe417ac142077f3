// Holds two processes until it is killed; prints their pids on one line when both are READY. argv[1] is the dummy program.
#include "launcher/process_group.hpp"

#include <unistd.h>

#include <cstdio>

int main(int argc, char** argv) {
  using namespace breakshot::launcher;
  if (argc != 2) return 64;
  ProcessSpec plain{.name = "plain", .program = argv[1], .arguments = {"ready", "hang"}};
  ProcessSpec stubborn{.name = "stubborn", .program = argv[1], .arguments = {"ignore-term", "ready", "hang"}};
  ProcessGroup group{{plain, stubborn}};
  if (!group.start()) return 1;
  std::printf("%d %d\n", group.info("plain").pid, group.info("stubborn").pid);
  std::fflush(stdout);
  while (true) ::pause();
}
