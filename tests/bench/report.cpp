#include "tests/bench/report.hpp"

#include <fmt/core.h>
#include <sys/utsname.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace breakshot::bench {

nlohmann::json machine() {
  utsname name{};
  uname(&name);
  std::string model = "unknown";
  std::ifstream cpuinfo{"/proc/cpuinfo"};
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.rfind("model name", 0) == 0) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  double load = 0.0;
  getloadavg(&load, 1);
  return {{"cpu", model}, {"cores", std::thread::hardware_concurrency()}, {"kernel", name.release}, {"load", load}};
}

nlohmann::json report(const std::string& bench, const nlohmann::json& args, const nlohmann::json& metrics, const nlohmann::json& goals) {
  return {{"bench", bench}, {"machine", machine()}, {"args", args}, {"metrics", metrics}, {"goals", goals}};
}

void write_file(const std::string& file, const std::string& text) {
  std::ofstream out{file};
  out << text;
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file);
  fmt::print("wrote {}\n", file);
}

}  // namespace breakshot::bench
