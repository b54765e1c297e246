// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/edit_queue.h"

#include <future>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>

#include "session/child_messages.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using testing::HasSubstr;

v1::EditRequest named(const std::string& operation) {
  v1::EditRequest request;
  request.set_operation(operation);
  return request;
}
v1::ChildMessage::Edited taken(std::uint32_t steps) {
  v1::ChildMessage::Edited edited;
  edited.mutable_taken()->set_steps(steps);
  return edited;
}

/// The watcher's and the child's part, as a test does them by hand.
class EditQueueTest : public testing::Test {
 protected:
  EditQueueTest() {
    auto end = queue_.open();
    if (end) child_ = std::move(*end);
  }
  using Answer = std::future<Result<v1::StylizationStatus>>;
  static constexpr Seconds kPatience = test::kHangGuard;
  Answer ask(v1::EditRequest request, Seconds longest = kPatience) {
    Answer answer = std::async(std::launch::async, [this, request = std::move(request), longest] {
      return queue_.ask(request, longest);
    });
    pollfd woken{queue_.woken(), POLLIN, 0};
    EXPECT_GT(::poll(&woken, 1, -1), 0);
    return answer;
  }
  /// The operations that have reached the child.
  std::vector<std::string> read() {
    std::vector<std::string> operations;
    char bytes[65536];
    for (ssize_t n = 0; (n = ::recv(child_.get(), bytes, sizeof bytes, MSG_DONTWAIT)) > 0;)
      EXPECT_TRUE(parser_.add({bytes, static_cast<std::size_t>(n)},
                              [&](v1::EditRequest&& request) { operations.push_back(request.operation()); }));
    return operations;
  }
  [[nodiscard]] bool ended() const {
    char byte = 0;
    return ::recv(child_.get(), &byte, 1, MSG_DONTWAIT | MSG_PEEK) == 0;
  }

  EditQueue queue_;
  UniqueFd child_;
  session::EditRequestParser parser_;
};

TEST_F(EditQueueTest, EachCallerHasTheAnswerToItsOwnStep) {
  Answer first = ask(named("first"));
  queue_.send();
  Answer second = ask(named("second"));
  queue_.send();
  EXPECT_THAT(read(), testing::ElementsAre("first", "second"));
  queue_.take(taken(1));
  v1::ChildMessage::Edited refused;
  refused.mutable_refused()->set_where("step: view");
  refused.mutable_refused()->set_what("is held out");
  queue_.take(refused);
  EXPECT_EQ(first.get()->steps(), 1U);
  const auto answer = second.get();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(answer.error().message(), "step: view: is held out");
}

TEST_F(EditQueueTest, AStepLargerThanTheSocketTakesArrivesPieceByPiece) {
  v1::EditRequest large = named("large");
  large.set_picture(std::string(3 << 20, 'x'));
  Answer answer = ask(large);
  std::vector<std::string> arrived;
  EXPECT_TRUE(test::wait_until([&] {
    queue_.send();
    arrived = read();
    return !arrived.empty();
  }));
  EXPECT_THAT(arrived, testing::ElementsAre("large"));
  EXPECT_EQ(queue_.blocked(), -1);
  queue_.take(taken(1));
  EXPECT_TRUE(answer.get());
}

TEST_F(EditQueueTest, TheEndComesBehindTheLastStep) {
  Answer answer = ask(named("last"));
  EXPECT_TRUE(queue_.finish());
  EXPECT_EQ(queue_.ask(named("late"), kPatience).error().kind, ErrorKind::refused);
  EXPECT_EQ(queue_.finish().error().kind, ErrorKind::refused);
  EXPECT_FALSE(ended());
  queue_.send();
  EXPECT_THAT(read(), testing::ElementsAre("last"));
  EXPECT_TRUE(ended());
  queue_.take(taken(1));
  EXPECT_TRUE(answer.get());
}

TEST_F(EditQueueTest, WhoWaitsWhenTheChildGoesIsToldSo) {
  Answer answer = ask(named("step"));
  child_ = {};
  queue_.send();  // into nothing, which costs the daemon nothing
  queue_.close();
  const auto refused = answer.get();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("ended before it took the step"));
  EXPECT_EQ(queue_.ask(named("next"), kPatience).error().kind, ErrorKind::refused);
}

TEST_F(EditQueueTest, NobodyWaitsForEverNorSendsWhatCannotBeRead) {
  EXPECT_EQ(ask(named("step"), Seconds(0.01)).get().error().kind, ErrorKind::timed_out);
  v1::EditRequest large = named("large");
  large.set_picture(std::string(session::kLargestChildMessage, 'x'));
  const auto refused = queue_.ask(large, kPatience);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::daemon
