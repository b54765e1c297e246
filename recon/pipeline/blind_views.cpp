// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/blind_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "recon/hull/find_box.h"

namespace emberlock::recon {
namespace {

constexpr double kSaturated = 255;

std::array<float, 3> median_of(const RadianceImage& image) {
  std::array<float, 3> medians = {};
  std::vector<float> values(image.rgb.size() / 3);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t p = 0; p < values.size(); ++p) values[p] = image.rgb[3 * p + c];
    std::nth_element(values.begin(), middle, values.end());
    medians[c] = *middle;
  }
  return medians;
}

/// Whether something is brighter or darker than the rest of the picture, by more than its noise.
bool stands_out(const RadianceImage& image, const std::array<float, 3>& medians) {
  RadianceImage difference = image;
  for (std::size_t i = 0; i < difference.rgb.size(); ++i)
    difference.rgb[i] = std::abs(difference.rgb[i] - medians[i % 3]);
  return !noise_mask(difference).box.empty();
}

/// Why a view is blind; nothing where it isn't.
std::optional<std::string> blindness(const View& view, const FlameMask& mask, const Box& box) {
  if (!sees_box(view.camera, box)) return "looks past the box: none of its pixels' rays meets it";
  if (!mask.box.empty()) return std::nullopt;
  const std::array<float, 3> medians = median_of(*view.image);
  if (view.background || stands_out(*view.image, medians)) return std::nullopt;
  const double level = *std::max_element(medians.begin(), medians.end());
  const char* kind = level < 1 ? "black" : level >= kSaturated - 1 ? "white (saturated)" : "of one grey";
  return fmt::format("shows no flame: its picture is {}, {:.3g} of 255 grey levels", kind, level);
}

}  // namespace

Result<PreparedScene> leave_out_blind_views(PreparedScene scene, const ComputeOptions& compute,
                                            std::vector<std::string>& warnings) {
  const Scene& filmed = scene.told();
  const SharedMasks masks = scene.masks(std::nullopt, compute);
  std::vector<std::size_t> blind;
  std::vector<std::string> words;
  std::size_t inputs = 0;
  std::size_t blind_inputs = 0;
  for (std::size_t v = 0; v < filmed.views.size(); ++v) {
    const View& view = filmed.views[v];
    const bool input = view.role == ViewRole::input;
    inputs += input ? 1 : 0;
    if (const auto why = blindness(view, (*masks)[v], filmed.box)) {
      blind.push_back(v);
      blind_inputs += input ? 1 : 0;
      words.push_back(fmt::format("{} {}", view.name, *why));
    }
  }
  if (blind_inputs == inputs || (blind_inputs > 0 && inputs - blind_inputs < 2))
    return Error{
        ErrorKind::not_converged,
        fmt::format("{} of {} input views show nothing of the flame: {}", blind_inputs, inputs,
                    fmt::join(words, "; ")),
        "views",
        "Check exposures, lens caps, poses and the box; give at least two pictures that show the flame"};
  for (const std::string& why : words)
    warnings.push_back(why + ". The result does without this view; check its picture and its pose");
  return blind.empty() ? std::move(scene) : scene.without(blind);
}

}  // namespace emberlock::recon
