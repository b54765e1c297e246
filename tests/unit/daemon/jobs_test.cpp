// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/jobs.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
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

constexpr auto kSalvages = v1::Job::SALVAGE;
constexpr auto kVerifies = v1::Job::VERIFY;

/// "take 1 RUNNING 50 %", ...
std::vector<std::string> in_short(const Jobs& jobs) {
  std::vector<std::string> all;
  for (const v1::Job& job : jobs.list()) {
    all.push_back(job.session() + " " + v1::Job::State_Name(job.state()) + " " +
                  std::to_string(std::lround(100 * job.fraction())) + " %");
  }
  return all;
}

JobResult done_at_once(const Observer& /*observer*/) { return v1::JobOutcome(); }

/// Done at once, after it has noted this.
template <class Note>
std::function<JobResult(const Observer&)> after(Note note) {
  return [note](const Observer& observer) {
    note();
    return done_at_once(observer);
  };
}

/// Asks on and on, until it may end.
class Asking {
 public:
  Job job(const std::string& session, v1::Job::Kind kind = kSalvages) {
    return {
        kind, session,
        [this](const Observer& observer) -> JobResult {
          while (!may_end) {
            EMBERLOCK_RETURN_IF_ERROR(observe(observer, .5, "asking"));
            ++asked;
          }
          v1::JobOutcome outcome;
          outcome.set_ok(true);
          return outcome;
        },
        [this, session](const JobResult& result) { told = session + (result.ok() ? ": well" : ": not"); }};
  }
  std::atomic<bool> may_end = false;
  std::atomic<int> asked = 0;
  std::string told;  ///< once the jobs are drained
};

TEST(JobsThreads, AreListedInTheOrderInWhichTheyWereAdded) {
  Asking asking;
  Jobs jobs;
  ASSERT_TRUE(jobs.add(asking.job("a")).ok());
  const auto second = jobs.add({kSalvages, "b", done_at_once});
  const auto again = jobs.add({kSalvages, "b", [](const Observer&) -> JobResult { return Error{}; }});
  EXPECT_EQ(*second, *again) << "one is enough";
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  EXPECT_THAT(in_short(jobs), ElementsAre("a RUNNING 50 %", "b WAITING 0 %"));
  ASSERT_TRUE(jobs.find(kSalvages, "b"));
  EXPECT_FALSE(jobs.find(v1::Job::COMPRESS, "b"));
  asking.may_end = true;
  jobs.drain();
  EXPECT_EQ(asking.told, "a: well");
  EXPECT_THAT(in_short(jobs), IsEmpty());
  EXPECT_EQ((*second)->state().state(), v1::Job::DONE);
}

TEST(JobsThreads, PausedTheBackgroundStandsStillInTheMidstAndGoesOnAfterwards) {
  Asking asking;
  Jobs jobs;
  const auto job = *jobs.add(asking.job("a"));
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  jobs.pause();
  EXPECT_THAT(in_short(jobs), ElementsAre("a PAUSED 50 %"));
  // One question may have been on its way.
  int asked = asking.asked;
  ASSERT_TRUE(wait_until([&] { return std::exchange(asked, asking.asked) == asking.asked; }));
  EXPECT_EQ(job->state().silent_s(), 0) << "it isn't to blame";
  // What somebody asked for goes on.
  EXPECT_TRUE((*jobs.add({kVerifies, "b", done_at_once}))->wait(test::kHangLimit));
  asking.may_end = true;
  EXPECT_LE(asking.asked, asked + 1);
  jobs.resume();
  jobs.drain();
  EXPECT_EQ(asking.told, "a: well");
}

TEST(JobsThreads, TheyEndAtOnceWithTheirOwnerAndTellNothingOfWhatWasCutShort) {
  Asking asking;
  std::atomic<bool> began = false;
  {
    Jobs jobs;
    ASSERT_TRUE(jobs.add(asking.job("a")).ok());
    ASSERT_TRUE(jobs.add({kSalvages, "b", after([&] { began = true; })}).ok());
    ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  }
  EXPECT_EQ(asking.told, "");
  EXPECT_FALSE(began);
}

TEST(JobsThreads, TheyEndWhilePaused) {
  Asking asking;
  Jobs jobs;
  ASSERT_TRUE(jobs.add(asking.job("a")).ok());
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  jobs.pause();
}

TEST(JobsThreads, ACancelledOneEndsAtItsNextStepAndOneThatWaitsNeverBegins) {
  Asking asking;
  Jobs jobs;
  const auto running = *jobs.add(asking.job("a"));
  std::atomic<bool> began = false;
  const auto waiting = *jobs.add({kSalvages, "b", after([&] { began = true; })});
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  EXPECT_TRUE(jobs.cancel(waiting->state().id()).ok());
  EXPECT_EQ(waiting->state().state(), v1::Job::CANCELLED);
  EXPECT_EQ(waiting->result()->error().kind, ErrorKind::refused);
  EXPECT_THAT(in_short(jobs), ElementsAre("a RUNNING 50 %"));
  EXPECT_FALSE(jobs.cancel(waiting->state().id()).ok()) << "once";
  EXPECT_TRUE(jobs.cancel(running->state().id()).ok());
  jobs.drain();
  EXPECT_EQ(running->state().state(), v1::Job::CANCELLED);
  EXPECT_EQ(asking.told, "a: not");
  EXPECT_FALSE(began);
  EXPECT_EQ(jobs.cancel(77).error().kind, ErrorKind::refused);
}

TEST(JobsThreads, ARecordingsEndGoesOnWhoeverWouldCancelIt) {
  Asking asking;
  Jobs jobs;
  const auto job = *jobs.add(asking.job("a", v1::Job::FINISH));
  ASSERT_TRUE(wait_until([&] { return asking.asked > 2; }));
  const Status refused = jobs.cancel(job->state().id());
  ASSERT_FALSE(refused.ok());
  EXPECT_FALSE(refused.error().remedy.empty());
  asking.may_end = true;
  EXPECT_TRUE((*job->wait(test::kHangLimit)).ok());
}

TEST(JobsThreads, TooManyThatWaitAreRefused) {
  Asking asking;
  Jobs jobs({.asked = 1, .waiting = 1});
  ASSERT_TRUE(jobs.add(asking.job("a", kVerifies)).ok());
  ASSERT_TRUE(wait_until([&] { return asking.asked > 0; }));
  ASSERT_TRUE(jobs.add({kVerifies, "b", done_at_once}).ok());
  EXPECT_EQ(jobs.add({kVerifies, "c", done_at_once}).error().kind, ErrorKind::refused);
  EXPECT_TRUE(jobs.add({kSalvages, "d", done_at_once}).ok()) << "the background has room";
}

TEST(JobsThreads, ACancelledOneMakesRoomAtOnce) {
  Asking asking;
  Jobs jobs({.asked = 1, .waiting = 1});
  ASSERT_TRUE(jobs.add(asking.job("a", kVerifies)).ok());
  ASSERT_TRUE(wait_until([&] { return asking.asked > 0; }));
  const auto waiting = *jobs.add({kVerifies, "b", done_at_once});
  EXPECT_TRUE(jobs.cancel(waiting->state().id()).ok());
  EXPECT_TRUE(jobs.add({kVerifies, "c", done_at_once}).ok());
}

TEST(JobsThreads, ACancelledOneThatWaitedTellsWhoeverAddedIt) {
  Asking running;
  Asking waiting;
  Jobs jobs;
  ASSERT_TRUE(jobs.add(running.job("a")).ok());
  ASSERT_TRUE(wait_until([&] { return running.asked > 0; }));
  ASSERT_TRUE(jobs.cancel((*jobs.add(waiting.job("b")))->state().id()).ok());
  running.may_end = true;
  jobs.drain();
  EXPECT_EQ(waiting.told, "b: not");
  EXPECT_EQ(waiting.asked, 0);
}

TEST(JobsThreads, WhileTheyEndNothingNewIsTakenButARecordingsEnd) {
  std::atomic<bool> began = false;
  Asking asking;
  Jobs jobs;
  const auto running = *jobs.add(asking.job("a", kVerifies));
  ASSERT_TRUE(wait_until([&] { return asking.asked > 0; }));
  jobs.end();
  EXPECT_EQ(running->wait(test::kHangLimit)->error().kind, ErrorKind::refused);
  const auto late = jobs.add({kSalvages, "b", after([&] { began = true; })});
  EXPECT_EQ(late.error().kind, ErrorKind::refused);
  const auto finish = jobs.add({v1::Job::FINISH, "c", done_at_once});
  ASSERT_TRUE(finish.ok());
  EXPECT_TRUE((*finish)->wait(test::kHangLimit)->ok());
  jobs.drain();
  EXPECT_FALSE(began);
}

TEST(JobsThreads, OneThatTellsNothingHangs) {
  Jobs jobs;
  std::promise<void> go_on;
  const auto job = *jobs.add({kVerifies, "a", after([&] { go_on.get_future().wait(); })});
  EXPECT_THAT(jobs.hanging(Seconds(60)), IsEmpty());
  ASSERT_TRUE(wait_until([&] { return !jobs.hanging(Seconds(0.02)).empty(); }));
  EXPECT_EQ(jobs.hanging(Seconds(0.02)).front().session(), "a");
  go_on.set_value();
  jobs.drain();
  EXPECT_THAT(jobs.hanging(Seconds(0)), IsEmpty());
}

TEST(JobsThreads, AHangingOneEndsNoDaemonWhoseMemoryHoldsFrames) {
  EXPECT_FALSE(tolerates_hanging(v1::LOCKED, kVerifies));
  EXPECT_TRUE(tolerates_hanging(v1::CAPTURING, kVerifies));
  EXPECT_TRUE(tolerates_hanging(v1::FINISHING, kVerifies));
  EXPECT_FALSE(tolerates_hanging(v1::FINISHING, v1::Job::FINISH)) << "it writes them no more";
}

TEST(JobsThreads, WhoWatchesHearsOfEachChangeUntilItStopsWatching) {
  Asking asking;
  Jobs jobs;
  const auto job = *jobs.add(asking.job("a", kVerifies));
  std::atomic<int> changes = 0;
  job->watch([&] { ++changes; });
  ASSERT_TRUE(wait_until([&] { return changes > 2; }));
  std::uint64_t seen = 0;
  EXPECT_EQ(job->news(seen)->doing(), "asking");
  job->watch({});
  const int heard = changes;
  const int asked = asking.asked;
  ASSERT_TRUE(wait_until([&] { return asking.asked > asked + 2; }));
  EXPECT_EQ(changes, heard);
  asking.may_end = true;
  ASSERT_TRUE(job->wait(test::kHangLimit));
  EXPECT_EQ(job->news(seen)->state(), v1::Job::DONE);
  EXPECT_TRUE(job->state().outcome().ok());
  EXPECT_FALSE(job->news(seen));
}

TEST(JobsThreads, TheyLeaveTheProcessorToOthersAndWhoIsToldMayAddMore) {
  Jobs jobs;
  const auto niceness = [] { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); };
  std::atomic<int> salvaging = 0, verifying = 0, finishing = -1;
  std::promise<bool> gone;
  Job first{kSalvages, "a", after([&] { salvaging = niceness(); }), [&](const JobResult&) {
              gone.set_value(!jobs.find(kSalvages, "a"));
              static_cast<void>(jobs.add({kSalvages, "a", after([&] { ++salvaging; })}));
            }};
  ASSERT_TRUE(jobs.add(std::move(first)).ok());
  EXPECT_TRUE(gone.get_future().get());
  ASSERT_TRUE(jobs.add({kVerifies, "b", after([&] { verifying = niceness(); })}).ok());
  ASSERT_TRUE(jobs.add({v1::Job::FINISH, "c", after([&] { finishing = niceness(); })}).ok());
  jobs.drain();
  EXPECT_EQ(salvaging, 20);
  EXPECT_EQ(verifying, 19);
  EXPECT_LT(finishing, 19);
}

}  // namespace
}  // namespace emberlock::daemon
