// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "rig/simulate/simulate_flame.h"

namespace emberlock::cli {
namespace {

struct SimulateArguments {
  rig::SimulateOptions simulate;
  std::string out;
  std::string preset = "candle";
  std::string cameras = "virtual:11";
  std::string image = "640x480";
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

void simulate(SimulateArguments arguments) {
  rig::SimulateOptions& options = arguments.simulate;
  options.preset = or_fail(recon::parse_flame_preset(arguments.preset));
  options.cameras = or_fail(parse_virtual_rig(arguments.cameras));
  options.image = or_fail(parse_image_size(arguments.image));
  options.rate = Hertz(arguments.rate);
  OutputFolder folder = or_fail(OutputFolder::create({arguments.out, kSimulateFlame}));
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
  std::printf("hottest gas %.0f K; relative divergence at most %.1e\n\n", film.hottest.value(),
              film.relative_divergence);
  std::printf("next   emberlock reconstruct %s/session --out result\n", out.c_str());
}

}  // namespace

void add_simulate(CLI::App& app) {
  CLI::App* parent = app.add_subcommand("simulate", "Simulates what cameras can film");
  parent->require_subcommand(1);
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* verb = parent->add_subcommand(
      "flame",
      "Computes burning gas and films it with simulated cameras: a session, and the truth beside it");
  SimulateArguments& a = *arguments;
  verb->add_option("--out", a.out, "Folder for session/ and truth/")->required();
  verb->add_option("--preset", a.preset, "candle, pool-fire, torch or two-plumes")->capture_default_str();
  verb->add_option("--frames", a.simulate.frames, "Frames that each camera films")->capture_default_str();
  verb->add_option("--rig", a.cameras, "virtual:N, so many cameras on an arc around the flame")
      ->capture_default_str();
  verb->add_option("--image", a.image, "Size of the pictures")->capture_default_str();
  verb->add_option("--cells", a.simulate.cells,
                   "Cells of the gas across, a multiple of 8; twice as many upwards")
      ->capture_default_str();
  verb->add_option("--rate", a.rate, "Frames a second")->capture_default_str();
  verb->add_option("--noise", a.simulate.read_noise, "Read noise, grey levels; 0: no noise at all")
      ->capture_default_str();
  verb->add_option("--threads", a.simulate.compute.threads, "CPU threads; 0: one per core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  verb->add_option("--seed", a.simulate.seed, "Seed of all random numbers")->capture_default_str();
  verb->callback([arguments] { simulate(*arguments); });
}

}  // namespace emberlock::cli
