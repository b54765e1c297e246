// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/target.h"

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>

namespace emberlock::fuzz {
namespace {

std::map<std::string, Run>& targets() {
  static std::map<std::string, Run> all;
  return all;
}

/// Finds the target of a program's name; ends the process with a list where there is none.
Run target_of(std::string_view program) {
  std::string_view name = program.substr(program.rfind('/') + 1);
  if (name.starts_with("fuzz_")) name.remove_prefix(5);
  const auto found = targets().find(std::string(name));
  if (found != targets().end()) return found->second;
  std::fprintf(stderr, "%.*s: no such target. Start one of these:\n", static_cast<int>(program.size()),
               program.data());
  for (const auto& [known, run] : targets()) std::fprintf(stderr, "fuzz_%s\n", known.c_str());
  std::exit(2);
}

Run chosen = nullptr;

}  // namespace

Target::Target(const char* name, Run run) { targets().emplace(name, run); }

}  // namespace emberlock::fuzz

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** argv) {
  emberlock::fuzz::chosen = emberlock::fuzz::target_of((*argv)[0]);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return emberlock::fuzz::chosen(data, size);
}
