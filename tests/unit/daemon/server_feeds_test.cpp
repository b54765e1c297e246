// SPDX-License-Identifier: Apache-2.0
// What a watcher is told next, on a clock that the test moves.
#include <gmock/gmock.h>

#include "daemon/server/feeds.h"

namespace emberlock::daemon {
namespace {

constexpr TimePoint kStart{1'000'000'000};

v1::DaemonStatus status_with(int rounds, std::uint32_t from = 1) {
  v1::DaemonStatus status;
  for (int i = 0; i < rounds; ++i)
    status.mutable_alignment()->add_history()->set_round(from + static_cast<std::uint32_t>(i));
  return status;
}

void show_picture(Board& board, const std::string& camera, std::uint64_t frame) {
  auto picture = std::make_shared<v1::Picture>();
  picture->set_camera_id(camera);
  picture->set_frame_id(frame);
  board.show(std::shared_ptr<const v1::Picture>(picture));
}

void show_iteration(Board& board, const std::string& reconstruction, std::uint32_t iteration,
                    std::uint64_t frame = 0) {
  auto preview = std::make_shared<v1::IterationPreview>();
  preview->set_reconstruction(reconstruction);
  preview->set_frame(frame);
  preview->mutable_iteration()->set_iteration(iteration);
  board.show(std::shared_ptr<const v1::IterationPreview>(preview));
}

TEST(ServerFeeds, AStatusIsToldAtOnceThenTenTimesASecondTheNewestAlone) {
  Board board;
  StatusFeed feed(board);
  EXPECT_EQ(feed.next(kStart).message->revision(), 0U);
  EXPECT_FALSE(feed.next(kStart + Seconds(1)).message) << "nothing changed";
  board.show(status_with(0));
  EXPECT_EQ(feed.next(kStart + Seconds(1)).message->revision(), 1U);
  board.show(status_with(0));
  board.show(status_with(0));
  const auto early = feed.next(kStart + Seconds(1.05));
  EXPECT_FALSE(early.message);
  EXPECT_EQ(early.again, kStart + Seconds(1) + StatusFeed::kApart);
  EXPECT_EQ(feed.next(*early.again).message->revision(), 3U);
}

TEST(ServerFeeds, AHistoryIsToldWhenARoundIsAddedOrAnAlignmentBegins) {
  Board board;
  HistoryFeed feed(board);
  EXPECT_FALSE(feed.next(kStart).message) << "there is none";
  board.show(status_with(3));
  EXPECT_EQ(feed.next(kStart).message->alignment().history_size(), 3);
  board.show(status_with(3));
  EXPECT_FALSE(feed.next(kStart).message) << "of rounds nothing changed";
  board.show(status_with(3, 2));
  EXPECT_TRUE(feed.next(kStart).message) << "the oldest went as one was added";
  board.show(status_with(0));
  EXPECT_EQ(feed.next(kStart).message->alignment().history_size(), 0);
}

TEST(ServerFeeds, WithoutItsHistoryAStatusIsTheSame) {
  v1::DaemonStatus status = status_with(3);
  status.mutable_alignment()->set_round(3);
  const v1::DaemonStatus brief = without_history(status);
  EXPECT_EQ(brief.alignment().history_size(), 0);
  EXPECT_EQ(brief.alignment().round(), 3U);
  EXPECT_FALSE(without_history({}).has_alignment());
}

TEST(ServerFeeds, EveryNoticeAfterTheOneNamedIsToldInOrder) {
  Board board;
  for (const char* text : {"One.", "Two.", "Three."}) board.notice(v1::GREEN, text);
  NoticeFeed feed(board, 1);
  EXPECT_EQ(feed.next(kStart).message->text(), "Two.");
  board.notice(v1::GREEN, "Four.");
  EXPECT_EQ(feed.next(kStart).message->text(), "Three.");
  EXPECT_EQ(feed.next(kStart).message->text(), "Four.");
  EXPECT_FALSE(feed.next(kStart).message);
}

TEST(ServerFeeds, PicturesAreWantedWhileTheirFeedLives) {
  Board board;
  {
    const PictureFeed feed(board, {});
    EXPECT_TRUE(board.pictures_wanted());
  }
  EXPECT_FALSE(board.pictures_wanted());
}

TEST(ServerFeeds, OfTheWantedCamerasTheOneServedLongestAgoComesFirst) {
  Board board;
  v1::WatchPicturesRequest request;
  for (const char* camera : {"a", "b"}) request.add_camera_ids(camera);
  PictureFeed feed(board, request);
  for (const char* camera : {"a", "b", "c"}) show_picture(board, camera, 1);
  const std::string first = feed.next(kStart).message->camera_id();
  const std::string second = feed.next(kStart + Seconds(0.01)).message->camera_id();
  EXPECT_THAT((std::set{first, second}), testing::ElementsAre("a", "b"));
  EXPECT_FALSE(feed.next(kStart + Seconds(1)).message) << "c isn't wanted";
  for (const char* camera : {"a", "b"}) show_picture(board, camera, 2);
  EXPECT_EQ(feed.next(kStart + Seconds(1)).message->camera_id(), first);
  EXPECT_EQ(feed.next(kStart + Seconds(1)).message->camera_id(), second);
}

TEST(ServerFeeds, ACamerasPicturesComeAtTheWantedRateOnAverage) {
  Board board;
  v1::WatchPicturesRequest request;
  request.set_rate_hz(10);
  PictureFeed feed(board, request);
  int told = 0;
  for (int frame = 0; frame < 240; ++frame) {  // ten seconds of a camera at 24 frames a second
    show_picture(board, "a", static_cast<std::uint64_t>(frame));
    if (feed.next(kStart + Seconds(frame / 24.0)).message) ++told;
  }
  EXPECT_NEAR(told, 100, 5);
}

TEST(ServerFeeds, IterationsAreToldFromTheFirstOnAndThenThoseOfTheNextReconstruction) {
  Board board;
  for (std::uint32_t i = 1; i <= 2; ++i) show_iteration(board, "first", i);
  IterationFeed feed(board);
  EXPECT_EQ(feed.next(kStart).message->iteration().iteration(), 1U);
  EXPECT_EQ(feed.next(kStart).message->iteration().iteration(), 2U);
  EXPECT_FALSE(feed.next(kStart).message);
  show_iteration(board, "second", 1);
  EXPECT_EQ(feed.next(kStart).message->reconstruction(), "second");
  EXPECT_FALSE(feed.next(kStart).message);
  show_iteration(board, "second", 1, 7);
  EXPECT_EQ(feed.next(kStart).message->frame(), 7U) << "the sequence's next frame";
  EXPECT_FALSE(feed.next(kStart).message);
}

}  // namespace
}  // namespace emberlock::daemon
