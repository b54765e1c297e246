// SPDX-License-Identifier: Apache-2.0
// What watchers read: the newest alone, told of at once, and nothing to one that has gone.
#include "daemon/board.h"

#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_api.h"

namespace emberlock::daemon {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

std::shared_ptr<v1::Picture> picture_of(const std::string& camera, std::uint64_t frame) {
  auto picture = std::make_shared<v1::Picture>();
  picture->set_camera_id(camera);
  picture->set_frame_id(frame);
  return picture;
}

std::shared_ptr<v1::IterationPreview> iteration_of(const std::string& reconstruction, unsigned number) {
  auto preview = std::make_shared<v1::IterationPreview>();
  preview->set_reconstruction(reconstruction);
  preview->mutable_iteration()->set_iteration(number);
  preview->set_captured_jpeg("captured");
  return preview;
}

TEST(BoardThreads, TheStatusShownLastIsTheOneThatIsRead) {
  test::FakeApi api;
  v1::DaemonStatus status;
  status.set_phase(v1::LOCKED);
  api.board().show(status);
  status.set_phase(v1::CAPTURING);
  api.board().show(status);
  EXPECT_EQ(api.board().status()->phase(), v1::CAPTURING);
  EXPECT_EQ(api.board().status()->revision(), 2U);
}

TEST(BoardThreads, WhatPeopleReadAreSentences) {
  Board board;
  v1::DaemonStatus status;
  status.set_reason("every camera lies within tolerance of the target");
  status.set_next_step("virtual-02: See to its cable.");
  status.add_cameras()->set_reason("films");
  status.add_cameras();
  v1::Fault& fault = *status.add_faults();
  fault.set_what("the camera doesn't answer any more");
  fault.set_remedy("Is it plugged in?");
  status.mutable_recording()->set_verdict("12 frames of 2 cameras written, none lost");
  board.show(status);
  const auto shown = board.status();
  EXPECT_EQ(shown->reason(), "Every camera lies within tolerance of the target.");
  EXPECT_EQ(shown->next_step(), "virtual-02: See to its cable.");
  EXPECT_EQ(shown->cameras(0).reason(), "Films.");
  EXPECT_EQ(shown->cameras(1).reason(), "") << "what isn't said stays so";
  EXPECT_EQ(shown->faults(0).what(), "The camera doesn't answer any more.");
  EXPECT_EQ(shown->faults(0).remedy(), "Is it plugged in?");
  EXPECT_EQ(shown->recording().verdict(), "12 frames of 2 cameras written, none lost.");
  EXPECT_FALSE(shown->has_strobe());
  board.notice(v1::GREEN, "raw: compressed, as it was asked");
  EXPECT_EQ(board.notices(0).front().text(), "raw: compressed, as it was asked.") << "a name stays";
}

TEST(BoardThreads, OfTheJournalTheLastThousandAreKept) {
  Board board;
  for (std::size_t i = 0; i < Board::kNotices + 5; ++i) board.notice(v1::GREEN, "line");
  ASSERT_THAT(board.notices(0), SizeIs(Board::kNotices));
  EXPECT_EQ(board.notices(0).front().id(), 6U);
  EXPECT_THAT(board.notices(Board::kNotices + 4), SizeIs(1));
}

TEST(BoardThreads, AWatcherThatComesLaterSeesNoPictureFromBefore) {
  Board board;
  {
    const Subscription watching = board.want_pictures();
    board.show(picture_of("a", 1));
    const Subscription another = board.want_pictures();
    EXPECT_THAT(board.pictures(), SizeIs(1));
  }
  EXPECT_FALSE(board.pictures_wanted());
  const Subscription later = board.want_pictures();
  EXPECT_THAT(board.pictures(), IsEmpty());
}

TEST(BoardThreads, OnlyTheNewestIterationHasPicturesAndAnotherReconstructionBeginsAnew) {
  Board board;
  board.show(iteration_of("one", 1));
  board.show(iteration_of("one", 2));
  const auto both = board.iterations(0);
  ASSERT_THAT(both, SizeIs(2));
  EXPECT_EQ(both[0]->captured_jpeg(), "");
  EXPECT_EQ(both[1]->captured_jpeg(), "captured");
  EXPECT_THAT(board.iterations(1), SizeIs(1));
  board.show(iteration_of("two", 1));
  EXPECT_THAT(board.iterations(0), SizeIs(1));
  auto next_frame = std::make_shared<v1::IterationPreview>(*iteration_of("two", 1));
  next_frame->set_frame(7);
  board.show(std::shared_ptr<const v1::IterationPreview>(next_frame));
  EXPECT_THAT(board.iterations(0), SizeIs(1)) << "of the frame at hand";
}

TEST(BoardThreads, IterationsWithoutPicturesLeaveTheNewestPicturesStanding) {
  Board board;
  board.show(iteration_of("one", 1));
  auto numbers = std::make_shared<v1::IterationPreview>(*iteration_of("one", 2));
  numbers->clear_captured_jpeg();
  numbers->clear_rendered_jpeg();
  numbers->clear_volume();
  board.show(numbers);
  EXPECT_EQ(board.iterations(0).front()->captured_jpeg(), "captured");
}

TEST(BoardThreads, NobodyIsToldAfterItsSubscriptionEnded) {
  Board board;
  std::vector<Board::Topic> told;
  std::optional<Subscription> subscription =
      board.subscribe([&](Board::Topic topic) { told.push_back(topic); });
  board.show(v1::DaemonStatus());
  board.notice(v1::AMBER, "look");
  subscription.reset();
  board.show(v1::DaemonStatus());
  EXPECT_THAT(told, ElementsAre(Board::Topic::status, Board::Topic::notices));
}

TEST(FakeApi, RemembersWhatItWasAsked) {
  test::FakeApi api;
  api.on_stop_sync = [] { return Error{ErrorKind::refused, "nothing is aligned"}; };
  v1::AlignRequest request;
  request.set_tolerance("100rows");
  EXPECT_TRUE(api.align(request).ok());
  EXPECT_FALSE(api.stop_sync().ok());
  EXPECT_TRUE(api.list_sessions().ok());
  EXPECT_THAT(api.calls(), ElementsAre("align tolerance: \"100rows\"", "stop_sync", "list_sessions"));
}

}  // namespace
}  // namespace emberlock::daemon
