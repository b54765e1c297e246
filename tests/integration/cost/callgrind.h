// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/shell.h"

namespace emberlock {

/// What callgrind counted in a program's function `emberlock::measured`, and what the program printed.
struct Counted {
  double instructions = NAN;
  std::string output;
};

/// `environment`: NAME=value assignments, or nothing.
inline Counted count_instructions(const std::string& program, const std::string& arguments,
                                  const std::string& environment = {}) {
  const Shell run = shell(environment +
                          " valgrind --tool=callgrind --toggle-collect='emberlock::measured*' "
                          "--callgrind-out-file=/dev/null " +
                          program + " " + arguments);
  EXPECT_EQ(run.status, 0) << run.output;
  const std::size_t at = run.output.find("Collected : ");
  if (at == std::string::npos) return {NAN, run.output};
  return {std::strtod(run.output.c_str() + at + sizeof("Collected :"), nullptr), run.output};
}

}  // namespace emberlock
