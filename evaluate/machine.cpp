// SPDX-License-Identifier: Apache-2.0
#include "evaluate/machine.h"

#include <fstream>
#include <thread>

#include <fmt/format.h>

namespace emberlock::evaluate {

std::string machine(int threads, const std::string& device) {
  std::ifstream in("/proc/cpuinfo");
  std::string model = "this machine";
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
      model = line.substr(line.find(": ") + 2);
      break;
    }
  }
  const int used = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  return fmt::format("{}, {} threads, device {}", model, used, device);
}

}  // namespace emberlock::evaluate
