// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "cli/shell_word.h"
#include "recon/calibrate/board.h"
#include "rig/sample/sample.h"

namespace emberlock::cli {
namespace {

struct SampleArguments {
  rig::SampleOptions sample;
  std::string folder;
  std::string image = "480x360";
};

/// What there is, and the commands that turn it into a volume.
void print_next(const rig::Sample& sample, const std::string& path) {
  const std::string folder = shell_word(path);
  const std::string strobe = fmt::format("--flash-rate {} --comb {}/comb/camera-0.mp4 --comb-rate {}",
                                         sample.flash_rate.value(), folder, sample.comb_rate.value());
  std::printf("%s",
              fmt::format("{0}/films       {1} cameras filmed a strobe, then a flame\n"
                          "{0}/comb        one of them under {2} flashes per second\n"
                          "{0}/board       pictures of a chessboard\n"
                          "{0}/truth.json  offsets, times, lenses and poses\n\n"
                          "next   emberlock verify {0}/films/*.mp4 {3} --out sync\n"
                          "then   emberlock calibrate cameras {0}/board --board {4} --world {5} --out rig\n"
                          "then   emberlock import {0}/films {3} --rig rig/rig.json --out take\n"
                          "then   emberlock reconstruct take --hold-out {6} --out result\n",
                          folder, sample.cameras.size(), sample.comb_rate.value(), strobe,
                          recon::board_words(sample.board), sample.world, sample.cameras.size() / 2)
                  .c_str());
}

void sample(SampleArguments arguments) {
  arguments.sample.image = or_fail(parse_image_size(arguments.image));
  OutputFolder folder = or_fail(OutputFolder::create({arguments.folder, kSample}));
  const Progress bar = progress_bar("sample");
  const Interrupt interrupt;
  const auto observer = [&](double fraction, std::string_view what) {
    tell(bar, fraction, what);
    return !Interrupt::asked();
  };
  const rig::Sample made = or_fail(rig::make_sample(arguments.sample, folder.path(), observer));
  or_fail(folder.commit());
  tell(bar, 1, "done");
  print_next(made, arguments.folder);
}

}  // namespace

void add_sample(const Verb& app) {
  auto arguments = std::make_shared<SampleArguments>();
  const Verb verb = app.add_verb(
      "sample",
      "Makes small films to learn with, by simulation: a strobe and a flame, a comb, a calibration board, "
      "and the truth about them; prints what to do with them");
  SampleArguments& a = *arguments;
  verb.add_option("folder", a.folder, "Folder for films/, comb/, board/ and truth.json").require();
  verb.add_option("--cameras", a.sample.cameras, "Number of cameras, 3 to 10").show_default();
  verb.add_option("--image", a.image, "Size of the pictures").show_default();
  verb.add_option("--frames", a.sample.flame_frames, "Frames that each camera films of the flame")
      .show_default();
  verb.add_option("--seed", a.sample.seed, "Seed of all random numbers").show_default();
  verb.set_action([arguments] { sample(*arguments); });
}

}  // namespace emberlock::cli
