// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/work_queue.h"

#include <atomic>
#include <future>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using test::wait_until;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kSalvages = v1::BackgroundJob::SALVAGE;

/// "take 1 RUNNING 50 %", ...
std::vector<std::string> in_short(const WorkQueue& queue) {
  std::vector<std::string> all;
  for (const v1::BackgroundJob& job : queue.progress()) {
    all.push_back(job.session() + " " + v1::BackgroundJob::State_Name(job.state()) + " " +
                  std::to_string(std::lround(100 * job.fraction())) + " %");
  }
  return all;
}

/// Asks on and on, until it may end.
class Asking {
 public:
  Work work(const std::string& session) {
    return {kSalvages, session,
            [this](const Observer& observer) -> Status {
              while (!may_end) {
                EMBERLOCK_RETURN_IF_ERROR(observe(observer, .5, "asking"));
                ++asked;
              }
              return {};
            },
            [this, session](const Status& outcome) { told = session + (outcome.ok() ? ": well" : ": not"); }};
  }
  std::atomic<bool> may_end = false;
  std::atomic<int> asked = 0;
  std::string told;  ///< once the queue is drained
};

TEST(WorkQueueTest, WhatIsInWorkIsShownFirstThenWhatWaits) {
  Asking asking;
  WorkQueue queue;
  queue.add(asking.work("a"));
  queue.add({kSalvages, "b", [](const Observer&) { return Status(); }});
  queue.add({kSalvages, "b", [](const Observer&) -> Status { return Error{}; }});  // there already
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  EXPECT_THAT(in_short(queue), ElementsAre("a RUNNING 50 %", "b WAITING 0 %"));
  ASSERT_TRUE(queue.find(kSalvages, "b"));
  EXPECT_FALSE(queue.find(v1::BackgroundJob::COMPRESS, "b"));
  asking.may_end = true;
  queue.drain();
  EXPECT_EQ(asking.told, "a: well");
  EXPECT_THAT(in_short(queue), IsEmpty());
}

TEST(WorkQueueTest, PausedItStandsStillInTheMidstAndGoesOnAfterwards) {
  Asking asking;
  WorkQueue queue;
  queue.add(asking.work("a"));
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  queue.pause();
  EXPECT_THAT(in_short(queue), ElementsAre("a PAUSED 50 %"));
  // One question may have been on its way.
  int asked = asking.asked;
  ASSERT_TRUE(wait_until([&] { return std::exchange(asked, asking.asked) == asking.asked; }));
  asking.may_end = true;
  EXPECT_LE(asking.asked, asked + 1);
  queue.resume();
  queue.drain();
  EXPECT_EQ(asking.told, "a: well");
}

TEST(WorkQueueTest, ItGoesAtOnceAndTellsNothingOfWhatItCutShort) {
  Asking asking;
  std::atomic<bool> began = false;
  {
    WorkQueue queue;
    queue.add(asking.work("a"));
    queue.add({kSalvages, "b", [&](const Observer&) {
                 began = true;
                 return Status();
               }});
    ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  }
  EXPECT_EQ(asking.told, "");
  EXPECT_FALSE(began);
}

TEST(WorkQueueTest, ItGoesWhilePaused) {
  Asking asking;
  WorkQueue queue;
  queue.add(asking.work("a"));
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  queue.pause();
}

TEST(WorkQueueTest, ItLeavesTheProcessorToOthersAndWhoIsToldMayAddMore) {
  WorkQueue queue;
  std::atomic<int> niceness = 0;
  Work first{kSalvages, "a", [&](const Observer&) {
               niceness = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
               return Status();
             }};
  std::promise<bool> gone;
  first.done = [&](const Status&) {
    gone.set_value(!queue.find(kSalvages, "a"));
    queue.add({kSalvages, "a", [&](const Observer&) {
                 ++niceness;
                 return Status();
               }});
  };
  queue.add(std::move(first));
  EXPECT_TRUE(gone.get_future().get());
  queue.drain();
  EXPECT_EQ(niceness, 20);
}

}  // namespace
}  // namespace emberlock::daemon
