// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::recon {

// The table of effects: what light does on its way, beside being emitted. Each one's first choice is to be
// left out, and then nothing of it runs.

/// sigma_t, the light lost a metre.
struct Extinction {
  enum class Model {
    none,
    constant,  ///< `value` inside the medium, 0 outside
    field,  ///< Volume::extinction, trilinear between key points (soot-proportional, or found from pictures)
  };
  Model model = Model::none;
  /// Of `constant`; of `field`, what a solver thinks at first to be even inside the medium.
  PerMeter value{0};
  /// Of `field`: what a solver thinks at first to be proportional to the emission's luminance, its mean.
  PerMeter soot{0};
};
/// None where the value is 0.
Extinction constant_extinction(PerMeter value);

/// Light that the medium scatters towards the camera: sigma_s = albedo * sigma_t, phase function of Henyey
/// and Greenstein (1941); asymmetry > 0 scatters forwards.
struct Scattering {
  enum class Order { none, single, multiple };
  Order order = Order::none;
  double albedo = 0;     ///< 0..1
  double asymmetry = 0;  ///< g, -1..1; 0 is isotropic
};

/// Light from outside, which a medium that doesn't glow scatters once, evenly in all directions: the source
/// is S = sigma_t (ambient + strength R). R is what reaches a place: the transmittance exp(-depth) towards
/// the light, over the squared distance in metres to one nearby (lit_medium.h). Emission and extinction are
/// then one unknown, the density.
struct Light {
  enum class Source {
    none,
    found,    ///< whichever of the following the pictures show best: find_light.h
    even,     ///< from all sides alike, and the medium shades nothing: `ambient` alone
    distant,  ///< parallel, like the sun's
    nearby,   ///< a point outside of the medium's box
  };
  Source source = Source::none;
  /// Of `distant` the direction towards it, of any length but 0; of `nearby` where it stands, metres.
  std::array<double, 3> place = {};
  /// Albedo * irradiance / (4 pi), grey levels; of `nearby` that at a metre. A solver finds both colours.
  std::array<double, 3> strength = {};
  std::array<double, 3> ambient = {};  ///< albedo * mean radiance of all sides, grey levels
};

/// Rays bent by the hot gas: n - 1 = (n_air - 1) T_air / T (Gladstone and Dale 1863). The program can't
/// measure the gas: refraction.h says what it assumes between these two temperatures.
struct Refraction {
  enum class Rays { straight, curved };
  Rays rays = Rays::straight;
  Kelvin flame{1800};   ///< of the gas in the middle of the flame
  Kelvin ambient{293};  ///< of the air around it
};

/// What lies behind the flame. `image` takes each View's own background picture, black where it has none.
struct Background {
  enum class Kind { black, constant, image };
  Kind kind = Kind::black;
  std::array<double, 3> radiance = {};  ///< of `constant`, grey levels
  friend bool operator==(const Background&, const Background&) = default;
};

/// How long the shutter is open on a flame that rises meanwhile.
struct Exposure {
  enum class Shutter { instant, integrated };
  Shutter shutter = Shutter::instant;
  Seconds time{0};
  double rise_speed = 1;  ///< m/s along +z; about 1 in candles and small fires
};

/// How the flame moves while the views, each at its own instant (View::lateness), film it. Its average over
/// the recording stays, and what differs from the average is carried along as it is (Taylor 1938, "The
/// Spectrum of Turbulence": frozen turbulence); where no average is known, all of it is carried.
struct Motion {
  enum class Carry { none, uniform };
  Carry carry = Carry::none;
  std::array<double, 3> velocity = {};  ///< m/s in the world
  friend bool operator==(const Motion&, const Motion&) = default;
};

/// From radiance to pixel values: value = white * (radiance / white)^(1 / gamma), clipped at white. A clipped
/// pixel bounds the radiance from below and says no more.
struct Sensor {
  enum class Response { linear, gamma };
  enum class Clipping { none, at_white };
  Response response = Response::linear;
  Clipping clipping = Clipping::none;
  double gamma = 1;    ///< of `gamma`
  double white = 255;  ///< grey levels
  friend bool operator==(const Sensor&, const Sensor&) = default;
};

struct Effects {
  Extinction extinction;
  Scattering scattering;
  Refraction refraction;
  Background background;
  Exposure exposure;
  Sensor sensor;
  Motion motion;
  Light light;
};

/// An Error that names the first value out of its range, as parse_effects states them.
Status check(const Effects& effects);

/// Constant extinction and nothing else.
Effects absorbing(PerMeter extinction);

/// The paper's opacity a sample (0.05) as extinction: sigma = -ln(1 - tau) / edge.
PerMeter extinction_of_opacity(double tau, Meters voxel_edge);

/// What no picture of a glowing flame tells, for soot in visible light. At 514.5 nm Koylu and Faeth (J. Heat
/// Transfer 116, 1994) measured scattering to absorption 0.22..0.41 above flames of four fuels, an albedo of
/// 0.18..0.29, and forward scattering some 100 times that to the side, which Henyey and Greenstein's function
/// has at g = 0.73. Soot inside the flame is younger and its aggregates smaller: g = 0.6 (25 times), and an
/// albedo of about 0.2. But pictures can't tell light that is scattered evenly from light that is emitted, so
/// the albedo is 0, not known, until the user tells it. Refraction has its own defaults; no exposure time, a
/// linear sensor, white at 255.
Effects assumed_effects();

/// What the user asks for: `--effects auto|none|LIST`.
struct EffectRequest {
  std::optional<Effects> fixed;  ///< set by hand; otherwise found out from the pictures
  double tolerance = 0.5;        ///< grey levels: an effect that changes the pictures by less stays off
  /// What auto takes an effect to be like where the pictures can't tell: albedo (0: not known) and g, the
  /// gas, exposure time (0: not known) and rise, gamma, white; and whether a light is looked for (`light`
  /// found or none). Which other effects are on in it doesn't matter.
  Effects assumed = assumed_effects();
};

/// "auto", "none", or a comma separated list of effects by name, each once; what isn't named is left out.
/// A choice may bring parameters, `:name=value`; numbers in SI units and grey levels:
///   auto           :albedo=0 (0: not known; soot 0.2), :g=0.6, :flame=1800, :ambient=293, :exposure=0 (s; 0:
///   not known), :rise=1,
///                  :gamma=1, :white=255, :light=1 (0: not lit), :tolerance=0.5 (levels)
///   extinction=none|field|SIGMA                 SIGMA >= 0, 1/m
///   scattering=none|single|multiple             with extinction; :albedo=0.5 (0..1), :g=0 (-1..1)
///   refraction=straight|curved                  :flame=1800, :ambient=293 (K, 100..100000)
///   background=black|image|LEVEL|RED/GREEN/BLUE >= 0
///   exposure=instant|SECONDS                    0..10 s; :rise=1 (m/s, -20..20)
///   gamma=GAMMA                                 0.1..10; 1 is linear
///   saturation=none|LEVEL                       > 0; also gamma's white, 255 otherwise
///   motion=none|RISE|X/Y/Z                      -20..20 m/s, RISE along +z; of views whose times differ
///   light=none|found|even|distant|nearby        with extinction=field, which it brings, and no scattering;
///                                               :x=:y=:z=, towards it, or where it stands (m)
/// An Error that says what can't be read and lists these names otherwise.
Result<EffectRequest> parse_effects(std::string_view text);

/// One line of the report: what an effect does to this scene and why it is on or off.
struct EffectReport {
  std::string name;
  bool on = false;
  double predicted_change = 0;  ///< RMS of the input pictures' change in grey levels, after the best gain
  Seconds seconds{0};           ///< what finding out cost
  std::string reason;
  /// What the effect adds to rendering all input views once, within a factor of three; 0: not measured.
  Seconds cost{0};
};

struct EffectChoice {
  Effects effects;
  std::vector<EffectReport> reports;  ///< one for each effect of the table
  /// Other extinctions, or none, that explain the pictures nearly as well: what they change is an error of
  /// the result.
  std::vector<Extinction> alternatives = {};
};

}  // namespace emberlock::recon
