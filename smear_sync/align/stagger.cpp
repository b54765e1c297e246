// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/stagger.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace emberlock::smear {
namespace {

constexpr double kGoldenRatio = 1.6180339887498949;

double fraction_of_turn(std::size_t camera) {
  const double turns = kGoldenRatio * static_cast<double>(camera);
  return turns - std::floor(turns);
}

}  // namespace

std::vector<Seconds> staggered_offsets(std::size_t cameras, Seconds period) {
  std::vector<std::size_t> in_time(cameras);
  std::iota(in_time.begin(), in_time.end(), std::size_t{0});
  std::sort(in_time.begin(), in_time.end(),
            [](std::size_t a, std::size_t b) { return fraction_of_turn(a) < fraction_of_turn(b); });
  std::vector<Seconds> offsets(cameras);
  for (std::size_t rank = 0; rank < cameras; ++rank)
    offsets[in_time[rank]] = period * (static_cast<double>(rank) / static_cast<double>(cameras));
  return offsets;
}

Status check_stagger(std::size_t cameras, Seconds period, Seconds tolerance) {
  if (cameras < 2)
    return Error{ErrorKind::bad_input, "one camera has nothing to be staggered against", "stagger",
                 "Connect at least two cameras, or align to one common instant"};
  const Seconds apart = period / static_cast<double>(cameras);
  if (tolerance < apart / 2) return {};
  return Error{
      ErrorKind::bad_input,
      fmt::format("{} staggered cameras are {:.3f} ms apart, and a tolerance of {:.3f} ms mixes them up",
                  cameras, in_milliseconds(apart), in_milliseconds(tolerance)),
      "stagger",
      fmt::format("Ask for a tolerance of less than {:.3f} ms, or align to one common instant",
                  in_milliseconds(apart / 2))};
}

bool staggered(const std::vector<AlignCamera>& cameras) {
  return std::any_of(cameras.begin(), cameras.end(),
                     [](const AlignCamera& camera) { return camera.offset != Seconds(0); });
}

}  // namespace emberlock::smear
