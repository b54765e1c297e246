// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/choose_light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "recon/adjust/find_light.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/left_out_views.h"

namespace emberlock::recon {
namespace {

std::string explain_light(const FoundLight& found) {
  const Light& light = found.light;
  const auto& a = light.ambient;
  const auto& s = light.strength;
  const auto& p = light.place;
  const std::string density = fmt::format("{:.2g} / m", found.density.value());
  const std::string even = fmt::format("{:.3g} / {:.3g} / {:.3g}", a[0], a[1], a[2]);
  if (light.source == Light::Source::even)
    return fmt::format("light of {} from all sides on {} leaves {:.3g} grey levels on a coarse grid", even,
                       density, found.error);
  const bool is_near = light.source == Light::Source::nearby;
  const std::string words = fmt::format(
      "{} {:.2f} / {:.2f} / {:.2f}{} of {:.3g} / {:.3g} / {:.3g}, beside {} from all sides, on {} leaves "
      "{:.3g} grey levels on a coarse grid",
      is_near ? "a light nearby at" : "a distant light towards", p[0], p[1], p[2], is_near ? " m" : "", s[0],
      s[1], s[2], even, density, found.error);
  return found.even_error ? words + fmt::format(", and even light {:.3g}", *found.even_error) : words;
}

Extinction expected(const FoundLight& found) {
  return {Extinction::Model::field, PerMeter(0), found.density};
}

}  // namespace

LightChoice choose_light(const SolverSetup& setup, const Extinction& otherwise, bool absorbs,
                         const EffectRequest& request, const Elapsed& elapsed) {
  using Source = Light::Source;
  const auto now = [&] { return elapsed ? elapsed() : Seconds(0); };
  const Seconds start = now();
  const auto off = [&](std::string why) {
    return LightChoice{{}, otherwise, {"light", false, 0, now() - start, std::move(why), {}}};
  };
  if (request.fixed && request.fixed->light.source == Source::none) return off("left out by hand");
  if (request.fixed) {
    const bool sought = request.fixed->light.source == Source::found;
    FoundLight found = find_light(setup, request.fixed->light, elapsed);
    if (!std::isfinite(found.error)) throw Diverged(found.error, std::numeric_limits<double>::infinity());
    if (sought) found = refine_light(setup, found, elapsed);
    return {found.light,
            expected(found),
            {"light", true, 0, now() - start, "set by hand: " + explain_light(found), {}}};
  }
  if (request.assumed.light.source == Source::none) return off("not looked for");
  if (setup.options.solver == Solver::paper) return off("the paper's solver knows none");
  if (!absorbs) return off("nothing absorbs, so nothing scatters");
  const auto late = [&] { return is_spent(0.4, setup.options, elapsed); };
  if (late()) return off("there was no time to look for it");
  const LeftOutViews free(setup, setup.hull);
  if (!free.any()) return off("too few views to tell lit from glowing");
  Light any;
  any.source = Source::found;
  FoundLight found = find_light(setup, any, elapsed);
  if (!std::isfinite(found.error)) return off("no fit of a lit medium came to an end");
  if (found.light.source == Source::even)
    return off(explain_light(found) +
               ": no shade tells that from an even glow, so only light=even takes it for light");
  const FoundSmoothness without = find_smoothness(free, otherwise, late);
  const auto shown_under = [&](const FoundLight& light) {
    SolverSetup lit = setup;
    lit.effects.light = light.light;
    return find_smoothness(LeftOutViews(lit, setup.hull), expected(light), late);
  };
  FoundSmoothness with = shown_under(found);
  // A rough direction is some 20 degrees off, so one that comes near is refined before it is judged.
  if (with.error < (1 + kLeastGainOfLight) * without.error && !late()) {
    found = refine_light(setup, found, elapsed);
    const FoundSmoothness closer = shown_under(found);
    if (std::isfinite(closer.error)) with = closer;
  }
  if (!std::isfinite(with.error) || !std::isfinite(without.error))
    return off(explain_light(found) + (late() ? "; there was no time to compare that with a medium that glows"
                                              : "; fits without some of the views diverged"));
  const bool believed = with.error < (1 - kLeastGainOfLight) * without.error;
  const std::string shown = fmt::format(
      "{}; views that are left out of the fit are shown to {:.3g} grey levels so, and to {:.3g} by "
      "a medium that glows",
      explain_light(found), with.error, without.error);
  if (!believed) return off(shown);
  return {found.light,
          expected(found),
          {"light", true, std::max(0.0, without.error - with.error), now() - start, shown, {}}};
}

}  // namespace emberlock::recon
