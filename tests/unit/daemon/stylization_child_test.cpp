// SPDX-License-Identifier: Apache-2.0
// A stylization that a script stands in for: what the daemon asks of it, and what becomes of steps.
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "tests/support/reconstruction_child.h"

namespace emberlock::daemon {
namespace {

namespace fs = std::filesystem;
using test::ReconstructionChildTest;
using testing::HasSubstr;
using testing::Not;
using Stylizing = v1::ReconstructionStatus;

using ReconstructionChildThreads = ReconstructionChildTest;

TEST_F(ReconstructionChildThreads, AStylizationIsEditedWhileItRunsAndFinishedWhenAsked) {
  done_message();
  v1::ChildMessage first;
  first.mutable_iteration()->mutable_stylization()->add_views()->set_name("cam0");
  message("first", first);
  v1::ChildMessage answer;
  answer.mutable_edited()->mutable_taken()->set_steps(1);
  message("answer", answer);
  v1::EditRequest step;
  step.set_operation(R"({"op": "undo"})");
  const std::string bytes = std::to_string(session::framed(step).size());
  ReconstructionChild& child = with_script(
      "echo \"$@\" > $ROOT/words; while [ ! -e $ROOT/go ]; do sleep 0.02; done; cat $ROOT/first >&3; head "
      "-c " +
      bytes + " > $ROOT/step; cat $ROOT/answer >&3; cat > $ROOT/rest; cat $ROOT/done >&3");
  options_.unasked.set_budget_s(100);
  v1::ReconstructRequest wanted = request();
  wanted.set_frame(7);
  wanted.set_stylize(true);
  EXPECT_EQ(child.edit(step).error().kind, ErrorKind::refused) << "none runs";
  fs::create_directories(root_ / "results/candle/frame-7-stylized");
  ASSERT_TRUE(child.start(wanted).ok());
  const std::string words = wait_for_line("words");
  EXPECT_THAT(words, HasSubstr("stylize " + (root_ / "sessions/candle").string()));
  EXPECT_THAT(words, HasSubstr("/results/candle/frame-7-stylized-2 ")) << "another's is there";
  EXPECT_THAT(words, Not(HasSubstr("--budget")));
  EXPECT_THAT(child.edit(step).error().message(), HasSubstr("isn't reconstructed yet"));
  EXPECT_FALSE(child.finish().ok());
  std::ofstream(root_ / "go") << "go";
  EXPECT_TRUE(test::wait_until([&] { return child.status()->has_stylization(); }));
  const auto taken = child.edit(step);
  ASSERT_TRUE(taken.ok()) << taken.error().message();
  EXPECT_EQ(taken->steps(), 1U);
  EXPECT_EQ(test::bytes_of(root_ / "step"), session::framed(step));
  EXPECT_EQ(child.status()->state(), Stylizing::RUNNING);
  EXPECT_TRUE(child.finish().ok());
  EXPECT_EQ(end().state(), Stylizing::DONE);
  EXPECT_EQ(child.edit(step).error().kind, ErrorKind::refused);
}

TEST_F(ReconstructionChildThreads, WhatNoReplayCouldFollowIsNoStylization) {
  ReconstructionChild& child = with_script("echo x > $ROOT/begun");
  const auto refusal = [&](auto change) {
    v1::ReconstructRequest wrong = request();
    wrong.set_frame(1);
    wrong.set_stylize(true);
    change(wrong);
    const auto refused = child.start(wrong);
    return refused.ok() ? std::string() : refused.error().message();
  };
  using Request = v1::ReconstructRequest;
  EXPECT_THAT(refusal([](Request& r) { r.set_last_frame(3); }), HasSubstr("last_frame: one frame is edited"));
  EXPECT_THAT(refusal([](Request& r) { r.set_budget_s(3); }), HasSubstr("budget_s: can't be kept"));
  EXPECT_THAT(refusal([](Request& r) { r.set_errors(true); }), HasSubstr("stylize: is of colours alone"));
  EXPECT_THAT(refusal([](Request& r) { r.set_quantity("temperature"); }),
              HasSubstr("stylize: is of colours"));
  EXPECT_FALSE(fs::exists(root_ / "begun"));
}

}  // namespace
}  // namespace emberlock::daemon
