// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/loan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/hosts/lent_frame.h"

namespace emberlock::daemon {
namespace {

using ::testing::HasSubstr;

const Borrower kDome{"dome at lab-1", "certificate 1"};
const Borrower kOther{"arc at lab-9", "certificate 9"};
TimePoint at(double s) { return {static_cast<std::int64_t>(s * 1e9)}; }

Frame frame(std::uint64_t id, double t, PixelFormat format = PixelFormat::gray8, int depth = 8) {
  auto image = std::make_shared<Image>(ImageLayout{{4, 2}, format, depth});
  for (std::size_t i = 0; i < image->bytes().size(); ++i) image->bytes()[i] = static_cast<std::byte>(i + id);
  return {{.frame_id = id, .device_time = {7}, .system_time = {8}, .monotonic_time = at(t)},
          std::move(image)};
}

TEST(Loan, IsOneLeadersUntilNothingIsHeardOfItForAWhile) {
  Loan loan(1);
  EXPECT_EQ(loan.leader(at(1)), "");
  ASSERT_TRUE(loan.take(kDome, at(1)).ok());
  EXPECT_EQ(loan.leader(at(5.9)), kDome.name);
  const Status refused = loan.take(kOther, at(5.9));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().what, HasSubstr(kDome.name));
  EXPECT_TRUE(loan.hear(kDome, at(5.9)).value());
  EXPECT_EQ(loan.leader(at(10.8)), kDome.name);
  EXPECT_EQ(loan.leader(at(11)), "");
  EXPECT_TRUE(loan.take(kOther, at(11)).ok());
  EXPECT_EQ(loan.leader(at(11)), kOther.name);
}

TEST(Loan, WhoIsntTheLeaderIsntHeard) {
  Loan loan(1);
  EXPECT_FALSE(loan.hear(kDome, at(1)).value());
  EXPECT_EQ(loan.leader(at(1)), "");
  ASSERT_TRUE(loan.take(kDome, at(1)).ok());
  EXPECT_FALSE(loan.hear(kOther, at(5)).value());
  EXPECT_EQ(loan.leader(at(7)), "");
  EXPECT_EQ(loan.take({"", "certificate"}, at(8)).error().kind, ErrorKind::bad_input);
}

/// All pairs of who has the cameras and who comes, at times before and after the loan lapses: it goes to
/// another certificate only once it has lapsed, whatever name that one gives.
TEST(Loan, BelongsToACertificateAndNotToAName) {
  const std::vector<Borrower> hosts{
      kDome, {kDome.name, "certificate 2"}, {kOther.name, "certificate 1"}, kOther};
  for (const Borrower& has : hosts)
    for (const Borrower& comes : hosts)
      for (const bool records : {false, true})
        for (const double t : {2.0, 30.0}) {
          Loan loan(1);
          ASSERT_TRUE(loan.take(has, at(1)).ok());
          loan.hold(records);
          const bool lapsed = t > 6 && !records;
          const std::string row = has.certificate + ", " + comes.name + " by " + comes.certificate;
          const bool twin = has.name == comes.name && !(has == comes);
          const auto heard = loan.hear(comes, at(t));
          EXPECT_EQ(heard.ok(), lapsed || !twin) << row;
          if (heard.ok()) {
            EXPECT_EQ(*heard, has == comes && !lapsed) << row;
          }
          const Status taken = loan.take(comes, at(t));
          EXPECT_EQ(taken.ok(), lapsed || has == comes) << row;
          if (!taken.ok() && twin) {
            EXPECT_THAT(taken.error().message(), HasSubstr("[rig]")) << row;
          }
        }
}

TEST(Loan, WhileItRecordsItDoesntLapse) {
  Loan loan(1);
  ASSERT_TRUE(loan.take(kDome, at(1)).ok());
  loan.hold(true);
  EXPECT_EQ(loan.leader(at(500)), kDome.name);
  EXPECT_FALSE(loan.take(kOther, at(500)).ok());
  EXPECT_TRUE(loan.take(kDome, at(501)).ok()) << "it comes back";
  loan.hold(false);
  EXPECT_EQ(loan.leader(at(507)), "");
}

TEST(Loan, AWatcherGetsTheNewestFramesAndTheRestIsNobodys) {
  Loan loan(2);
  loan.offer(0, frame(1, 1), {}, Seconds(0));  // nobody watches
  const auto frames = loan.watch(0);
  for (std::uint64_t id = 2; id < 20; ++id) loan.offer(0, frame(id, static_cast<double>(id)), {}, Seconds(0));
  loan.offer(1, frame(99, 99), {}, Seconds(0));
  for (std::uint64_t id = 12; id < 20; ++id) {
    const auto next = frames->next(Seconds(0));
    ASSERT_TRUE(next.ok() && *next);
    EXPECT_EQ((*next)->frame_id(), id);
  }
  const auto none = frames->next(Seconds(0));
  EXPECT_TRUE(none.ok() && !*none);
}

TEST(Loan, WhileItRecordsFewFramesLeave) {
  Loan loan(1);
  const auto frames = loan.watch(0);
  for (int i = 0; i < 24; ++i)
    loan.offer(0, frame(static_cast<std::uint64_t>(i), 1 + i / 24.0), {}, milliseconds(500));
  int sent = 0;
  while (true) {
    const auto next = frames->next(Seconds(0));
    ASSERT_TRUE(next.ok());
    if (!*next) break;
    ++sent;
  }
  EXPECT_EQ(sent, 2);
}

TEST(Loan, ACamerasErrorAndANewerWatcherEndAWatch) {
  Loan loan(1);
  const auto frames = loan.watch(0);
  loan.fail(0, {ErrorKind::device, "it was unplugged"});
  EXPECT_EQ(frames->next(Seconds(0)).error().what, "it was unplugged");
  const auto first = loan.watch(0);
  const auto second = loan.watch(0);
  EXPECT_EQ(first->next(Seconds(0)).error().kind, ErrorKind::refused);
  loan.offer(0, frame(5, 5), {}, Seconds(0));
  EXPECT_TRUE(second->next(Seconds(0))->has_value());
}

TEST(LentFrame, ComesAsItWent) {
  for (const auto& [format, depth] : {std::pair(PixelFormat::gray8, 8), std::pair(PixelFormat::rgb16, 12),
                                      std::pair(PixelFormat::bayer_rggb8, 8)}) {
    const Frame sent = frame(3, 2.5, format, depth);
    const drivers::FrameCounts counts{.delivered = 4,
                                      .damaged = 1,
                                      .camera_gap = 2,
                                      .transport = 3,
                                      .resend = 5,
                                      .underrun = 6,
                                      .queue = 7,
                                      .passed_over = 8};
    const v1::LentFrame lent = to_proto(sent, counts);
    const auto came = frame_of(lent, "camera");
    ASSERT_TRUE(came.ok()) << came.error().message();
    EXPECT_EQ(came->stamp, sent.stamp);
    EXPECT_EQ(*came->image, *sent.image);
    EXPECT_EQ(counts_of(lent.counts()), counts);
  }
}

TEST(LentFrame, AForeignOneIsAnError) {
  v1::LentFrame lent = to_proto(frame(1, 1), {});
  lent.set_pixels("too short");
  EXPECT_THAT(frame_of(lent, "camera a at b").error().message(), HasSubstr("camera a at b"));
  lent = to_proto(frame(1, 1), {});
  lent.set_width(1U << 31);
  EXPECT_EQ(frame_of(lent, "x").error().kind, ErrorKind::bad_input);
  lent.set_width(4);
  lent.clear_format();
  EXPECT_EQ(frame_of(lent, "x").error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::daemon
