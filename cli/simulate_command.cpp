// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/pixel_formats.h"
#include "recon/calibrate/camera_response.h"
#include "rig/simulate/simulate_flame.h"

namespace emberlock::cli {
namespace {

struct SimulateArguments {
  rig::SimulateOptions simulate;
  std::string out;
  std::string preset = "candle";
  std::string cameras = "virtual:11";
  std::string image = "640x480";
  std::string format = "rgb8";
  std::string response;
  std::optional<double> exposure_ms;
  double offsets_ms = 0;
  bool stagger = false;
  std::string sun;
  std::optional<double> albedo;
  double rate = 24;
};

/// "virtual:11": so many cameras.
Result<int> parse_virtual_rig(const std::string& text) {
  constexpr std::string_view kKind = "virtual:";
  int count = 0;
  if (text.starts_with(kKind)) {
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data() + kKind.size(), end, count);
    if (read.ec == std::errc() && read.ptr == end) return count;
  }
  return Error{ErrorKind::bad_input, "not a rig of simulated cameras", "--rig " + text, "Write virtual:11"};
}

/// "x,y,z", or nothing.
Result<std::optional<recon::Sun>> parse_sun(const SimulateArguments& arguments) {
  if (arguments.sun.empty() && !arguments.albedo) return std::optional<recon::Sun>{};
  recon::Sun sun;
  sun.albedo = arguments.albedo.value_or(sun.albedo);
  if (!arguments.sun.empty()) {
    const auto towards = parse_numbers_of<3>(arguments.sun);
    if (!towards)
      return Error{ErrorKind::bad_input, "\"" + arguments.sun + "\" is no direction", "--sun",
                   "Give x,y,z, towards the sun"};
    sun.towards = {(*towards)[0], (*towards)[1], (*towards)[2]};
  }
  return std::optional(sun);
}

OutputRequest output_of(const SimulateArguments& arguments) {
  OutputRequest request{arguments.out, kSimulateFlame};
  if (!arguments.response.empty()) request.inputs = {arguments.response};
  return request;
}

std::string finer_truth(const rig::SimulateOptions& options, const rig::SimulatedFilm& film) {
  const std::optional<int> enough = rig::cells_for_pictures(options.cells, film);
  const auto even = [&](int side) { return 2 * static_cast<int>(side * (film.pixel / film.cell) / 2); };
  const ImageSize small{even(options.image.width), even(options.image.height)};
  std::vector<std::string> ways;
  if (enough) ways.push_back(fmt::format("--cells {}", *enough));
  if (std::min(small.width, small.height) >= rig::SimulateOptions::kLeastSide)
    ways.push_back(fmt::format("--image {}x{}", small.width, small.height));
  if (ways.empty()) return "more cells and smaller pictures together would resolve no more than the truth";
  return fmt::format("with {} the truth would be finer than any reconstruction", fmt::join(ways, " or "));
}

void simulate(SimulateArguments arguments) {
  rig::SimulateOptions& options = arguments.simulate;
  options.preset = or_fail(recon::parse_flame_preset(arguments.preset));
  options.cameras = or_fail(parse_virtual_rig(arguments.cameras));
  options.image = or_fail(parse_image_size(arguments.image));
  options.rate = Hertz(arguments.rate);
  options.format = pixel_formats().at(arguments.format);
  options.offsets = milliseconds(arguments.offsets_ms);
  options.stagger = arguments.stagger;
  options.sun = or_fail(parse_sun(arguments));
  if (arguments.exposure_ms) options.exposure = milliseconds(*arguments.exposure_ms);
  if (!arguments.response.empty())
    options.response = or_fail(recon::read_camera_response(arguments.response));
  OutputFolder folder = or_fail(OutputFolder::create(output_of(arguments)));
  const Progress bar = progress_bar("simulate flame");
  const Interrupt interrupt;
  const auto observer = [&](double fraction, std::string_view what) {
    tell(bar, fraction, what);
    return !Interrupt::asked();
  };
  const rig::SimulatedFilm film = or_fail(rig::simulate_flame(options, folder.path(), observer));
  or_fail(folder.commit());
  tell(bar, 1, "done");
  const std::string& out = arguments.out;
  std::printf("%s/session   %d frames of %d cameras\n", out.c_str(), film.frames, film.cameras);
  std::printf("%s/truth     emission, density, temperature and velocity of each frame, OpenVDB\n",
              out.c_str());
  std::printf("hottest gas %.0f K; relative divergence at most %.1e%s\n", film.hottest.value(),
              film.relative_divergence,
              options.response && options.response->absolute
                  ? fmt::format("; exposure {:.4g} ms", 1e3 * film.exposure.value()).c_str()
                  : "");
  constexpr double kMilli = 1e3;
  std::printf("the truth's voxels are %.2g mm, a pixel covers %.2g mm of the flame%s\n\n",
              kMilli * film.cell.value(), kMilli * film.pixel.value(),
              film.cell > film.pixel ? (": " + finer_truth(options, film)).c_str() : "");
  std::printf("next   emberlock reconstruct %s/session %s--out result\n", out.c_str(),
              options.response && options.preset != recon::FlamePreset::smoke
                  ? "--quantity temperature --emitter soot "
                  : "");
}

/// What their pictures are like.
void add_camera_options(const Verb& verb, SimulateArguments& a) {
  verb.add_option("--format", a.format, "Of the pictures; bayer: a mosaic of colours")
      .check_choices(names_of(pixel_formats()))
      .show_default();
  verb.add_option(
          "--response", a.response,
          "JSON file of the cameras' spectral response, whose levels hold for 1 ms; the session keeps it")
      .set_type("FILE");
  verb.add_option("--exposure", a.exposure_ms,
                  "Milliseconds, of a response with its scale [what the brightest pixel needs for 230 of 255 "
                  "levels]");
  verb.add_option("--offsets", a.offsets_ms, "Milliseconds by which cameras' shutters are late at most")
      .show_default();
  verb.add_flag(
          "--stagger", a.stagger,
          "Cameras at instants spread evenly over the frame period, as `emberlock align --stagger` has them")
      .exclude("--offsets");
  verb.add_option("--sun", a.sun, "x,y,z: of smoke, where the sun stands (default: 1,-1,1)");
  verb.add_option(
      "--albedo", a.albedo,
      fmt::format("Of smoke: the share of the light it takes that it scatters [{}]", recon::Sun{}.albedo));
}

}  // namespace

void add_simulate(const Verb& app) {
  const Verb parent = app.add_verb("simulate", "Simulates what cameras can film");
  parent.require_verb();
  auto arguments = std::make_shared<SimulateArguments>();
  const Verb verb = parent.add_verb(
      "flame",
      "Computes burning gas and films it with simulated cameras: a session, and the truth beside it");
  SimulateArguments& a = *arguments;
  verb.add_option("--out", a.out, "Folder for session/ and truth/").require();
  verb.add_option("--preset", a.preset,
                  "candle, pool-fire, torch, two-plumes, or smoke, which the sun lights")
      .show_default();
  verb.add_option("--frames", a.simulate.frames, "Frames that each camera films").show_default();
  verb.add_option("--rig", a.cameras, "virtual:N, so many cameras on an arc around the flame").show_default();
  verb.add_option("--image", a.image, "Size of the pictures").show_default();
  verb.add_option("--cells", a.simulate.cells,
                  "Cells of the gas across, a multiple of 8; twice as many upwards")
      .show_default();
  verb.add_option("--rate", a.rate, "Frames a second").show_default();
  verb.add_option("--noise", a.simulate.read_noise, "Read noise, grey levels; 0: no noise at all")
      .show_default();
  add_camera_options(verb, a);
  verb.add_threads(a.simulate.compute.threads);
  verb.add_option("--seed", a.simulate.seed, "Seed of all random numbers").show_default();
  verb.set_action([arguments] { simulate(*arguments); });
}

}  // namespace emberlock::cli
