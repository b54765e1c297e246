#include "recon/effects/effects.h"

#include <charconv>
#include <cmath>

namespace emberlock {
namespace {

Error unknown(std::string_view text) {
  return {ErrorKind::bad_input, "can't read '" + std::string(text) + "'", "effects",
          "Use auto, none, or a list of extinction=VALUE with VALUE in 1/m, 0 or more"};
}

Result<Effects> parse_list(std::string_view text) {
  Effects effects;
  bool seen = false;
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view item = text.substr(0, comma);
    constexpr std::string_view kExtinction = "extinction=";
    if (seen || !item.starts_with(kExtinction)) return unknown(item);
    const std::string_view number = item.substr(kExtinction.size());
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(value) || value < 0)
      return unknown(item);
    effects.extinction = constant_extinction(PerMeter(value));
    seen = true;
    if (comma == std::string_view::npos) return effects;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace

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

Result<EffectRequest> parse_effects(std::string_view text) {
  EffectRequest request;
  if (text == "auto") return request;
  if (text == "none") {
    request.fixed = Effects{};
    return request;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(request.fixed, parse_list(text));
  return request;
}

}  // namespace emberlock
