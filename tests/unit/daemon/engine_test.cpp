// The conductor on its thread, asked by others.
#include "daemon/engine/engine.h"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "session/verify.h"
#include "tests/support/small_daemon.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

using test::small_config;
using test::wait_until;
using ::testing::Contains;
using ::testing::HasSubstr;

const ImageLayout kLeftLayout{{64, 48}, PixelFormat::gray8, 8};

class EngineThread : public ::testing::Test {
 protected:
  void start() { engine_ = Engine::start(config_, board_).value(); }
  [[nodiscard]] v1::Phase phase() const { return board_.status()->phase(); }
  v1::RecordRequest take(double seconds = 0) {
    v1::RecordRequest request;
    request.set_name("take");
    request.set_unlocked(true);
    request.set_seconds(seconds);
    return request;
  }
  [[nodiscard]] std::filesystem::path sessions() const { return config_.recording.folder; }
  /// A session of an earlier daemon's.
  void left_by_another(const std::string& session, Encoding encoding) const {
    test::record(sessions() / session, kLeftLayout, 20, test::small_disk_options(encoding));
  }

  test::TempFolder temp_;
  DaemonConfig config_ = small_config(temp_.path());
  Board board_;
  std::unique_ptr<Engine> engine_;
};

TEST_F(EngineThread, WhoeverHasAnAnswerFindsInTheStatusWhatItDid) {
  start();
  ASSERT_TRUE(engine_->align({}).ok());
  EXPECT_NE(phase(), v1::IDLE);
  ASSERT_TRUE(engine_->stop_sync().ok());
  EXPECT_EQ(phase(), v1::IDLE);
  const auto recording = engine_->record(take());
  ASSERT_TRUE(recording.ok()) << recording.error().message();
  EXPECT_EQ(recording->session(), "take");
  EXPECT_EQ(board_.status()->recording().session(), "take");
  const auto stopped = engine_->stop_recording();
  ASSERT_TRUE(stopped.ok()) << stopped.error().message();
  EXPECT_EQ(stopped->state(), v1::RecordingStatus::COMPLETE) << stopped->verdict();
  EXPECT_EQ(phase(), v1::IDLE);
}

TEST_F(EngineThread, WhatManyAskAtOnceIsDoneAndTheRecordingIsWhole) {
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      for (int round = 0; round < 10; ++round) {
        EXPECT_TRUE(engine_->strobe().ok());
        EXPECT_EQ(engine_->align({}).error().kind, ErrorKind::refused);
        EXPECT_TRUE(engine_->alive());
        EXPECT_EQ(engine_->list_sessions()->sessions_size(), 1);
      }
    });
  }
  for (std::thread& client : clients) client.join();
  ASSERT_TRUE(engine_->stop_recording().ok());
  EXPECT_TRUE(verify_session(sessions() / "take")->whole());
}

TEST_F(EngineThread, AJobLeavesTheProcessorToOthersAndItsLastWordIsWhatCameOfIt) {
  left_by_another("old", Encoding::ffv1);
  start();
  const auto niceness = [] { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); };
  const int before = niceness();
  v1::SessionRequest request;
  request.set_session("old");
  v1::JobProgress last;
  const Status done = engine_->verify_session(request, [&](const v1::JobProgress& progress) {
    EXPECT_EQ(niceness(), progress.done() ? before : 19);
    last = progress;
    return true;
  });
  ASSERT_TRUE(done.ok()) << done.error().message();
  EXPECT_TRUE(last.done());
  EXPECT_TRUE(last.ok()) << last.report();
  EXPECT_EQ(niceness(), before);
}

TEST_F(EngineThread, EndedInMidRecordingItFinishesIt) {
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  engine_.reset();
  const auto check = verify_session(sessions() / "take");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_EQ(check->state, v1::Manifest::COMPLETE);
  EXPECT_TRUE(check->whole()) << check->to_do;
}

TEST_F(EngineThread, WhatAnEarlierDaemonLeftUncompressedIsCompressedFromTheStart) {
  left_by_another("raw", Encoding::raw_nut);
  left_by_another("compressed", Encoding::ffv1);
  config_.recording.transcode = RecordingConfig::Transcode::when_idle;
  start();
  ASSERT_TRUE(wait_until([&] { return !board_.notices(0).empty(); }));
  EXPECT_THAT(board_.notices(0).front().text(), HasSubstr("raw: compressed and verified"));
  EXPECT_FALSE(is_uncompressed(sessions() / "raw"));
  EXPECT_TRUE(verify_session(sessions() / "raw")->whole());
  EXPECT_EQ(board_.notices(0).size(), 1U);
}

TEST_F(EngineThread, WhereNothingIsToBeCompressedItStaysAsItWas) {
  left_by_another("raw", Encoding::raw_nut);
  config_.recording.transcode = RecordingConfig::Transcode::never;
  start();
  ASSERT_TRUE(engine_->strobe().ok());
  engine_.reset();
  EXPECT_TRUE(is_uncompressed(sessions() / "raw"));
}

}  // namespace
}  // namespace emberlock
