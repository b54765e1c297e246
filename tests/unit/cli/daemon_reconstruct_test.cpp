// SPDX-License-Identifier: Apache-2.0
// The verbs that ask emberlockd to reconstruct.
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "tests/support/daemon_verbs.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using test::status_in;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

using DaemonReconstructVerbs = test::VerbsOfADaemon;

v1::DaemonStatus reconstructing(v1::ReconstructionStatus::State state, int iterations) {
  v1::DaemonStatus status = status_in(v1::IDLE);
  v1::ReconstructionStatus& reconstruction = *status.mutable_reconstruction();
  reconstruction.set_id("candle 1");
  reconstruction.set_session("candle");
  reconstruction.set_state(state);
  for (int i = 1; i <= iterations; ++i) {
    v1::Iteration& iteration = *reconstruction.add_iterations();
    iteration.set_iteration(static_cast<std::uint32_t>(i));
    iteration.set_seconds(i);
  }
  if (state == v1::ReconstructionStatus::DONE) reconstruction.set_result("/results/candle");
  if (state == v1::ReconstructionStatus::FAILED)
    reconstruction.set_error("it crashed by SIGSEGV. Try device cpu");
  return status;
}

TEST_F(DaemonReconstructVerbs, ReconstructShowsEveryIterationAndTheResult) {
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    show_in_turn(reconstructing(v1::ReconstructionStatus::RUNNING, 1),
                 {{"iteration 1:", reconstructing(v1::ReconstructionStatus::RUNNING, 3)},
                  {"iteration 3:", reconstructing(v1::ReconstructionStatus::DONE, 4)}});
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--voxels", "64", "--hold-out", "1,3"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* line : {"iteration 1:", "iteration 2:", "iteration 3:", "iteration 4:", "/results/candle"})
    EXPECT_THAT(result.out, HasSubstr(line));
  EXPECT_THAT(api_.calls(),
              ElementsAre("reconstruct session: \"candle\" voxels: 64 hold_out: 1 hold_out: 3"));
}

TEST_F(DaemonReconstructVerbs, ReconstructAsksForTemperaturesWithTheResponseItself) {
  const test::TempFolder folder;
  std::ofstream(folder / "response.json")
      << R"({"unit": "relative", "wavelength_nm": [500, 600], "r": [0, 1], "g": [1, 0], "b": [0, 0]})";
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    v1::DaemonStatus done = reconstructing(v1::ReconstructionStatus::DONE, 1);
    done.mutable_reconstruction()->add_temperature("1650 K on average");
    api_.board().show(done);
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const std::string file = (folder / "response.json").string();
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--quantity", "temperature", "--emitter", "soot",
                            "--lines", "auto", "--response", file});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1650 K on average"));
  EXPECT_THAT(api_.calls(),
              ElementsAre(AllOf(HasSubstr("quantity: \"temperature\""), HasSubstr("wavelength_nm: 600"),
                                HasSubstr("emitter: \"soot\""), HasSubstr("lines: \"auto\""))));
  EXPECT_EQ(run(add_reconstruct, {"reconstruct", "candle", "--errors"}).exit_code, 0);
  EXPECT_THAT(api_.calls().back(), HasSubstr("errors: true"));
  const test::VerbRun refused = run(add_reconstruct, {"reconstruct", "candle", "--quantity", "temperature",
                                                      "--response", (folder / "no.json").string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("no.json"));
  EXPECT_EQ(api_.calls().size(), 2U) << "the daemon isn't asked";
}

TEST_F(DaemonReconstructVerbs, ASequenceIsToldFrameByFrame) {
  using State = v1::ReconstructionStatus;
  const auto at = [](State::State whole, std::initializer_list<State::State> frames) {
    v1::DaemonStatus status = reconstructing(whole, 2);
    std::uint64_t number = 10;
    for (const State::State state : frames) {
      v1::SequenceFrame& frame = *status.mutable_reconstruction()->add_frames();
      frame.set_frame(number += 2);
      frame.set_state(state);
      frame.set_input_rmse(4.5);
      if (state == State::FAILED) frame.set_error("No light.");
    }
    return status;
  };
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    show_in_turn(at(State::RUNNING, {State::DONE, State::RUNNING, State::STATE_UNSPECIFIED}),
                 {{"1 of 3", at(State::FAILED, {State::DONE, State::FAILED, State::DONE})}});
    return Result<v1::ReconstructionStatus>(at(State::RUNNING, {}).reconstruction());
  };
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--frame", "12", "--last-frame", "16", "--every", "2"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out,
            "1 of 3: frame 12: done, input error 4.50 grey levels\n"
            "2 of 3: frame 14: failed. No light.\n"
            "3 of 3: frame 16: done, input error 4.50 grey levels\n");
  EXPECT_THAT(api_.calls(), ElementsAre("reconstruct session: \"candle\" frame: 12 last_frame: 16 every: 2"));
  EXPECT_THAT(run(add_status, {"status"}).out, HasSubstr("candle: failed"));
}

TEST_F(DaemonReconstructVerbs, AReconstructionThatFailedSaysWhy) {
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    api_.board().show(reconstructing(v1::ReconstructionStatus::FAILED, 1));
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const test::VerbRun result = run(add_reconstruct, {"reconstruct", "candle", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("SIGSEGV"));
}

}  // namespace
}  // namespace emberlock::cli
