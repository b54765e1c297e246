// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/effects.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace emberlock::recon {
namespace {

Error bad(std::string what) {
  return {ErrorKind::bad_input, std::move(what), "effects",
          "Use auto[:albedo=VALUE][:g=VALUE][:flame=KELVIN][:ambient=KELVIN][:exposure=SECONDS][:rise=M/S]"
          "[:gamma=VALUE][:white=LEVEL][:light=0|1][:tolerance=LEVELS], none, or a comma separated list of "
          "extinction=none|field|VALUE (1/m), "
          "scattering=none|single|multiple[:albedo=VALUE][:g=VALUE], "
          "refraction=straight|curved[:flame=KELVIN][:ambient=KELVIN], "
          "background=black|image|LEVEL|RED/GREEN/BLUE, exposure=instant|SECONDS[:rise=M/S], gamma=VALUE, "
          "saturation=none|LEVEL, motion=none|RISE|X/Y/Z (m/s), "
          "light=none|found|even|distant:x=X:y=Y:z=Z|nearby:x=X:y=Y:z=Z (m)"};
}

Error unknown(std::string_view text) { return bad("can't read '" + std::string(text) + "'"); }

/// Returns the part of `text` before the first `mark`, and removes it and the mark; all of it if there is no
/// mark.
std::string_view take(std::string_view& text, char mark) {
  const std::size_t at = text.find(mark);
  const std::string_view head = text.substr(0, at);
  text = at == std::string_view::npos ? std::string_view{} : text.substr(at + 1);
  return head;
}

bool read(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

/// One effect of the list, name=choice:key=value:key=value. Parameters are removed as they are read.
class Item {
 public:
  explicit Item(std::string_view text) : text_(text) {
    std::string_view first = take(text, ':');
    name_ = take(first, '=');
    choice_ = first;
    while (!text.empty()) {
      std::string_view rest = take(text, ':');
      const std::string_view key = take(rest, '=');
      parameters_.emplace_back(key, rest);
    }
    if (text_.ends_with(':')) understood_ = false;
  }

  [[nodiscard]] std::string_view text() const { return text_; }
  [[nodiscard]] std::string_view name() const { return name_; }
  [[nodiscard]] std::string_view choice() const { return choice_; }
  [[nodiscard]] bool is(std::string_view choice) const { return choice_ == choice; }
  bool number(double& value) const { return read(choice_, value); }

  /// Reads an optional parameter; if it is absent, the default stays.
  void parameter(std::string_view key, double& value) {
    const auto at = std::find_if(parameters_.begin(), parameters_.end(),
                                 [&](const auto& parameter) { return parameter.first == key; });
    if (at == parameters_.end()) return;
    understood_ = understood_ && read(at->second, value);
    parameters_.erase(at);
  }
  /// Whether no parameter is left, and all that were read were valid numbers.
  [[nodiscard]] bool understood() const { return understood_ && parameters_.empty(); }

 private:
  std::string_view text_, name_, choice_;
  std::vector<std::pair<std::string_view, std::string_view>> parameters_;
  bool understood_ = true;
};

bool read_extinction(Item& item, Effects& effects) {
  double value = 0;
  if (item.is("none")) return true;
  if (item.is("field")) {
    effects.extinction.model = Extinction::Model::field;
    return true;
  }
  if (!item.number(value) || value < 0) return false;
  effects.extinction = constant_extinction(PerMeter(value));
  return true;
}

bool read_scattering(Item& item, Effects& effects) {
  using Order = Scattering::Order;
  if (item.is("none")) return true;
  if (!item.is("single") && !item.is("multiple")) return false;
  effects.scattering.order = item.is("single") ? Order::single : Order::multiple;
  effects.scattering.albedo = 0.5;
  item.parameter("albedo", effects.scattering.albedo);
  item.parameter("g", effects.scattering.asymmetry);
  return true;
}

bool read_refraction(Item& item, Effects& effects) {
  if (item.is("straight")) return true;
  if (!item.is("curved")) return false;
  double flame = effects.refraction.flame.value();
  double ambient = effects.refraction.ambient.value();
  item.parameter("flame", flame);
  item.parameter("ambient", ambient);
  effects.refraction = {Refraction::Rays::curved, Kelvin(flame), Kelvin(ambient)};
  return true;
}

/// A/B/C
bool read_three(std::string_view text, std::array<double, 3>& values) {
  if (std::count(text.begin(), text.end(), '/') != 2) return false;
  return std::all_of(values.begin(), values.end(),
                     [&](double& value) { return read(take(text, '/'), value); });
}

bool read_background(Item& item, Effects& effects) {
  Background& background = effects.background;
  if (item.is("black")) return true;
  if (item.is("image")) {
    background.kind = Background::Kind::image;
    return true;
  }
  background.kind = Background::Kind::constant;
  double grey = 0;
  if (item.number(grey)) {
    background.radiance.fill(grey);
    return true;
  }
  return read_three(item.choice(), background.radiance);
}

bool read_exposure(Item& item, Effects& effects) {
  double time = 0;
  if (item.is("instant")) return true;
  if (!item.number(time)) return false;
  effects.exposure.shutter = Exposure::Shutter::integrated;
  effects.exposure.time = Seconds(time);
  item.parameter("rise", effects.exposure.rise_speed);
  return true;
}

bool read_gamma(Item& item, Effects& effects) {
  if (!item.number(effects.sensor.gamma)) return false;
  if (effects.sensor.gamma != 1) effects.sensor.response = Sensor::Response::gamma;
  return true;
}

bool read_saturation(Item& item, Effects& effects) {
  if (item.is("none")) return true;
  if (!item.number(effects.sensor.white)) return false;
  effects.sensor.clipping = Sensor::Clipping::at_white;
  return true;
}

bool read_motion(Item& item, Effects& effects) {
  if (item.is("none")) return true;
  Motion& motion = effects.motion;
  motion.carry = Motion::Carry::uniform;
  return item.number(motion.velocity[2]) || read_three(item.choice(), motion.velocity);
}

bool read_light(Item& item, Effects& effects) {
  using Source = Light::Source;
  Light& light = effects.light;
  if (item.is("none")) return true;
  if (item.is("found") || item.is("even")) {
    light.source = item.is("found") ? Source::found : Source::even;
  } else if (item.is("distant") || item.is("nearby")) {
    light.source = item.is("distant") ? Source::distant : Source::nearby;
    item.parameter("x", light.place[0]);
    item.parameter("y", light.place[1]);
    item.parameter("z", light.place[2]);
  } else {
    return false;
  }
  return true;
}

struct Reader {
  std::string_view name;
  bool (*read)(Item&, Effects&);
};
constexpr Reader kTable[] = {
    {"extinction", read_extinction}, {"scattering", read_scattering}, {"refraction", read_refraction},
    {"background", read_background}, {"exposure", read_exposure},     {"gamma", read_gamma},
    {"saturation", read_saturation}, {"motion", read_motion},         {"light", read_light},
};

Result<Effects> parse_list(std::string_view text) {
  Effects effects;
  std::vector<std::string_view> seen;
  if (text.empty() || text.ends_with(',')) return unknown(text);
  while (!text.empty()) {
    Item item(take(text, ','));
    const Reader* reader = std::find_if(std::begin(kTable), std::end(kTable),
                                        [&](const Reader& r) { return r.name == item.name(); });
    if (reader == std::end(kTable)) return unknown(item.text());
    if (std::find(seen.begin(), seen.end(), item.name()) != seen.end())
      return bad(std::string(item.name()) + " is given twice");
    if (!reader->read(item, effects) || !item.understood()) return unknown(item.text());
    seen.push_back(item.name());
  }
  const bool tells_extinction = std::find(seen.begin(), seen.end(), "extinction") != seen.end();
  if (effects.light.source != Light::Source::none && !tells_extinction)
    effects.extinction.model = Extinction::Model::field;
  EMBERLOCK_RETURN_IF_ERROR(check(effects));
  return effects;
}

bool within(double value, double low, double high) { return value >= low && value <= high; }

/// auto:name=value:name=value
Result<EffectRequest> parse_auto(std::string_view text) {
  EffectRequest request;
  Effects& assumed = request.assumed;
  Item item(text);
  double flame = assumed.refraction.flame.value();
  double ambient = assumed.refraction.ambient.value();
  double exposure = assumed.exposure.time.value();
  double light = 1;
  item.parameter("light", light);
  item.parameter("albedo", assumed.scattering.albedo);
  item.parameter("g", assumed.scattering.asymmetry);
  item.parameter("flame", flame);
  item.parameter("ambient", ambient);
  item.parameter("exposure", exposure);
  item.parameter("rise", assumed.exposure.rise_speed);
  item.parameter("gamma", assumed.sensor.gamma);
  item.parameter("white", assumed.sensor.white);
  item.parameter("tolerance", request.tolerance);
  if (!item.understood()) return unknown(text);
  assumed.refraction.flame = Kelvin(flame);
  assumed.refraction.ambient = Kelvin(ambient);
  assumed.exposure.time = Seconds(exposure);
  if (light != 0 && light != 1) return bad("light must be 1, or 0 where nothing is lit from outside");
  if (light == 0) assumed.light = {};
  if (!within(request.tolerance, 0, 255)) return bad("tolerance must lie in 0..255 grey levels");
  Effects values = assumed;
  values.light = {};  // is looked for, on whatever extinction is found
  EMBERLOCK_RETURN_IF_ERROR(check(values));
  return request;
}

Status check_light(const Effects& effects) {
  const Light& light = effects.light;
  if (light.source == Light::Source::none) return {};
  if (effects.scattering.order != Scattering::Order::none)
    return bad("light from outside is what the medium scatters: leave scattering out");
  if (effects.extinction.model != Extinction::Model::field)
    return bad("light needs extinction=field, which it falls on");
  constexpr double kFarthest = 1e6;
  double longest = 0;
  for (const double x : light.place) {
    if (!within(x, -kFarthest, kFarthest)) return bad("light's x, y and z must lie in -1e6..1e6");
    longest = std::max(longest, std::abs(x));
  }
  if (light.source == Light::Source::distant && longest < 1e-6)
    return bad("a distant light needs x, y and z, the direction towards it");
  return {};
}

}  // namespace

Status check(const Effects& effects) {
  const auto& [extinction, scattering, refraction, background, exposure, sensor, motion, light] = effects;
  constexpr double kMost = 1e30;  // far below the largest float; also excludes infinity
  constexpr double kColdest = 100;
  constexpr double kHottest = 1e5;
  if (!within(extinction.value.value(), 0, kMost)) return bad("extinction must be 0 or more");
  if (!within(scattering.albedo, 0, 1)) return bad("albedo must lie in 0..1");
  if (!within(scattering.asymmetry, -1, 1)) return bad("g must lie in -1..1");
  if (scattering.order != Scattering::Order::none && extinction.model == Extinction::Model::none)
    return bad("scattering needs extinction, whose part it is");
  for (const Kelvin t : {refraction.flame, refraction.ambient})
    if (!within(t.value(), kColdest, kHottest)) return bad("the gas must have 100 to 100000 K");
  for (const double level : background.radiance)
    if (!within(level, 0, kMost)) return bad("background must be 0 or more");
  if (!within(exposure.time.value(), 0, 10)) return bad("exposure must lie in 0..10 s");
  if (!within(exposure.rise_speed, -20, 20)) return bad("rise must lie in -20..20 m/s");
  for (const double speed : motion.velocity)
    if (!within(speed, -20, 20)) return bad("motion must lie in -20..20 m/s");
  EMBERLOCK_RETURN_IF_ERROR(check_light(effects));
  if (!within(sensor.gamma, 0.1, 10)) return bad("gamma must lie in 0.1..10");
  if (!within(sensor.white, 1e-6, kMost)) return bad("saturation must be a level above 0");
  return {};
}

Extinction constant_extinction(PerMeter value) {
  if (value.value() <= 0) return {};
  return {Extinction::Model::constant, value};
}

Effects absorbing(PerMeter extinction) {
  Effects effects;
  effects.extinction = constant_extinction(extinction);
  return effects;
}

PerMeter extinction_of_opacity(double tau, Meters voxel_edge) {
  return PerMeter(-std::log1p(-tau) / voxel_edge.value());
}

Effects assumed_effects() {
  Effects effects;
  effects.scattering.asymmetry = 0.6;
  effects.light.source = Light::Source::found;
  return effects;
}

Result<EffectRequest> parse_effects(std::string_view text) {
  if (text == "auto" || text.starts_with("auto:")) return parse_auto(text);
  EffectRequest request;
  if (text == "none") {
    request.fixed = Effects{};
    return request;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(request.fixed, parse_list(text));
  return request;
}

}  // namespace emberlock::recon
