// SPDX-License-Identifier: Apache-2.0
// The conductor on its thread, asked by others.
#include "daemon/engine/engine.h"

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "daemon/work/upkeep.h"
#include "session/files.h"
#include "session/verify.h"
#include "tests/support/small_daemon.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using test::small_config;
using test::wait_until;
using ::testing::Contains;
using ::testing::HasSubstr;

const ImageLayout kLeftLayout{{64, 48}, PixelFormat::gray8, 8};

class EngineThreads : public ::testing::Test {
 protected:
  void start(rig::RigOptions options = {}) {
    engine_ = Engine::start(config_, board_, {}, std::move(options)).value();
  }
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
  void left_by_another(const std::string& session, session::Encoding encoding) const {
    test::record(sessions() / session, kLeftLayout, 20, test::small_disk_options(encoding));
  }

  test::TempFolder temp_;
  rig::DaemonConfig config_ = small_config(temp_.path());
  Board board_;
  std::unique_ptr<Engine> engine_;
};

TEST_F(EngineThreads, WhoeverHasAnAnswerFindsInTheStatusWhatItDid) {
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

TEST_F(EngineThreads, WhatManyAskAtOnceIsDoneAndTheRecordingIsWhole) {
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
  EXPECT_TRUE(session::verify_session(sessions() / "take")->whole());
}

/// A strobe that answers when it is let: a serial one may take 4 s.
class HeldStrobe final : public drivers::Strobe {
 public:
  struct Hold {
    std::atomic<bool> silent = false;
    std::atomic<int> asked = 0;  ///< in vain, so far
  };
  explicit HeldStrobe(Hold& hold) : hold_(hold) {}
  [[nodiscard]] const std::string& id() const override { return id_; }
  Status apply(const drivers::StrobeSettings& settings) override {
    settings_ = settings;
    return {};
  }
  Result<drivers::StrobeSettings> read_back() override {
    if (hold_.silent) ++hold_.asked;
    EXPECT_TRUE(wait_until([this] { return !hold_.silent; }));
    return settings_;
  }

 private:
  Hold& hold_;
  std::string id_ = "held";
  drivers::StrobeSettings settings_;
};

TEST_F(EngineThreads, AStrobeThatIsSilentForLongerThanTheQueuesHoldCostsARecordingNoFrame) {
  config_.rig.strobe.source = rig::StrobeSource::serial;
  config_.rig.strobe.id = "held";
  config_.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
  HeldStrobe::Hold hold;
  rig::RigOptions options;
  options.queue_frames = 8;
  options.serial_strobe = [&hold](const std::string&, const drivers::SerialStrobeRequest&) {
    return Result<std::unique_ptr<drivers::Strobe>>(std::make_unique<HeldStrobe>(hold));
  };
  start(std::move(options));
  ASSERT_TRUE(engine_->record(take()).ok());
  hold.silent = true;
  std::thread asker([this] { EXPECT_TRUE(engine_->strobe().ok()); });
  EXPECT_TRUE(wait_until([&] { return hold.asked > 0; }));
  const auto recorded = [this] { return board_.status()->recording().frames(); };
  const auto before = recorded();
  EXPECT_TRUE(wait_until([&] { return recorded() > before + 3 * 8 * 4; })) << recorded();
  hold.silent = false;
  asker.join();
  const auto stopped = engine_->stop_recording();
  ASSERT_TRUE(stopped.ok()) << stopped.error().message();
  EXPECT_EQ(stopped->lost().queue(), 0U);
  EXPECT_EQ(stopped->state(), v1::RecordingStatus::COMPLETE) << stopped->verdict();
}

TEST_F(EngineThreads, AControlThreadThatStandsStillCostsARecordingNoFrame) {
  config_.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
  constexpr std::size_t kQueue = 2;
  test::SmallDaemon daemon(config_, {.queue_frames = kQueue});
  ASSERT_TRUE(daemon.work_until([&] { return daemon.conductor->status().light() == v1::GREEN; }, 1 << 20));
  ASSERT_TRUE(daemon.record("take").ok());
  const auto delivered = [&] { return daemon.rig->counts(0).delivered; };
  const auto before = delivered();
  // This is the control thread, and it does nothing else meanwhile.
  EXPECT_TRUE(wait_until([&] { return delivered() > before + 8 * kQueue; }));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(daemon.reach(v1::IDLE, 1 << 20));
  const v1::RecordingStatus recording = daemon.conductor->status().recording();
  EXPECT_EQ(recording.state(), v1::RecordingStatus::COMPLETE) << recording.verdict();
  EXPECT_GT(recording.cameras(0).recorded(), 8 * kQueue);
  for (const v1::Counts& camera : recording.cameras()) EXPECT_EQ(camera.queue(), 0U);
}

TEST_F(EngineThreads, AJobTellsWhatCameOfIt) {
  left_by_another("old", session::Encoding::ffv1);
  start();
  v1::SessionRequest request;
  request.set_session("old");
  const auto job = engine_->verify_session(request);
  ASSERT_TRUE(job.ok()) << job.error().message();
  const auto result = (*job)->wait(test::kHangLimit);
  ASSERT_TRUE(result && result->ok());
  EXPECT_TRUE((*result)->ok());
  EXPECT_EQ((*result)->verify().cameras(0).recorded(), (*result)->verify().cameras(0).good());
  EXPECT_EQ((*job)->state().state(), v1::Job::DONE);
}

TEST_F(EngineThreads, EndedInMidRecordingItFinishesIt) {
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  engine_.reset();
  const auto check = session::verify_session(sessions() / "take");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_EQ(check->state, v1::Manifest::COMPLETE);
  EXPECT_TRUE(check->whole()) << check->to_do;
}

TEST_F(EngineThreads, WhatAnEarlierDaemonLeftUncompressedIsCompressedFromTheStart) {
  left_by_another("raw", session::Encoding::raw_nut);
  left_by_another("compressed", session::Encoding::ffv1);
  config_.recording.transcode = rig::RecordingConfig::Transcode::when_idle;
  start();
  ASSERT_TRUE(wait_until([&] { return !board_.notices(0).empty(); }));
  EXPECT_THAT(board_.notices(0).front().text(), HasSubstr("raw: compressed and verified"));
  EXPECT_FALSE(is_uncompressed(sessions() / "raw"));
  EXPECT_TRUE(session::verify_session(sessions() / "raw")->whole());
  EXPECT_EQ(board_.notices(0).size(), 1U);
}

TEST_F(EngineThreads, WhatItRecordedUncompressedIsCompressedAndSaid) {
  config_.recording.writer.encoding = session::Encoding::raw_nut;
  config_.recording.transcode = rig::RecordingConfig::Transcode::when_idle;
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  ASSERT_TRUE(engine_->stop_recording().ok());
  ASSERT_TRUE(wait_until([&] {
    const auto notices = board_.notices(0);
    return std::any_of(notices.begin(), notices.end(), [](const v1::Notice& n) {
      return n.text().find("take: compressed and verified") != std::string::npos;
    });
  }));
  EXPECT_FALSE(is_uncompressed(sessions() / "take"));
}

TEST_F(EngineThreads, ASessionInSalvageIsShownAndRefusedForAllElseWhileARecordingMayBegin) {
  {
    auto writer = session::SessionWriter::create(sessions() / "killed", test::manifest_of({kLeftLayout}),
                                                 test::small_disk_options());
    ASSERT_TRUE(writer->write(0, test::noise_frame(kLeftLayout, 0)));
  }
  // Salvage writes its new index here, and waits until somebody reads it.
  const auto old_index = session::index_path(sessions() / "killed", "cam0");
  const auto index = old_index.parent_path() / ("." + old_index.filename().string() + ".salvaged.partial." +
                                                std::to_string(::getpid()));
  ASSERT_EQ(::mkfifo(index.c_str(), 0600), 0);
  start();
  ASSERT_TRUE(wait_until([&] {
    return board_.status()->jobs_size() == 1 && board_.status()->jobs(0).state() == v1::Job::RUNNING;
  }));
  EXPECT_EQ(board_.status()->jobs(0).kind(), v1::Job::SALVAGE);
  EXPECT_EQ(board_.status()->jobs(0).session(), "killed");
  v1::SessionRequest session;
  session.set_session("killed");
  v1::ExportRequest exporting;
  exporting.set_session("killed");
  v1::ReconstructRequest reconstruction;
  reconstruction.set_session("killed");
  for (const Status& refused :
       {Status(engine_->verify_session(session).error()), Status(engine_->repair_session(session).error()),
        Status(engine_->export_session(exporting).error()),
        Status(engine_->reconstruct(reconstruction).error())}) {
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().kind, ErrorKind::refused);
    EXPECT_THAT(refused.error().message(), HasSubstr("salvaged"));
    EXPECT_FALSE(refused.error().remedy.empty());
  }
  ASSERT_TRUE(engine_->record(take()).ok());
  EXPECT_EQ(board_.status()->jobs(0).state(), v1::Job::PAUSED);
  EXPECT_EQ(engine_->stop_recording()->state(), v1::RecordingStatus::COMPLETE);
  const UniqueFd reader(::open(index.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  // What is in a pipe can't be flushed to a disk: the operator reads that salvage failed.
  ASSERT_TRUE(wait_until([&] { return board_.status()->faults_size() == 1; }));
  EXPECT_EQ(board_.status()->faults(0).kind(), v1::Fault::SALVAGE_FAILED);
  EXPECT_EQ(board_.status()->faults(0).subject(), "killed");
  EXPECT_FALSE(board_.status()->faults(0).remedy().empty());
  std::filesystem::remove(index);
  const auto verification = engine_->verify_session(session);
  ASSERT_TRUE(verification.ok());
  EXPECT_TRUE((*verification)->wait(test::kHangLimit)->ok());
}

TEST_F(EngineThreads, ADiskThatVanishesIsTheOnlyFaultOfItsRecording) {
  namespace fs = std::filesystem;
  fs::create_directory(temp_.path() / "disk");
  fs::create_directory_symlink(temp_.path() / "disk", sessions());
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  fs::remove(sessions());
  fs::create_directory_symlink("/proc", sessions());  // any other file system
  EXPECT_EQ(engine_->stop_recording()->state(), v1::RecordingStatus::FAILED);
  ASSERT_TRUE(wait_until([&] {
    const auto notices = board_.notices(0);
    return std::any_of(notices.begin(), notices.end(), [](const v1::Notice& n) {
      return n.text().find("not a session") != std::string::npos;
    });
  }));
  for (const v1::Fault& fault : board_.status()->faults())
    EXPECT_NE(fault.kind(), v1::Fault::SALVAGE_FAILED) << fault.ShortDebugString();
}

TEST_F(EngineThreads, EndedItRefusesWhatIsAskedAndStillFinishesItsRecording) {
  start();
  ASSERT_TRUE(engine_->record(take()).ok());
  engine_->end();
  ASSERT_TRUE(wait_until([&] { return engine_->ended(milliseconds(50)); }));
  EXPECT_EQ(board_.status()->recording().state(), v1::RecordingStatus::COMPLETE);
  EXPECT_EQ(engine_->align({}).error().kind, ErrorKind::refused);
  EXPECT_EQ(engine_->record(take()).error().kind, ErrorKind::refused);
  EXPECT_TRUE(session::verify_session(sessions() / "take")->whole());
}

TEST_F(EngineThreads, WhereNothingIsToBeCompressedItStaysAsItWas) {
  left_by_another("raw", session::Encoding::raw_nut);
  config_.recording.transcode = rig::RecordingConfig::Transcode::never;
  start();
  ASSERT_TRUE(engine_->strobe().ok());
  engine_.reset();
  EXPECT_TRUE(is_uncompressed(sessions() / "raw"));
}

}  // namespace
}  // namespace emberlock::daemon
