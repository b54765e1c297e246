// SPDX-License-Identifier: Apache-2.0
// calibration [SEEDS] [INSTANTS] [WIDTHxHEIGHT] [FIRST]: rigs of eleven cameras on a ring, a board seen by
// two to four at a time, corners with 0.2 pixels of noise, 5 % of them wrong: how near calibration comes to
// the truth, and whether its stated uncertainties are right. A line a rig, and the worst of all.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/support/pose_errors.h"

int main(int argc, char** argv) {
  using namespace emberlock;
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  test::BoardRigOptions options;
  if (argc > 2) options.instants = std::atoi(argv[2]);
  if (argc > 3 && std::sscanf(argv[3], "%dx%d", &options.image.width, &options.image.height) != 2) {
    std::fprintf(stderr, "%s is no picture size such as 1280x720\n", argv[3]);
    return 2;
  }
  const int first = argc > 4 ? std::atoi(argv[4]) : 1;
  double place = 0;
  double turn = 0;
  double rays = 0;
  double world_place = 0;
  double world_turn = 0;
  double chi2 = 0;
  int freedom = 0;
  int outside = 0;  // of the central 99 % of their chi-square
  int failures = 0;
  double slowest = 0;
  for (int seed = first; seed < first + seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const test::BoardRig rig = test::board_rig(options);
    const auto start = std::chrono::steady_clock::now();
    const auto found = recon::calibrate_rig(rig.sightings, {.world = "0"});
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    slowest = std::max(slowest, seconds);
    if (!found || !found->whole()) {
      ++failures;
      std::printf("%4d  FAILED: %s\n", seed,
                  found ? "a camera is not placed" : found.error().message().c_str());
      continue;
    }
    const test::PoseErrors among = test::errors_among_cameras(*found, rig.cameras);
    const test::PoseErrors world = test::errors_in_world(*found, rig.cameras);
    std::size_t views = 0;
    double noise = 0;
    for (const recon::CalibratedCamera& camera : found->cameras) {
      views += camera.views_used;
      noise += camera.fit.noise / static_cast<double>(found->cameras.size());
    }
    // Wilson and Hilferty (1931): the cube root of chi-square is all but normal.
    const double n = world.freedom;
    const double z = (std::cbrt(world.chi2 / n) - (1 - 2 / (9 * n))) / std::sqrt(2 / (9 * n));
    std::printf(
        "%4d  %4zu views  %zu rejected  noise %.3f px  worst %.3f mm %.4f deg rays %.4f deg in the world's "
        "frame %.3f mm "
        "%.4f deg  chi2 %.1f of %d  %.2f s\n",
        seed, views, found->rejected.size(), noise, among.place * 1e3, among.turn * 180 / M_PI,
        among.rays * 180 / M_PI, world.place * 1e3, world.turn * 180 / M_PI, world.chi2, world.freedom,
        seconds);
    std::fflush(stdout);
    place = std::max(place, among.place);
    turn = std::max(turn, among.turn);
    rays = std::max(rays, among.rays);
    world_place = std::max(world_place, world.place);
    world_turn = std::max(world_turn, world.turn);
    chi2 += world.chi2;
    freedom += world.freedom;
    outside += std::abs(z) > 2.576 ? 1 : 0;
  }
  std::printf("%d rigs of 11 cameras, %d x %d pixels, %d instants: %d failed\n", seeds, options.image.width,
              options.image.height, options.instants, failures);
  std::printf(
      "worst camera of all: %.3f mm, rays %.4f degrees, axes %.4f degrees among the cameras; %.3f mm, %.4f "
      "degrees in the world's "
      "frame\n",
      place * 1e3, rays * 180 / M_PI, turn * 180 / M_PI, world_place * 1e3, world_turn * 180 / M_PI);
  std::printf(
      "chi-square of all poses: %.1f for %d degrees of freedom (ratio %.3f, standard deviation %.3f); %d "
      "rigs "
      "outside the central 99 %%\n",
      chi2, freedom, chi2 / freedom, std::sqrt(2.0 / freedom), outside);
  std::printf("slowest %.2f s\n", slowest);
  return failures;
}
