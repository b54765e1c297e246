// SPDX-License-Identifier: Apache-2.0
#include "tests/support/reconstruction_child.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>

#include "base/unique_fd.h"
#include "recon/calibrate/camera_response.h"
#include "recon/calibrate/rig.h"
#include "tests/support/recording.h"

namespace emberlock::daemon {
namespace {
namespace fs = std::filesystem;
using test::ReconstructionChildTest;
using testing::HasSubstr;
using testing::Not;
using State = v1::ReconstructionStatus;

using ReconstructionChildThreads = ReconstructionChildTest;

TEST_F(ReconstructionChildThreads, ShowsEveryIterationAndEndsWithTheResult) {
  done_message();
  v1::ChildMessage iteration;
  iteration.mutable_iteration()->mutable_iteration()->set_iteration(1);
  iteration.mutable_iteration()->set_rendered_jpeg("one");
  message("one", iteration);
  iteration.mutable_iteration()->mutable_iteration()->set_iteration(2);
  message("two", iteration);
  const auto status = end_of("echo \"$@\" > $ROOT/words; cat $ROOT/one $ROOT/two $ROOT/done >&3");
  EXPECT_EQ(status.state(), State::DONE) << status.error();
  EXPECT_EQ(status.result(), "there");
  EXPECT_EQ(status.iterations_size(), 2);
  EXPECT_GT(status.seconds(), 0);
  const auto shown = board_.iterations(0);
  ASSERT_EQ(shown.size(), 2U);
  EXPECT_EQ(shown[1]->reconstruction(), status.id());
  const std::string root = root_.path().string();
  EXPECT_EQ(wait_for_line("words"), "reconstruct " + root + "/sessions/candle --out " + root +
                                        "/results/candle/middle-frame --progress-fd 3");
}

TEST_F(ReconstructionChildThreads, WhatIsAskedReachesTheProgram) {
  options_.unasked.set_budget_s(100);
  options_.threads = 2;
  v1::ReconstructRequest wanted = request();
  wanted.set_frame(7);
  wanted.set_budget_s(2.5);
  wanted.set_voxels(64);
  wanted.add_hold_out(1);
  wanted.add_hold_out(3);
  wanted.set_device("cpu");
  ASSERT_TRUE(with_script("echo \"$@\" > $ROOT/words").start(wanted).ok());
  EXPECT_THAT(wait_for_line("words"),
              HasSubstr("/results/candle/frame-7 --progress-fd 3 --device cpu --frame 7 "
                        "--budget 2.5 --voxels 64 --hold-out 1,3 --threads 2"));
}

v1::SpectralResponse two_wavelengths() {
  v1::SpectralResponse response;
  for (const double nm : {500, 600}) {
    response.add_wavelength_nm(nm);
    response.add_r(nm / 100);
    response.add_g(1);
    response.add_b(7 - nm / 100);
  }
  response.set_absolute(true);
  return response;
}

TEST_F(ReconstructionChildThreads, TemperaturesAreAskedOfTheProgramWithTheResponseOnItsInput) {
  done_message();
  v1::ReconstructRequest asked = request();
  asked.set_quantity("temperature");
  asked.set_emitter("soot");
  asked.set_lines("sodium,c2");
  *asked.mutable_response() = two_wavelengths();
  ASSERT_TRUE(with_script("echo \"$@\" > $ROOT/words; cat /dev/stdin > $ROOT/response; cat $ROOT/done >&3")
                  .start(asked)
                  .ok());
  EXPECT_EQ(end().state(), State::DONE);
  EXPECT_THAT(test::bytes_of(root_ / "words"),
              HasSubstr("--quantity temperature --emitter soot --lines sodium,c2 --response /dev/stdin"));
  const auto read = recon::read_camera_response(root_ / "response");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(recon::message_of(*read).ShortDebugString(), two_wavelengths().ShortDebugString());
  asked = request();
  asked.set_errors(true);
  ASSERT_TRUE(child_->start(asked).ok());
  EXPECT_EQ(end().state(), State::DONE);
  EXPECT_THAT(test::bytes_of(root_ / "words"),
              testing::AllOf(HasSubstr("--errors"), Not(HasSubstr("stdin"))));
  EXPECT_EQ(test::bytes_of(root_ / "response"), "") << "nothing to read";
}

TEST_F(ReconstructionChildThreads, WhatNoTemperatureCanBeReadByIsRefused) {
  ReconstructionChild& child = with_script("echo x > $ROOT/begun");
  const auto refusal = [&](auto change) {
    v1::ReconstructRequest wrong = request();
    wrong.set_quantity("temperature");
    change(wrong);
    const auto refused = child.start(wrong);
    EXPECT_FALSE(refused.ok());
    if (refused) return std::string();
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
    return refused.error().message();
  };
  using Request = v1::ReconstructRequest;
  EXPECT_THAT(refusal([](Request& r) { r.set_quantity("pressure"); }), HasSubstr("colour or temperature"));
  EXPECT_THAT(refusal([](Request& r) { r.set_emitter("neon"); }), HasSubstr("grey, soot or paper"));
  EXPECT_THAT(refusal([](Request& r) { r.set_lines("neon"); }), HasSubstr("no known line emitter"));
  EXPECT_THAT(refusal([](Request& r) {
                r.set_quantity("colour");
                r.set_emitter("grey");
              }),
              HasSubstr("Give quantity temperature too"));
  EXPECT_THAT(refusal([](Request& r) {
                r.clear_quantity();
                *r.mutable_response() = two_wavelengths();
              }),
              HasSubstr("Give quantity temperature too"));
  EXPECT_THAT(refusal([](Request& r) {
                *r.mutable_response() = two_wavelengths();
                r.mutable_response()->add_r(1);
              }),
              HasSubstr("response"));
  EXPECT_THAT(refusal([](Request& r) {
                r.set_emitter("paper");
                r.set_lines("sodium");
              }),
              HasSubstr("green alone"));
  EXPECT_THAT(refusal([](Request& r) {
                *r.mutable_response() = two_wavelengths();
                r.set_lines("potassium");
              }),
              HasSubstr("doesn't see potassium"));
  EXPECT_FALSE(fs::exists(root_ / "begun"));
}

TEST_F(ReconstructionChildThreads, ACrashIsNamedWithItsLastWords) {
  const auto status = end_of("echo first; for i in 1 2 3 4 5 6; do echo line $i >&2; done; kill -SEGV $$");
  EXPECT_EQ(status.state(), State::FAILED);
  EXPECT_THAT(status.error(), HasSubstr("SIGSEGV"));
  EXPECT_THAT(status.error(), HasSubstr("line 5 / line 6"));
  EXPECT_THAT(status.error(), Not(HasSubstr("line 1")));
}

TEST_F(ReconstructionChildThreads, LastWordsInNoAlphabetAreStillASentence) {
  EXPECT_THAT(end_of("printf 'a\\377\\033[1mb' >&2; exit 1").error(), HasSubstr("a??[1mb"));
}

TEST_F(ReconstructionChildThreads, OneThatHangsIsKilled) {
  options_.silence = Seconds(0.2);
  const auto status = end_of("trap '' TERM; while :; do sleep 0.05; done");
  EXPECT_EQ(status.state(), State::FAILED);
  EXPECT_THAT(status.error(), HasSubstr("told nothing for 0.2 s"));
  EXPECT_TRUE(scripts_go_away());
}

TEST_F(ReconstructionChildThreads, OneThatTellsSomethingInTimeDoesNotHang) {
  options_.silence = Seconds(2);
  done_message();
  v1::ChildMessage progress;
  progress.mutable_progress()->set_doing("x");
  message("progress", progress);
  with_script("until [ -e $ROOT/enough ]; do cat $ROOT/progress >&3; done; cat $ROOT/done >&3");
  ASSERT_TRUE(child_->start(request()).ok());
  test::wait_until([&] { return child_->status()->seconds() > 1.5 * options_.silence.value(); });
  std::ofstream(root_ / "enough") << "enough";
  const auto status = end();
  EXPECT_EQ(status.state(), State::DONE) << status.error();
}

TEST_F(ReconstructionChildThreads, GarbageEndsIt) {
  const auto status = end_of("printf '\\004\\377\\377\\377\\377' >&3; sleep 100");
  EXPECT_EQ(status.state(), State::FAILED);
  EXPECT_THAT(status.error(), HasSubstr("can't be understood"));
}

TEST_F(ReconstructionChildThreads, AMessageTooLargeEndsIt) {
  EXPECT_THAT(end_of("printf '\\377\\377\\377\\177' >&3; cat /dev/zero >&3").error(), HasSubstr("over"));
}

TEST_F(ReconstructionChildThreads, ItsOwnWordsOfItsFailureAreTheError) {
  v1::ChildMessage failure;
  failure.mutable_failure()->set_message("candle: no box. Give --box");
  message("failure", failure);
  EXPECT_EQ(end_of("cat $ROOT/failure >&3; exit 2").error(), "candle: no box. Give --box");
}

TEST_F(ReconstructionChildThreads, OneThatClosesItsPipeAndLivesOnHangs) {
  options_.silence = Seconds(0.2);
  EXPECT_THAT(end_of("exec 3>&-; exec 2>&-; sleep 100").error(), HasSubstr("told nothing"));
  options_.silence = ReconstructionOptions().silence;
  EXPECT_THAT(end_of("exec 3>&-; exit 0").error(), HasSubstr("without a result"));
}

TEST_F(ReconstructionChildThreads, WhatItLeavesBehindIsKilledAndKeepsNobodyWaiting) {
  const auto status = end_of("sleep 100 & echo $! > $ROOT/pid; exit 1");
  EXPECT_EQ(status.state(), State::FAILED);
  EXPECT_TRUE(goes_away(wait_for_line("pid")));
}

TEST_F(ReconstructionChildThreads, CancelledItEndsAndTheNextCanStart) {
  ReconstructionChild& child = with_script("echo x > $ROOT/begun; exec sleep 100");
  EXPECT_EQ(child.cancel().error().kind, ErrorKind::refused);
  ASSERT_TRUE(child.start(request()).ok());
  wait_for_line("begun");
  const auto second = child.start(request());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_TRUE(child.cancel().ok());
  EXPECT_EQ(end().state(), State::CANCELLED);
  EXPECT_TRUE(child.start(request()).ok());
}

TEST_F(ReconstructionChildThreads, OneThatIgnoresTheCancelIsKilledAfterTheGrace) {
  options_.grace = Seconds(0.1);
  ReconstructionChild& child = with_script("trap '' TERM; echo $$ > $ROOT/pid; while :; do sleep 0.05; done");
  ASSERT_TRUE(child.start(request()).ok());
  const std::string pid = wait_for_line("pid");
  EXPECT_EQ(child.cancel()->doing(), "being cancelled");
  EXPECT_EQ(end().state(), State::CANCELLED);
  EXPECT_TRUE(goes_away(pid));
}

TEST_F(ReconstructionChildThreads, ItIsAJobThatAnybodyMayCancel) {
  ASSERT_TRUE(with_script("echo x > $ROOT/begun; exec sleep 100").start(request()).ok());
  wait_for_line("begun");
  const auto job = jobs_->find(v1::Job::RECONSTRUCT, "candle");
  ASSERT_TRUE(job);
  EXPECT_TRUE(jobs_->cancel(job->id()).ok());
  EXPECT_EQ(end().state(), State::CANCELLED);
}

TEST_F(ReconstructionChildThreads, EndKillsTheOneThatRuns) {
  ASSERT_TRUE(with_script("echo $$ > $ROOT/pid; exec sleep 100").start(request()).ok());
  const std::string pid = wait_for_line("pid");
  child_->end();
  EXPECT_TRUE(goes_away(pid));
  EXPECT_EQ(end().state(), State::CANCELLED);
}

TEST_F(ReconstructionChildThreads, ItHoldsNoneOfOurFilesAndLetsOthersGoFirst) {
  const UniqueFd ours(::open((root_ / "ours").c_str(), O_CREAT | O_RDONLY, 0600));  // not closed on exec
  // The parent raises it when it has started it.
  end_of("until [ $(nice) -ge 10 ]; do :; done; ls -l /proc/$$/fd > $ROOT/held; nice > $ROOT/nice");
  const std::string held = test::bytes_of(root_ / "held");
  EXPECT_THAT(held, HasSubstr("/dev/null"));
  EXPECT_THAT(held, Not(HasSubstr("/ours")));
  EXPECT_GE(std::stoi(wait_for_line("nice")), 10);
}

TEST_F(ReconstructionChildThreads, AProgramThatIsNotThereIsNamed) {
  with_script("");
  fs::remove(root_ / "program");
  ASSERT_TRUE(child_->start(request()).ok());
  EXPECT_THAT(end().error(), HasSubstr(options_.program.string()));
}

TEST_F(ReconstructionChildThreads, SessionsOutsideTheFolderAndValuesOutOfRangeAreRefused) {
  fs::create_directories(root_ / "elsewhere");
  std::ofstream(root_ / "elsewhere/manifest.json") << "{}";
  ReconstructionChild& child = with_script("echo x > $ROOT/begun");
  for (const char* name :
       {"", ".", "..", "../elsewhere", "candle/../../elsewhere", "/etc", "absent", "a\nb"}) {
    const auto refused = child.start(request(name));
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  }
  v1::ReconstructRequest wrong = request();
  wrong.set_voxels(5000);
  EXPECT_THAT(child.start(wrong).error().message(), HasSubstr("voxels"));
  wrong = request();
  wrong.set_device("--help");
  EXPECT_THAT(child.start(wrong).error().message(), HasSubstr("cuda"));
  wrong = request();
  wrong.set_budget_s(-1);
  EXPECT_THAT(child.start(wrong).error().message(), HasSubstr("budget_s"));
  EXPECT_FALSE(child.status().has_value());
  EXPECT_FALSE(fs::exists(root_ / "begun"));
}

v1::ReconstructRequest range(std::uint64_t first, std::uint64_t last, std::uint32_t every = 0) {
  v1::ReconstructRequest request;
  request.set_session("candle");
  request.set_frame(first);
  request.set_last_frame(last);
  request.set_every(every);
  return request;
}

TEST_F(ReconstructionChildThreads, ASequenceIsOneJobOfAChildForEachFrame) {
  done_message();
  v1::ChildMessage kept;
  test::fill(*kept.mutable_iteration()->mutable_volume(), 1, 1, 1, "v");
  kept.mutable_iteration()->mutable_iteration()->set_input_rmse(4.5);
  message("kept", kept);
  // Frame 9 fails.
  ASSERT_TRUE(with_script("echo \"$@\" >> $ROOT/words; case \"$*\" in *'--frame 9'*) kill -SEGV $$;; esac; "
                          "cat $ROOT/kept $ROOT/done >&3")
                  .start(range(7, 12, 2))
                  .ok());
  const auto status = end();
  EXPECT_EQ(status.state(), State::FAILED);
  EXPECT_THAT(status.error(), HasSubstr("1 of 3 frames failed: 9. The others are in"));
  EXPECT_THAT(status.error(), HasSubstr("SIGSEGV"));
  EXPECT_EQ(status.result(), root_ / "results/candle");
  ASSERT_EQ(status.frames_size(), 3);
  EXPECT_EQ(status.frames(2).state(), State::DONE);
  EXPECT_EQ(status.frames(2).input_rmse(), 4.5);
  const std::string words = test::bytes_of(root_ / "words");
  for (const char* frame : {"frame-7 --progress-fd 3 --frame 7", "frame-9 ", "frame-11 "})
    EXPECT_THAT(words, HasSubstr(frame));
  v1::FrameRequest wanted;
  wanted.set_reconstruction(status.id());
  wanted.set_frame(11);
  ASSERT_TRUE(child_->frame(wanted));
  EXPECT_EQ(child_->frame(wanted)->volume().voxels(), "v");
  wanted.set_frame(9);
  EXPECT_FALSE(child_->frame(wanted)) << "it failed";
  EXPECT_TRUE(jobs_->list().empty());
}

TEST_F(ReconstructionChildThreads, ASequenceThatIsCancelledKeepsWhatIsDone) {
  done_message();
  ReconstructionChild& child = with_script(
      "case \"$*\" in *'--frame 1'*) echo x > $ROOT/begun; exec sleep 100;; esac; cat $ROOT/done >&3");
  ASSERT_TRUE(child.start(range(0, 3)).ok());
  wait_for_line("begun");
  EXPECT_EQ(child.status()->doing(), "frame 1 (2 of 4): starting");
  EXPECT_EQ(child.status()->fraction(), 0.25);
  EXPECT_TRUE(child.cancel().ok());
  const auto status = end();
  EXPECT_EQ(status.state(), State::CANCELLED);
  EXPECT_EQ(status.doing(), "cancelled, with 1 of 4 frames done");
  EXPECT_EQ(status.frames(2).state(), State::STATE_UNSPECIFIED);
}

TEST_F(ReconstructionChildThreads, ASequenceThatHasNoSuchFramesIsRefused) {
  ReconstructionChild& child = with_script("echo x > $ROOT/begun");
  v1::ReconstructRequest without_first = range(0, 3);
  without_first.clear_frame();
  v1::ReconstructRequest every_alone = range(3, 3, 2);
  every_alone.clear_last_frame();
  for (const auto& [wanted, words] : std::vector<std::pair<v1::ReconstructRequest, std::string>>{
           {without_first, "last_frame: a sequence has a first frame too. Give frame"},
           {every_alone, "every: is for sequences. Give last_frame too"},
           {range(3, 2), "last_frame: 2 lies before the first frame, 3"},
           {range(3, 40), "last_frame: there is no frame 40: the session has 40. Choose among 0 to 39"}}) {
    EXPECT_THAT(child.check(wanted).error().message(), HasSubstr(words));
    EXPECT_THAT(child.start(wanted).error().message(), HasSubstr(words));
  }
  EXPECT_FALSE(child.status().has_value());
  EXPECT_FALSE(fs::exists(root_ / "begun"));
}

}  // namespace
}  // namespace emberlock::daemon
