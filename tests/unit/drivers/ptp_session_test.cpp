// SPDX-License-Identifier: Apache-2.0
// A session against a camera of tests/support/chdk_responder, in process and in virtual time.
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/ptp/session.h"
#include "tests/support/chdk_responder/bench.h"

namespace emberlock::drivers {
namespace {

using chdk_responder::Bench;
using chdk_responder::FakeTransport;
using chdk_responder::Faults;
using chdk_responder::OpenBench;
using testing::HasSubstr;

std::vector<std::byte> object(Bench& bench, std::uint32_t handle, std::uint32_t bytes) {
  std::vector<std::byte> content;
  const Status got = bench.session.object(
      handle, bytes,
      [&](std::span<const std::byte> piece) {
        content.insert(content.end(), piece.begin(), piece.end());
        return Status();
      },
      Seconds(5));
  EXPECT_TRUE(got.ok()) << got.error().message();
  return content;
}

TEST(PtpSessionThreads, ACameraSaysWhatItIs) {
  OpenBench bench;
  const auto info = bench.session.device_info();
  ASSERT_TRUE(info.ok()) << info.error().message();
  EXPECT_EQ(info->vendor_extension, 0x0bu);
  EXPECT_EQ(info->manufacturer, "Canon Inc.");
  EXPECT_EQ(info->model, "Canon PowerShot E1");
  EXPECT_EQ(info->serial, "EMBER0001");
  EXPECT_THAT(info->operations, testing::Contains(0x9999));
}

TEST(PtpSessionThreads, FilesOfEverySizeAroundAPacketComeAsTheyAre) {
  for (const bool empty_packets : {true, false}) {
    Bench bench;
    bench.device().faults.no_empty_packet = empty_packets ? 0 : -1;
    ASSERT_TRUE(bench.session.open().ok());
    // With the header of 12 bytes: below, at and above one, two and 512 packets.
    for (const std::uint32_t bytes :
         {1u, 499u, 500u, 501u, 1011u, 1012u, 1013u, 262131u, 262132u, 262133u, 600000u}) {
      const std::uint32_t handle = bench.device().add_object({"A.AVI", 0x300a, bytes, 0});
      EXPECT_EQ(object(bench, handle, bytes), bench.device().content(handle, 0, bytes)) << bytes;
    }
    EXPECT_EQ(bench.cable->recoveries, 0);
  }
}

TEST(PtpSessionThreads, AHeaderInATransferOfItsOwnIsAllowed) {
  OpenBench bench;
  bench.device().faults.header_alone = -1;
  const std::uint32_t handle = bench.device().add_object({"A.AVI", 0x300a, 3000, 0});
  EXPECT_EQ(object(bench, handle, 3000), bench.device().content(handle, 0, 3000));
}

TEST(PtpSessionThreads, ASessionLeftOpenByAProgramThatDiedIsClosedFirst) {
  Bench bench;
  {
    FakeTransport dead(bench.cable);
    (void)dead.send(encode(PtpMessage{PtpType::command, 0x1002, 0, {1}}), Seconds(1));
    (void)dead.receive(512, Seconds(1));
  }
  ASSERT_TRUE(bench.session.open().ok());
  EXPECT_TRUE(bench.session.storages().ok());
}

TEST(PtpSessionThreads, APartOfAFileComesFromItsOffset) {
  OpenBench bench;
  const std::uint32_t handle = bench.device().add_object({"A.AVI", 0x300a, 10'000, 0});
  std::vector<std::byte> content;
  const auto came = bench.session.partial_object(
      handle, 9'000, 5'000,
      [&](std::span<const std::byte> piece) {
        content.insert(content.end(), piece.begin(), piece.end());
        return Status();
      },
      Seconds(1));
  EXPECT_EQ(came.value(), 1000u);
  EXPECT_EQ(content, bench.device().content(handle, 9'000, 1000));
}

TEST(PtpSessionThreads, ABusyCameraIsAskedAgain) {
  OpenBench bench;
  bench.device().faults.busy = 5;
  EXPECT_TRUE(bench.session.storages().ok());
  bench.device().faults.busy = -1;
  const auto refused = bench.session.storages();
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("device busy (0x2019)"));
  EXPECT_THAT(refused.error().message(), HasSubstr("camera E1"));
}

TEST(PtpSessionThreads, ARefusalIsToldInWordsAndTheSessionGoesOn) {
  OpenBench bench;
  const auto info = bench.session.object_info(99);
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().message(), "camera E1: it refuses GetObjectInfo: invalid object handle (0x2009)");
  EXPECT_TRUE(bench.session.storages().ok());
  EXPECT_EQ(bench.cable->recoveries, 0);
}

TEST(PtpSessionThreads, AHangingCameraIsGivenUpAtTheDeadlineAndRecoveredByTheNextQuestion) {
  OpenBench bench;
  bench.device().faults.hang = 1;
  const Seconds before = bench.elapsed();
  const auto silent = bench.session.storages();
  ASSERT_FALSE(silent.ok());
  EXPECT_EQ(silent.error().kind, ErrorKind::timed_out);
  EXPECT_NEAR((bench.elapsed() - before).value(), kPtpDeadline.value(), 1e-6);
  EXPECT_TRUE(bench.session.storages().ok());
  EXPECT_EQ(bench.cable->recoveries, 1);
}

TEST(PtpSessionThreads, ACameraThatHangsForGoodIsLeftInBoundedTime) {
  OpenBench bench;
  bench.device().faults.hang = -1;
  const Seconds before = bench.elapsed();
  bench.session.close();
  EXPECT_LE((bench.elapsed() - before).value(), 1.0 + 1e-6);
}

TEST(PtpSessionThreads, ALateAnswerMayBeWaitedForInParts) {
  OpenBench bench;
  bench.device().faults.latency = milliseconds(95);
  ASSERT_TRUE(bench.session.begin({0x1004}).ok());
  int waits = 0;
  auto answer = bench.session.finish(milliseconds(10));
  while (!answer.ok() && answer.error().kind == ErrorKind::timed_out && ++waits < 100) {
    answer = bench.session.finish(milliseconds(10));
  }
  ASSERT_TRUE(answer.ok()) << answer.error().message();
  EXPECT_EQ(waits, 9);
  EXPECT_EQ(bench.cable->recoveries, 0);
}

// Each of these answers is refused with an error, and the camera is well again afterwards.
struct MalformedAnswer {
  const char* name;
  int Faults::*fault;
  const char* words;
};
class PtpSessionMalformedThreads : public testing::TestWithParam<MalformedAnswer> {};
INSTANTIATE_TEST_SUITE_P(
    Answers, PtpSessionMalformedThreads,
    testing::Values(MalformedAnswer{"WrongTransaction", &Faults::wrong_transaction, "transaction"},
                    MalformedAnswer{"MoreAnnouncedThanComes", &Faults::long_length, "too soon"},
                    MalformedAnswer{"LessAnnouncedThanComes", &Faults::short_length, "more data"},
                    MalformedAnswer{"Garbage", &Faults::garbage, ""},
                    MalformedAnswer{"Stall", &Faults::stall, ""}),
    [](const auto& shown) { return shown.param.name; });

TEST_P(PtpSessionMalformedThreads, IsAnErrorAndTheNextQuestionIsAnswered) {
  OpenBench bench;
  const std::uint32_t handle = bench.device().add_object({"A.AVI", 0x300a, 5000, 0});
  bench.device().faults.*GetParam().fault = 1;
  const auto info = bench.session.object_info(handle);
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().kind, ErrorKind::device);
  EXPECT_THAT(info.error().message(), HasSubstr(GetParam().words));
  EXPECT_LE(bench.elapsed().value(), 1.0);
  EXPECT_EQ(object(bench, handle, 5000), bench.device().content(handle, 0, 5000));
  EXPECT_EQ(bench.cable->recoveries, 1);
}

TEST_P(PtpSessionMalformedThreads, ForEverEndsInAnErrorEachTime) {
  Bench bench;
  bench.device().faults.*GetParam().fault = -1;
  (void)bench.session.open();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(bench.session.device_info().ok());
}

TEST(PtpSessionThreads, AnUnpluggedCameraIsAnErrorAtOnce) {
  OpenBench bench;
  bench.cable->plugged = false;
  const auto gone = bench.session.storages();
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().kind, ErrorKind::device);
  bench.session.close();
}

TEST(PtpSessionThreads, DataBeyondWhatWasAskedForAreRefusedBeforeTheyAreRead) {
  OpenBench bench;
  const std::uint32_t handle = bench.device().add_object({"A.AVI", 0x300a, 5000, 0});
  EXPECT_FALSE(bench.session.transact({0x1009, {handle}, {}, {}, 4999}).ok());
  EXPECT_TRUE(bench.session.transact({0x1009, {handle}, {}, {}, 5000}).ok());
}

}  // namespace
}  // namespace emberlock::drivers
