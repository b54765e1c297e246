// SPDX-License-Identifier: Apache-2.0
// bench_solver_sweep [CASES] [FIRST] [cpu|cuda]: solvers on geometries and sizes that nobody chose
// (views 2..28, heights 0..60 degrees, widths 24..1280, voxels 8..256, boxes 1e-3..10 m, offsets, noise 0..10
// %, both solvers and precisions). Each must be found better than by no light, or end with a clear error.
// Exits 1 where one is neither.
#include "tests/support/solver_sweep.h"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  using namespace emberlock;
  const int cases = argc > 1 ? std::atoi(argv[1]) : 200;
  const int first = argc > 2 ? std::atoi(argv[2]) : 0;
  const auto device = recon::parse_device(argc > 3 ? argv[3] : "cpu");
  if (!device) {
    std::fprintf(stderr, "%s\n", device.error().message().c_str());
    return 2;
  }
  int found = 0;
  int refused = 0;
  int silent = 0;
  int halved = 0;
  for (int n = first; n < first + cases; ++n) {
    const SweepCase c = sweep_case(n, {});
    const SweepOutcome outcome = solve_case(c, *device);
    const bool good = outcome.good();
    (!good ? silent : outcome.solved ? found : refused) += 1;
    halved += outcome.solved && outcome.solved->halvings > 0 && c.solver == recon::Solver::standard ? 1 : 0;
    std::printf("%s %d: %s: %s\n", good ? "  " : "!!", n, c.words().c_str(), outcome.words().c_str());
    std::fflush(stdout);
  }
  std::printf(
      "\n%d found, %d refused with a reason, %d silently wrong; the default solver's guard was needed %d "
      "times\n",
      found, refused, silent, halved);
  return silent == 0 ? 0 : 1;
}
