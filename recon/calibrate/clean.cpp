// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/clean.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

constexpr std::size_t kFewestInView = 6;
constexpr double kLeastNoise = 1e-6;  // pixels: exact corners are weighed finitely
constexpr double kMadToSigma = 1.4826;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Robust standard deviation of a corner's coordinate about the solution, from all views that are not
/// rejected.
double robust_noise(const Bundle& bundle, const std::vector<bool>& rejected, std::size_t camera) {
  std::vector<double> sizes;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    const BundleView& view = bundle.views[v];
    if (view.camera != camera || rejected[v]) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Eigen::Vector2d r = residual(bundle, view, i);
      sizes.push_back(std::abs(r.x()));
      sizes.push_back(std::abs(r.y()));
    }
  }
  return std::max(kLeastNoise, kMadToSigma * median(std::move(sizes)));
}

/// Corners by their distance alone; true if one changed. Views left out stay so.
bool mark_outliers(Bundle& bundle, const std::vector<bool>& rejected, const std::vector<double>& noise,
                   double limit) {
  bool changed = false;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    if (rejected[v]) continue;
    BundleView& view = bundle.views[v];
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const bool wrong = !(residual(bundle, view, i).norm() <= limit * noise[view.camera]);
      const CornerUse use = wrong ? CornerUse::outlier : CornerUse::used;
      changed = changed || use != view.use[i];
      view.use[i] = use;
    }
  }
  return changed;
}

/// RMS of a view's corners, the wrong ones left out.
double view_rms(const Bundle& bundle, const BundleView& view) {
  double sum = 0;
  for (std::size_t i = 0; i < view.corners.size(); ++i)
    if (view.use[i] == CornerUse::used) sum += residual(bundle, view, i).squaredNorm();
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, view.used())));
}

struct Suspect {
  std::size_t view = 0;
  double badness = 0;  ///< which of an instant's is worst
  std::string why;
};

std::optional<Suspect> suspect(const Bundle& bundle, std::size_t v, const std::vector<double>& others,
                               const CleanOptions& options) {
  const BundleView& view = bundle.views[v];
  const std::size_t used = view.used();
  const std::size_t wrong = view.corners.size() - used;
  const double share = static_cast<double>(wrong) / static_cast<double>(view.corners.size());
  if (share > options.wrong_share || used < std::min(kFewestInView, view.corners.size())) {
    return Suspect{
        v, 1e3 + share,
        fmt::format("{} of its {} corners don't fit the others: the board was found wrongly, or it or "
                    "the camera moved",
                    wrong, view.corners.size())};
  }
  if (others.size() < 3) return std::nullopt;  // nothing to compare with
  const double middle = median(others);
  std::vector<double> deviations;
  deviations.reserve(others.size());
  for (const double rms : others) deviations.push_back(std::abs(rms - middle));
  const double spread = kMadToSigma * median(std::move(deviations));
  const double own = view_rms(bundle, view);
  if (own <= options.view_limit * middle || own <= middle + options.view_spread * spread) return std::nullopt;
  return Suspect{
      v, own / middle,
      fmt::format("{:.2f} pixels RMS, where this camera's views show {:.2f}: blurred, or the board was "
                  "bent or moved",
                  own, middle)};
}

/// The worst view of each instant that is wrong.
std::vector<Suspect> worst_views(const Bundle& bundle, const std::vector<bool>& rejected,
                                 const CleanOptions& options) {
  std::vector<std::vector<double>> by_camera(bundle.cameras.size());
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    if (!rejected[v]) by_camera[bundle.views[v].camera].push_back(view_rms(bundle, bundle.views[v]));
  std::map<std::size_t, Suspect> worst;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    if (rejected[v]) continue;
    const auto found = suspect(bundle, v, by_camera[bundle.views[v].camera], options);
    if (!found) continue;
    const auto [it, first] = worst.try_emplace(bundle.views[v].board, *found);
    if (!first && it->second.badness < found->badness) it->second = *found;
  }
  std::vector<Suspect> result;
  result.reserve(worst.size());
  for (auto& [board, view] : worst) result.push_back(std::move(view));
  return result;
}

/// Standard deviation of each camera's corners: squares of the used ones over what they leave free. A pose of
/// the board is shared by the instant's views, a lens and a pose are their camera's own.
std::vector<double> noise_of(const Bundle& bundle) {
  std::vector<double> squares(bundle.cameras.size());
  std::vector<double> freedom(bundle.cameras.size());
  std::vector<double> of_board(bundle.boards.size());
  for (const BundleView& view : bundle.views) of_board[view.board] += static_cast<double>(view.used());
  for (const BundleView& view : bundle.views) {
    const auto used = static_cast<double>(view.used());
    if (used == 0) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      if (view.use[i] == CornerUse::used) squares[view.camera] += residual(bundle, view, i).squaredNorm();
    const bool board_free = bundle.boards[view.board].held != Held::pose;
    freedom[view.camera] += 2 * used - (board_free ? kPoseUnknowns * used / of_board[view.board] : 0);
  }
  std::vector<double> noise;
  for (std::size_t c = 0; c < bundle.cameras.size(); ++c) {
    const Held held = bundle.cameras[c].held;
    if (held == Held::none || held == Held::pose) freedom[c] -= kLensUnknowns;
    if (held == Held::none || held == Held::lens) freedom[c] -= kPoseUnknowns;
    noise.push_back(freedom[c] > 0 ? std::max(kLeastNoise, std::sqrt(squares[c] / freedom[c]))
                                   : bundle.cameras[c].noise);
  }
  return noise;
}

}  // namespace

Result<std::vector<RejectedView>> clean(Bundle& bundle, const CleanOptions& options) {
  std::vector<RejectedView> result;
  std::vector<bool> rejected(bundle.views.size());
  bool settled = false;
  for (int round = 0; round < options.rounds && !settled; ++round) {
    const bool last_loss = round >= 2;
    EMBERLOCK_RETURN_IF_ERROR(adjust(bundle, last_loss ? BundleLoss::squares : BundleLoss::cauchy));
    std::vector<double> noise;
    for (std::size_t c = 0; c < bundle.cameras.size(); ++c) {
      noise.push_back(robust_noise(bundle, rejected, c));
      bundle.cameras[c].noise = noise.back();
    }
    bool changed = mark_outliers(bundle, rejected, noise, options.corner_limit);
    // Views only once the corners' own errors are out of the solution.
    if (round >= 1) {
      for (Suspect& view : worst_views(bundle, rejected, options)) {
        rejected[view.view] = true;
        std::fill(bundle.views[view.view].use.begin(), bundle.views[view.view].use.end(), CornerUse::outlier);
        result.push_back({view.view, std::move(view.why)});
        changed = true;
      }
    }
    settled = last_loss && !changed;
  }
  const std::vector<double> noise = noise_of(bundle);
  for (std::size_t c = 0; c < noise.size(); ++c) bundle.cameras[c].noise = noise[c];
  EMBERLOCK_RETURN_IF_ERROR(adjust(bundle, BundleLoss::squares));
  return result;
}

}  // namespace emberlock::recon
