// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/predict_effects.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/effects/background.h"
#include "recon/views/picture_clues.h"

namespace emberlock::recon {
namespace {

constexpr InScatterOptions kProbe{12, 2, 1e-2, 50};

/// The extinction alone: what every other effect is probed on top of.
Effects extinction_of(const Effects& effects) {
  Effects plain;
  plain.extinction = effects.extinction;
  return plain;
}

class Predictor {
 public:
  Predictor(const CoarseFlame& flame, const Effects& found, const EffectRequest& request,
            const ComputeOptions& compute, const Elapsed& elapsed)
      : flame_(flame),
        request_(request),
        asked_(request.fixed ? *request.fixed : request.assumed),
        elapsed_(elapsed),
        compute_(compute),
        pool_(compute),
        boxes_(flame_boxes(flame.scene, flame.masks)),
        pictures_(flame, compute),
        is_lit_(found.light.source != Light::Source::none),
        plain_(extinction_of(found)) {
    choice_.effects = plain_;
  }

  EffectChoice operator()() {
    shoot(plain_);  // the first pictures wait for memory and caches: they would cost too much
    without_ = shoot(plain_);
    lap_ = now();
    choose_scattering();
    choose_refraction();
    choose_background();
    choose_exposure();
    choose_gamma();
    choose_saturation();
    return std::move(choice_);
  }

 private:
  struct Shot {
    std::vector<RadianceImage> pictures;
    Seconds time{0};
    Seconds preparation{0};  ///< once for all pictures
  };

  void choose_scattering();
  void choose_phase_function(const Shot& shot, Scattering& scattering);
  void choose_refraction();
  void choose_background();
  void choose_exposure();
  void choose_gamma();
  void choose_saturation();

  [[nodiscard]] Seconds now() const { return elapsed_ ? elapsed_() : Seconds(0); }
  [[nodiscard]] bool by_hand() const { return request_.fixed.has_value(); }
  [[nodiscard]] bool calls_for(double change) const { return change >= request_.tolerance; }

  Shot shoot(const Effects& effects, const RenderOptions& options = {}) const {
    return shoot(pictures_, effects, options);
  }
  Shot shoot(const CoarsePictures& pictures, const Effects& effects,
             const RenderOptions& options = {}) const {
    const Seconds start = now();
    Shot shot{pictures(effects, options), {}, {}};
    shot.time = now() - start;
    return shot;
  }
  [[nodiscard]] Shot scatter(const Scattering& scattering);
  [[nodiscard]] static double change(const Shot& with, const Shot& without) {
    return recon::change(with.pictures, without.pictures);
  }
  /// Of what grows with the pixels, seen at every stride-th.
  [[nodiscard]] static Seconds pixel_cost(const Shot& with, const Shot& without, int stride) {
    return std::max(Seconds(0), stride * stride * (with.time - without.time));
  }
  /// Of what is done at every key point, once a picture.
  [[nodiscard]] Seconds volume_cost(const Shot& with, const Shot& without) const {
    return std::max(Seconds(0), std::pow(flame_.finer, 3) * (with.time - without.time));
  }

  void report(const char* name, bool on, double change, Seconds cost, std::string reason) {
    const Seconds time = now();
    choice_.reports.push_back({name, on, change, time - lap_, std::move(reason), cost});
    lap_ = time;
  }
  void leave_out(const char* name, const char* reason) {
    report(name, false, 0, Seconds(0), by_hand() ? "left out by hand" : reason);
  }
  [[nodiscard]] const char* assumed() const { return by_hand() ? "" : " (assumed)"; }
  /// On or off by the change, and the report.
  bool decide(const char* name, double change, Seconds cost, const std::string& what,
              const char* if_off = "") {
    const bool on = by_hand() || calls_for(change);
    std::string does = what + fmt::format(" changes the pictures by {:.2g} grey levels", change);
    if (!on) does += fmt::format(", less than {:.2g}{}", request_.tolerance, if_off);
    report(name, on, change, cost, by_hand() ? "set by hand: " + does : does);
    return on;
  }

  const CoarseFlame& flame_;
  const EffectRequest& request_;
  const Effects& asked_;  ///< by hand, or what auto assumes
  const Elapsed& elapsed_;
  ComputeOptions compute_;
  Pool pool_;
  std::vector<PixelBox> boxes_;
  CoarsePictures pictures_;
  bool is_lit_;  ///< by light from outside
  Effects plain_;
  Shot without_;
  Seconds lap_{0};
  EffectChoice choice_;
};

Predictor::Shot Predictor::scatter(const Scattering& scattering) {
  Effects effects = plain_;
  effects.scattering = scattering;
  const Seconds start = now();
  const ScatterField field = find_in_scatter(pictures_.volume(), pictures_.medium(), effects, kProbe, pool_);
  const Seconds found = now();
  RenderOptions options;
  options.scattered = &field;
  Shot shot = shoot(effects, options);
  // A sweep marches from each key point along each ordinate, whose number grows with their levels' square;
  // that the way is longer on a finer grid shows little beside what it takes to begin one.
  const InScatterOptions full;
  const double voxels = static_cast<double>(full.voxels) / kProbe.voxels;
  const double levels = static_cast<double>(full.octant_levels) / kProbe.octant_levels;
  shot.preparation = std::pow(voxels, 3) * std::pow(levels, 2) * (found - start);
  return shot;
}

void Predictor::choose_scattering() {
  using Order = Scattering::Order;
  const bool absorbs = plain_.extinction.model != Extinction::Model::none;
  if (is_lit_) {
    leave_out("scattering", "the medium scatters light from outside, which is looked at by itself");
    return leave_out("phase function", "light from outside is taken to be scattered evenly");
  }
  if (!absorbs || (by_hand() && asked_.scattering.order == Order::none)) {
    leave_out("scattering", "nothing absorbs, so nothing scatters");
    return leave_out("phase function", "nothing scatters");
  }
  Scattering scattering = asked_.scattering;
  if (!by_hand() && scattering.albedo == 0) {
    leave_out("scattering",
              "pictures can't tell evenly scattered light from emitted light: auto:albedo=0.2, soot's, takes "
              "it out");
    leave_out("phase function", "scattering is off");
    return;
  }
  if (!by_hand()) scattering.order = Order::single;
  Shot shot = scatter(scattering);
  double changed = change(shot, without_);
  // What scatters again is at most the albedo's share each time: a small first time can't add up to much.
  if (!by_hand() && changed >= request_.tolerance * (1 - scattering.albedo)) {
    Scattering again = scattering;
    again.order = Order::multiple;
    Shot multiple = scatter(again);
    const double changed_again = change(multiple, without_);
    const bool single_will_do = calls_for(changed) && !calls_for(change(multiple, shot));
    if (calls_for(changed_again) && !single_will_do) {
      scattering = again;
      shot = std::move(multiple);
      changed = changed_again;
    }
  }
  const char* order = scattering.order == Order::single ? "single" : "multiple";
  std::string what =
      fmt::format("{} scattering with an albedo of {:.2g}{}", order, scattering.albedo, assumed());
  if (scattering.asymmetry == 0)
    what += ", which looks the same from all sides and only tells scattered from emitted light,";
  const Seconds cost = shot.preparation + volume_cost(shot, without_);
  if (!decide("scattering", changed, cost, what)) return leave_out("phase function", "scattering is off");
  choose_phase_function(shot, scattering);
  choice_.effects.scattering = scattering;
}

void Predictor::choose_phase_function(const Shot& shot, Scattering& scattering) {
  if (scattering.asymmetry == 0) return leave_out("phase function", "g is 0: isotropic");
  Scattering isotropic = scattering;
  isotropic.asymmetry = 0;
  const Shot even = scatter(isotropic);
  const Seconds cost = std::max(Seconds(0), shot.preparation - even.preparation) + volume_cost(shot, even);
  const std::string what = fmt::format("g = {:.2g}{}", scattering.asymmetry, assumed());
  const char* isotropic_then =
      ": scattering looks the same from all sides and only tells scattered from emitted light";
  if (!decide("phase function", change(shot, even), cost, what, isotropic_then)) scattering = isotropic;
}

void Predictor::choose_refraction() {
  if (by_hand() && asked_.refraction.rays == Refraction::Rays::straight) return leave_out("refraction", "");
  if (pictures_.medium().count == 0) return leave_out("refraction", "there is no medium");
  Effects bent = plain_;
  bent.refraction = asked_.refraction;
  bent.refraction.rays = Refraction::Rays::curved;
  std::vector<Rgba> emission(pictures_.medium().grid.size());
  for (std::size_t i = 0; 3 * i < pictures_.volume().emission.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) emission[i].c[c] = pictures_.volume().emission[3 * i + c];
  GasTemperature gas = assume_temperature(pictures_.medium(), emission, bent.refraction);
  // Bent rays are sampled elsewhere than straight ones, which changes coarse pictures more than the bending.
  // Gas some times colder throughout bends them as many times more, and pictures change in proportion.
  constexpr double kColder = 10;
  for (float& kelvin : gas.kelvin) kelvin /= static_cast<float>(kColder);
  Effects probe = bent;
  probe.refraction.ambient /= kColder;
  RenderOptions options;
  options.gas = &gas;
  const CoarsePictures few(flame_, compute_, 5000);  // to follow bent rays takes five times as long
  const Shot without = shoot(few, plain_);
  const Shot with = shoot(few, probe, options);
  const double changed = change(with, without) / kColder;
  const std::string what = fmt::format("gas of {:.4g} K in air of {:.4g} K{}", bent.refraction.flame.value(),
                                       bent.refraction.ambient.value(), assumed());
  if (decide("refraction", changed, pixel_cost(with, without, few.stride()), what))
    choice_.effects.refraction = bent.refraction;
}

void Predictor::choose_background() {
  using Kind = Background::Kind;
  if (by_hand() && asked_.background.kind == Kind::black) return leave_out("background", "");
  Effects lit = plain_;
  std::string what;
  if (by_hand()) {
    lit.background = asked_.background;
    what = "it";
  } else if (std::any_of(flame_.scene.views.begin(), flame_.scene.views.end(),
                         [](const View& view) { return view.role == ViewRole::input && view.background; })) {
    lit.background.kind = Kind::image;
    what = "what the views' own background pictures show";
  } else {
    const auto border = border_level(flame_.scene, flame_.masks);
    if (!border) return leave_out("background", "no background picture, and the flame covers all borders");
    lit.background = {Kind::constant, border->level};
    const auto& level = border->level;
    what = fmt::format("a level of {:.1f} / {:.1f} / {:.1f} at the borders", level[0], level[1], level[2]);
    if (calls_for(border->unevenness))
      what +=
          fmt::format(" (uneven by {:.1f}: pictures of the background would tell more)", border->unevenness);
  }
  const Shot with = shoot(lit);
  if (decide("background", change(with, without_), pixel_cost(with, without_, pictures_.stride()), what))
    choice_.effects.background = lit.background;
}

void Predictor::choose_exposure() {
  Exposure exposure = asked_.exposure;
  if (by_hand() && exposure.shutter == Exposure::Shutter::instant) return leave_out("exposure", "");
  const double way = std::abs(exposure.rise_speed) * exposure.time.value();
  if (way <= 0) return leave_out("exposure", "no exposure time is known");
  exposure.shutter = Exposure::Shutter::integrated;
  // The coarse flame lacks the structure that a way of few edges blurs: it is probed by a longer one. A
  // smooth flame would change by the way's square, a turbulent one has structure of all sizes: 1.5..1.7
  // measured.
  constexpr double kShortest = 3.5;
  constexpr double kGrowth = 1.6;
  const double edges = way / static_cast<double>(flame_.volume.grid.edge);
  const double longer = std::max(1.0, kShortest / edges);
  Effects blurred = plain_;
  blurred.exposure = exposure;
  blurred.exposure.time *= longer;
  const Shot with = shoot(blurred);
  const double changed = change(with, without_) / std::pow(longer, kGrowth);
  const std::string what =
      fmt::format("a shutter open for {:.3g} s at {:.2g} m/s", exposure.time.value(), exposure.rise_speed);
  if (decide("exposure", changed, volume_cost(with, without_), what)) choice_.effects.exposure = exposure;
}

void Predictor::choose_gamma() {
  const bool curved = asked_.sensor.gamma != 1;
  if (!curved || (by_hand() && asked_.sensor.response == Sensor::Response::linear))
    return leave_out("gamma", "pictures are taken to be linear in light");
  Effects bent = plain_;
  bent.sensor = asked_.sensor;
  bent.sensor.response = Sensor::Response::gamma;
  bent.sensor.clipping = Sensor::Clipping::none;
  const Shot with = shoot(bent);
  const Seconds cost = pixel_cost(with, without_, pictures_.stride());
  if (decide("gamma", change(with, without_), cost, fmt::format("gamma {:.3g}", bent.sensor.gamma)))
    choice_.effects.sensor = bent.sensor;
}

void Predictor::choose_saturation() {
  if (by_hand() && asked_.sensor.clipping == Sensor::Clipping::none) return leave_out("saturation", "");
  const double told = asked_.sensor.white;
  const double white = by_hand() ? told : clip_level(flame_.scene, boxes_, told);
  if (white <= 0) {
    const std::vector<View>& views = flame_.scene.views;
    const bool marked = std::any_of(views.begin(), views.end(), marks_saturation);
    return leave_out("saturation",
                     marked ? "saturated pixels are bounds already" : "no pixels pile up at white");
  }
  const ClippedPixels clipped = clipped_pixels(flame_.scene, boxes_, white);
  const std::string what = fmt::format(
      "what is missing in the {:.2g} % of the flame's pixels at white ({:.4g})", 100 * clipped.share, white);
  if (!decide("saturation", clipped.excess, Seconds(0), what)) return;
  Sensor& sensor = choice_.effects.sensor;
  sensor.clipping = Sensor::Clipping::at_white;
  if (sensor.response == Sensor::Response::linear) sensor.white = white;  // gamma has its own, for both
}

}  // namespace

Result<EffectChoice> predict_effects(const CoarseFlame& flame, const Effects& found,
                                     const EffectRequest& request, const ComputeOptions& compute,
                                     const Elapsed& elapsed) {
  const Background background =
      request.fixed ? request.fixed->background : Background{Background::Kind::image, {}};
  for (const View& view : flame.scene.views) EMBERLOCK_RETURN_IF_ERROR(check(background, view));
  return Predictor(flame, found, request, compute, elapsed)();
}

}  // namespace emberlock::recon
