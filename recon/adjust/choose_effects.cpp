// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/choose_effects.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/adjust/choose_light.h"
#include "recon/adjust/find_extinction.h"
#include "recon/adjust/find_motion.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/predict_effects.h"
#include "recon/effects/motion.h"
#include "recon/views/picture_clues.h"

namespace emberlock::recon {
namespace {

std::string explain(const EstimatedExtinction& estimate) {
  const double even = estimate.extinction.value.value();
  const double soot = estimate.extinction.soot.value();
  if (estimate.error <= 0) return "no time is left to estimate it by cross-validation";
  const std::string what = even + soot <= 0 ? "none"
                           : soot <= 0      ? fmt::format("an even {:.3g} / m", even)
                           : even <= 0      ? fmt::format("{:.3g} / m like soot", soot)
                                       : fmt::format("{:.3g} / m even and {:.3g} / m like soot", even, soot);
  return fmt::format(
      "{} shows pixels and views that are left out of a coarse fit best, to {:.3g} grey levels and {:.3g} "
      "without",
      what, estimate.error, estimate.error_of_none);
}

/// Estimates the extinction on a grid of its own and makes the report's line of it.
class ExtinctionChoice {
 public:
  ExtinctionChoice(const EffectRequest& request, const Extinction& known)
      : request_(request), known_(known) {}

  void estimate(const SolverSetup& probing, const Elapsed& elapsed) {
    const bool by_hand = request_.fixed.has_value();
    found_ = {known_};
    if (!by_hand || is_open()) found_ = find_extinction(probing, by_hand, elapsed);
  }
  [[nodiscard]] const Extinction& found() const { return found_.extinction; }
  /// Whether it is to be confirmed on a finer grid: an extinction may also explain what a coarse one blurs.
  [[nodiscard]] bool is_promising() const {
    return !request_.fixed && found_.extinction.model != Extinction::Model::none && gains_enough(found_);
  }
  void look_closer(const SolverSetup& closer) { closer_ = score_closer(closer, found_.extinction); }
  /// `change`: of the pictures by what was found, grey levels.
  Extinction decide(double change) {
    report_.predicted_change = change;
    const bool absorbs = found_.extinction.model != Extinction::Model::none;
    report_.on = absorbs;
    report_.reason = "set by hand";
    if (request_.fixed && is_open()) report_.reason += ": " + explain(found_);
    if (request_.fixed) return found_.extinction;
    report_.reason = explain(found_);
    if (!absorbs) return {};
    const bool is_validated = gains_enough(found_) && gains_enough(closer_);
    report_.on = is_validated && change >= request_.tolerance;
    if (!gains_enough(found_))
      report_.reason += ", which is too little to believe it";
    else if (!is_validated)
      report_.reason += fmt::format(
          ", but on a grid twice as fine to {:.3g} and {:.3g}, so it only explains what the coarse grid "
          "blurs",
          closer_.error, closer_.error_of_none);
    else if (!report_.on)
      report_.reason +=
          fmt::format(", but changes the pictures by less than {:.2g} grey levels", request_.tolerance);
    if (!report_.on) found_.alternatives = {found_.extinction};
    return report_.on ? found_.extinction : Extinction{};
  }
  [[nodiscard]] EffectReport report(Seconds took) const {
    EffectReport report = report_;
    report.seconds = took;
    return report;
  }
  /// After decide(): extinctions that explain the pictures nearly as well as its result.
  [[nodiscard]] const std::vector<Extinction>& alternatives() const { return found_.alternatives; }

 private:
  /// A field whose scale the user leaves open; under a light the density is estimated with the light.
  [[nodiscard]] bool is_open() const {
    return known_.model == Extinction::Model::field && known_.value.value() + known_.soot.value() <= 0 &&
           request_.fixed->light.source == Light::Source::none;
  }

  /// The simpler model stands unless it is clearly worse. Simulated candles that hardly absorb gain 0.02 to
  /// 0.07 on the first grid and half of it on the finer one; what absorbs gains more there.
  static bool gains_enough(const EstimatedExtinction& estimate) {
    constexpr double kLeastGain = 0.05;
    return estimate.error < (1 - kLeastGain) * estimate.error_of_none;
  }

  const EffectRequest& request_;
  Extinction known_;
  EstimatedExtinction found_;
  EstimatedExtinction closer_;  ///< the same extinction on a finer grid
  EffectReport report_{"extinction", false, 0, {}, {}};
};

/// Decides on the motion, in two halves: where it rises before anything else is known, and the rest once the
/// extinction is.
class MotionChoice {
 public:
  MotionChoice(const PreparedScene& scene, const Grid& grid, const EffectRequest& request,
               const SolveOptions& options, Pool& pool, const Elapsed& elapsed)
      : scene_(scene), grid_(grid), request_(request), options_(options), pool_(pool), elapsed_(elapsed) {}

  /// None, or about how the flame rises.
  Motion rough() {
    if (request_.fixed) return request_.fixed->motion;
    const Seconds start = now();
    found_ = find_rise({scene_.scene(), grid_, scene_.effects(), options_, pool_}, request_.tolerance);
    seconds_ = now() - start;
    on_ = found_.gain >= request_.tolerance;
    return on_ ? found_.motion : Motion{};
  }
  /// The same to the last digit. `known` brings the extinction, and the rough motion.
  Motion fine(Effects known) {
    const Motion rough = known.motion;
    known.motion = {};
    const Seconds start = now();
    const PreparedScene still = scene_.under(known);
    const MotionSearch search{still.scene(), grid_, known, options_, pool_};
    if (request_.fixed) {
      on_ = moves(scene_.told(), rough);
      if (on_) found_ = measure_motion(search, rough);
      found_.motion = rough;
    } else if (on_) {
      found_ = refine_motion(search, rough);
    }
    seconds_ += now() - start;
    return on_ ? found_.motion : rough;
  }
  [[nodiscard]] EffectReport report() const { return {"motion", on_, found_.change, seconds_, reason(), {}}; }

 private:
  [[nodiscard]] Seconds now() const { return elapsed_ ? elapsed_() : Seconds(0); }
  [[nodiscard]] std::string reason() const {
    if (!any_late(scene_.told())) return "no view is known to be late";
    if (request_.fixed && !on_) return "left out by hand";
    const auto& v = found_.motion.velocity;
    const std::string what = fmt::format(
        "{:.2f} / {:.2f} / {:.2f} m/s between the views' instants changes the pictures by {:.2g} "
        "grey levels",
        v[0], v[1], v[2], found_.change);
    if (request_.fixed) return "set by hand: " + what;
    if (found_.motion.carry == Motion::Carry::none)
      return fmt::format(
          "no flame is fast enough to change the pictures by {:.2g} grey levels between the "
          "views' instants",
          request_.tolerance);
    const std::string gain = fmt::format(", and the held-out error by about {:.2g}", found_.gain);
    if (!on_) return what + gain + fmt::format(", less than {:.2g}", request_.tolerance);
    const std::vector<View>& told = scene_.told().views;
    const bool averaged = std::all_of(told.begin(), told.end(), [](const View& view) {
      return view.average || view.lateness == Seconds(0);
    });
    return what + gain +
           (averaged ? "" : " (what stays where it is isn't known: pictures of other instants would tell)");
  }

  const PreparedScene& scene_;
  const Grid& grid_;
  const EffectRequest& request_;
  const SolveOptions& options_;
  Pool& pool_;
  const Elapsed& elapsed_;
  FoundMotion found_;
  Seconds seconds_{0};
  bool on_ = false;
};

/// What is set by hand is in range, and pictures that a calibration made linear are not bent once more.
Status check_asked(const Scene& scene, const EffectRequest& request) {
  if (request.fixed) EMBERLOCK_RETURN_IF_ERROR(check(*request.fixed));
  const Effects& asked = request.fixed ? *request.fixed : request.assumed;
  if (!scene.linearised || asked.sensor.gamma == 1) return {};
  return Error{
      ErrorKind::bad_input,
      fmt::format("gamma {:.3g}, but the cameras' calibrated responses made the pictures linear already",
                  asked.sensor.gamma),
      "--effects", "Leave gamma out, or reconstruct with a rig that has no colour"};
}

/// The sensor, with the level at which it clips where enough of the flame is clipped.
Sensor clipping_sensor(const PreparedScene& told, Sensor sensor, double tolerance,
                       const ComputeOptions& compute) {
  const Scene& filmed = told.scene();
  const std::vector<PixelBox> boxes = flame_boxes(filmed, *told.masks(std::nullopt, compute));
  const double white = clip_level(filmed, boxes, sensor.white);
  if (white > 0 && clipped_pixels(filmed, boxes, white).excess >= tolerance) {
    sensor.clipping = Sensor::Clipping::at_white;
    sensor.white = white;
  }
  return sensor;
}

/// In linear grey levels: what the pictures of the background show, else the level along the borders.
Background known_background(const PreparedScene& prepared, double tolerance, const ComputeOptions& compute) {
  const Scene& linear = prepared.scene();
  const bool pictured = std::any_of(linear.views.begin(), linear.views.end(), [](const View& view) {
    return view.role == ViewRole::input && view.background;
  });
  if (pictured) return {Background::Kind::image, {}};
  const std::optional<BorderLevel> border = border_level(linear, *prepared.masks(std::nullopt, compute));
  if (!border || *std::max_element(border->level.begin(), border->level.end()) < tolerance) return {};
  return {Background::Kind::constant, border->level};
}

}  // namespace

PreparedScene under_known_effects(const PreparedScene& filmed, const EffectRequest& request,
                                  const ComputeOptions& compute) {
  if (request.fixed) {
    Effects told = *request.fixed;
    told.light = {};  // is found later
    return filmed.under(told);
  }
  Effects known;
  known.sensor = request.assumed.sensor;
  if (known.sensor.gamma != 1) known.sensor.response = Sensor::Response::gamma;
  known.sensor = clipping_sensor(filmed.under({}), known.sensor, request.tolerance, compute);
  const PreparedScene linear = filmed.under(known);
  known.background = known_background(linear, request.tolerance, compute);
  return linear.under(known);
}

Result<EffectChoice> choose_effects(const PreparedScene& scene, const Grid& grid,
                                    const EffectRequest& request, const SolveOptions& options,
                                    const Elapsed& elapsed) try {
  EMBERLOCK_RETURN_IF_ERROR(check_asked(scene.told(), request));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.compute.device));
  Effects known = scene.effects();
  known.light = {};  // what else there is is found out as though the medium glowed
  Pool pool(options.compute.threads, device);
  MotionChoice motion(scene, grid, request, options, pool, elapsed);
  known.motion = motion.rough();
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  const PreparedScene prepared = scene.under(known);
  const Scene& linear = prepared.scene();
  const SharedMasks shared_masks = prepared.masks(options.flame_threshold, options.compute);
  const std::vector<FlameMask>& masks = *shared_masks;
  EMBERLOCK_ASSIGN_OR_RETURN(const Hull hull, carve(linear, masks, grid, options.compute));
  SolverSetup setup{{}, {}, hull, known, options, pool};
  const std::vector<PixelBox> boxes = flame_boxes(linear, masks);
  for (std::size_t v = 0; v < linear.views.size(); ++v) {
    if (linear.views[v].role != ViewRole::input) continue;
    setup.views.push_back(&linear.views[v]);
    setup.boxes.push_back(boxes[v]);
  }

  EMBERLOCK_ASSIGN_OR_RETURN(const Hull probe, carve_probe(setup, linear, masks));
  ExtinctionChoice extinction(request, known.extinction);
  extinction.estimate({setup.views, setup.boxes, probe, known, options, pool}, elapsed);
  const bool absorbs = extinction.found().model != Extinction::Model::none;
  if (extinction.is_promising()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Hull closer, carve_probe(setup, linear, masks, 2));
    extinction.look_closer({setup.views, setup.boxes, closer, known, options, pool});
  }
  const CoarseSolution found = try_extinction(setup, extinction.found());
  const double finer = static_cast<double>(found.hull.grid.edge) / static_cast<double>(grid.edge);
  const CoarseFlame flame{linear, masks, found.volume, found.hull, finer};
  double predicted_change = 0;
  if (absorbs) {
    Effects absorbing;
    absorbing.extinction.model = Extinction::Model::field;
    const CoarsePictures pictures(flame, options.compute);
    predicted_change = change(pictures(absorbing), pictures({}));
  }
  Effects decided = known;
  decided.extinction = extinction.decide(predicted_change);
  EffectReport report = extinction.report((elapsed ? elapsed() : Seconds(0)) - start);
  LightChoice light = choose_light(setup, decided.extinction, absorbs, request, elapsed);
  decided.light = light.light;

  EMBERLOCK_ASSIGN_OR_RETURN(EffectChoice choice,
                             predict_effects(flame, decided, request, options.compute, elapsed));
  choice.effects.light = light.light;
  choice.effects.extinction = light.extinction;
  choice.reports.insert(choice.reports.begin(), {std::move(report), std::move(light.report)});
  if (light.light.source == Light::Source::none) choice.alternatives = extinction.alternatives();
  known.extinction = choice.effects.extinction;
  choice.effects.motion = motion.fine(known);
  choice.reports.push_back(motion.report());
  return choice;
} catch (const DeviceError& e) {
  return e.error();
} catch (const Diverged& e) {
  return e.error();
}

Result<EffectChoice> choose_effects(const Scene& scene, const Grid& grid, const EffectRequest& request,
                                    const SolveOptions& options, const Elapsed& elapsed) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const PreparedScene told, PreparedScene::create(scene, {}));
  return choose_effects(under_known_effects(told, request, options.compute), grid, request, options, elapsed);
} catch (const DeviceError& e) {
  return e.error();
}

}  // namespace emberlock::recon
