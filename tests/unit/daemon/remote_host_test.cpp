// SPDX-License-Identifier: Apache-2.0
// A leading host and one that lends, over TLS on this machine: cameras, parts of recordings.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/hosts/host_parts.h"
#include "daemon/hosts/lending_server.h"
#include "daemon/hosts/remote_camera.h"
#include "drivers/replay/record.h"
#include "session/files.h"
#include "tests/support/certificate.h"
#include "tests/support/http_client.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

namespace fs = std::filesystem;
using test::wait_until;
using ::testing::HasSubstr;

constexpr ImageLayout kLentLayout{{16, 8}, PixelFormat::gray8, 8};

constexpr Seconds kPatience = test::kHangGuard;

Frame lent_frame(std::uint64_t id, TimePoint at = SteadyClock().now()) {
  return {{.frame_id = id, .device_time = {}, .system_time = {}, .monotonic_time = at},
          std::make_shared<Image>(kLentLayout)};
}

/// A host with one camera, "cam", that does what it is told.
class FakeLender final : public Lender {
 public:
  Result<v1::LentCameras> lend(const Borrower& leader) override {
    const std::lock_guard lock(mutex);
    asked_by = leader.name;
    if (!leader.certificate.empty()) certificates.insert(leader.certificate);
    v1::LentCameras cameras;
    v1::LentCameras::Camera& camera = *cameras.add_cameras();
    *camera.mutable_stream() = drivers::to_proto({.id = "cam",
                                                  .model = "a model",
                                                  .layout = kLentLayout,
                                                  .frame_rate = Hertz(24),
                                                  .reset = ShutterReset::on_command});
    camera.set_state(films ? v1::CameraStatus::FILMING : v1::CameraStatus::LOST);
    return cameras;
  }
  Status hear(const Borrower& /*leader*/) override { return {}; }
  Result<std::shared_ptr<LentFrames>> watch(const Borrower& /*leader*/,
                                            const v1::FramesRequest& /*request*/) override {
    auto frames = loan.watch(0);
    ++watches;
    return frames;
  }
  Status reset(const Borrower& /*leader*/, const v1::ResetRequest& request) override {
    const std::lock_guard lock(mutex);
    resets.push_back(request);
    return {};
  }
  Status trim(const Borrower& /*leader*/, const v1::TrimRequest& request) override {
    const std::lock_guard lock(mutex);
    trim_ppm = request.trim_ppm();
    return {};
  }
  Result<v1::HostPart> record_part(const Borrower& /*leader*/, const v1::PartRequest& request) override {
    if (answers_late) static_cast<void>(wait_until([this] { return !answers_late; }));
    const std::lock_guard lock(mutex);
    if (refuses) return Error{ErrorKind::refused, "its disk is full", "emberlockd", "Free space"};
    recorded = request;
    part_now.set_session(request.name());
    part_now.set_state(v1::HostPart::RECORDING);
    part_now.add_camera_ids("cam");
    if (loses_answers) return Error{ErrorKind::io, "its answer was lost"};
    return part_now;
  }
  Status stop_part(const Borrower& /*leader*/, const v1::StopPartRequest& request) override {
    const std::lock_guard lock(mutex);
    stopped = request;
    part_now.set_state(v1::HostPart::WHOLE);
    part_now.set_frames(240);
    part_now.set_until_ns(request.at_ns() - early_ns);
    return {};
  }
  Result<v1::HostPart> part(const Borrower& /*leader*/, const v1::FindPartRequest& request) override {
    const std::lock_guard lock(mutex);
    if (loses_answers) return Error{ErrorKind::io, "its answer was lost"};
    if (!recorded || recorded->manifest().session_id() != request.session_id())
      return Error{ErrorKind::out_of_data, "it has none"};
    return part_now;
  }

  std::mutex mutex;
  std::string asked_by;
  std::set<std::string> certificates;  ///< that asked
  std::atomic<int> watches = 0;        ///< that have begun
  std::atomic<bool> films = true;
  bool refuses = false;
  bool loses_answers = false;              ///< to Record and to Part
  std::atomic<bool> answers_late = false;  ///< to Record: not before this is false again
  Loan loan{1};
  std::vector<v1::ResetRequest> resets;
  double trim_ppm = 0;
  std::optional<v1::PartRequest> recorded;
  std::optional<v1::StopPartRequest> stopped;
  std::int64_t early_ns = 0;
  v1::HostPart part_now;
};

class RemoteHostTest : public ::testing::Test {
 protected:
  RemoteHostTest() {
    write("authority.crt", authority.pem());
    const rig::TlsIdentity own = authority.issue("localhost");
    write("host.crt", own.certificate);
    write("host.key", own.key);
    config.certificate = temp / "host.crt";
    config.key = temp / "host.key";
    config.authority = temp / "authority.crt";
    config.listen = "127.0.0.1:" + std::to_string(port.number());
    serve();
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(temp / name) << text;
    fs::permissions(temp / name, fs::perms::owner_read | fs::perms::owner_write);
  }
  void serve() {
    auto started = LendingServer::start(lender, config);
    ASSERT_TRUE(started.ok()) << started.error().message();
    server = std::move(*started);
  }
  std::shared_ptr<RemoteHost> reach(const rig::HostsConfig& as) {
    auto channel = channel_to(config.listen, as);
    EXPECT_TRUE(channel.ok()) << channel.error().message();
    return std::make_shared<RemoteHost>(config.listen, "dome at here", *channel);
  }
  std::shared_ptr<RemoteHost> reach() {
    auto host = reach(config);
    EXPECT_TRUE(wait_until([&] { return host->connected(); }));
    return host;
  }
  std::unique_ptr<RemoteCamera> camera(const std::shared_ptr<RemoteHost>& host) {
    return std::make_unique<RemoteCamera>(
        host, drivers::CameraInfo{.id = "cam", .model = "", .layout = {}, .frame_rate = Hertz(24)});
  }
  /// A camera that films: the call that watches it has arrived at its host.
  std::unique_ptr<RemoteCamera> filming(const std::shared_ptr<RemoteHost>& host) {
    auto cam = camera(host);
    start(*cam);
    return cam;
  }
  void start(drivers::Camera& cam) {
    const int before = lender.watches;
    const Status started = cam.start();
    ASSERT_TRUE(started.ok()) << started.error().message();
    ASSERT_TRUE(wait_until([&] { return lender.watches > before; }));
  }
  void offer(const Frame& frame, const drivers::FrameCounts& counts = {}) {
    lender.loan.offer(0, frame, counts, Seconds(0));
  }
  Result<Frame> send(drivers::Camera& to, std::uint64_t id, const drivers::FrameCounts& counts = {}) {
    offer(lent_frame(id), counts);
    return to.next_frame(kPatience);
  }

  test::TempFolder temp;
  test::ReservedPort port;  ///< the host's, also while it is away
  test::CertificateAuthority authority{"who signs hosts"};
  rig::HostsConfig config;
  FakeLender lender;
  std::unique_ptr<LendingServer> server;
};

TEST_F(RemoteHostTest, ItsClockAndItsLightAreKnown) {
  const auto host = reach();
  const v1::HostStatus status = host->status();
  EXPECT_EQ(status.light(), v1::GREEN);
  ASSERT_TRUE(status.has_clock_ahead_s());
  EXPECT_LE(std::abs(status.clock_ahead_s()), status.clock_sigma_s() + 1e-6) << "it is the same clock";
  EXPECT_GT(status.round_trip_s(), 0);
}

TEST_F(RemoteHostTest, WithoutACertificateOfTheHostsNobodyIsLetIn) {
  const test::CertificateAuthority foreign("somebody else");
  const rig::TlsIdentity stranger = foreign.issue("localhost");
  write("stranger.crt", stranger.certificate);
  write("stranger.key", stranger.key);
  rig::HostsConfig as = config;
  as.certificate = temp / "stranger.crt";
  as.key = temp / "stranger.key";
  const auto host = reach(as);
  EXPECT_FALSE(host->borrow().ok());
  EXPECT_FALSE(host->connected());
  EXPECT_EQ(host->status().light(), v1::RED);
  EXPECT_EQ(lender.asked_by, "");
}

TEST_F(RemoteHostTest, ALeaderIsKnownByItsCertificateToo) {
  rig::HostsConfig other = config;
  const rig::TlsIdentity issued = authority.issue("localhost");
  write("other.crt", issued.certificate);
  write("other.key", issued.key);
  other.certificate = temp / "other.crt";
  other.key = temp / "other.key";
  ASSERT_TRUE(reach()->borrow().ok());
  ASSERT_TRUE(reach()->borrow().ok());
  EXPECT_EQ(lender.certificates.size(), 1U);
  ASSERT_TRUE(reach(other)->borrow().ok());
  EXPECT_EQ(lender.certificates.size(), 2U) << "of the same name";
}

TEST_F(RemoteHostTest, ACameraFilmsFromAfar) {
  const auto cam = filming(reach());
  EXPECT_EQ(lender.asked_by, "dome at here");
  EXPECT_EQ(cam->info().model, "a model");
  EXPECT_EQ(cam->info().layout, kLentLayout);
  const auto frame = send(*cam, 7);
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  EXPECT_EQ(frame->stamp.frame_id, 7U);
  EXPECT_EQ(frame->image->layout(), kLentLayout);
  EXPECT_LE(abs(frame->stamp.monotonic_time - SteadyClock().now()), Seconds(10));
}

TEST_F(RemoteHostTest, OfFramesThatWerentSentTheCountsAreRight) {
  const auto cam = filming(reach());
  ASSERT_TRUE(send(*cam, 1, {.delivered = 100}).ok());
  const drivers::FrameCounts before = cam->counts();
  ASSERT_TRUE(send(*cam, 2, {.delivered = 110, .transport = 3}).ok());
  const drivers::FrameCounts since = cam->counts() - before;
  EXPECT_EQ(since.delivered, 1U);
  EXPECT_EQ(since.passed_over, 9U);
  EXPECT_EQ(since.transport, 3U);
}

TEST_F(RemoteHostTest, AResetGoesThereAndEarlierFramesAreDropped) {
  const auto host = reach();
  const auto cam = filming(host);
  ASSERT_TRUE(send(*cam, 1).ok());
  const TimePoint at = SteadyClock().now() + kPatience;
  const double before_s = host->status().clock_sigma_s();
  ASSERT_TRUE(cam->reset_shutter(at).ok());
  const double known_s = std::max(before_s, host->status().clock_sigma_s());
  ASSERT_EQ(lender.resets.size(), 1U);
  EXPECT_NEAR(1e-9 * static_cast<double>(lender.resets[0].at_ns() - at.ns), 0, known_s + 1e-6);
  offer(lent_frame(2, at - Seconds(10)));
  offer(lent_frame(3, at + Seconds(10)));
  EXPECT_EQ(cam->next_frame(kPatience)->stamp.frame_id, 3U);
  ASSERT_TRUE(cam->trim_rate(PartsPerMillion(12)).ok());
  EXPECT_EQ(lender.trim_ppm, 12);
}

TEST_F(RemoteHostTest, ACamerasErrorThereIsOneHere) {
  const auto cam = filming(reach());
  ASSERT_TRUE(send(*cam, 1).ok());
  lender.loan.fail(0, {ErrorKind::device, "it was unplugged", "camera cam", "Plug it in"});
  const Result<Frame> failed = cam->next_frame(kPatience);
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().kind, ErrorKind::device);
  EXPECT_THAT(failed.error().message(), HasSubstr("unplugged"));
  lender.films = false;
  EXPECT_THAT(cam->start().error().message(), HasSubstr("doesn't film"));
  lender.films = true;
  EXPECT_TRUE(cam->start().ok());
}

TEST_F(RemoteHostTest, AHostThatIsGoneIsAnErrorWithinSecondsAndTakenUpAgain) {
  const auto host = reach();
  const auto cam = filming(host);
  ASSERT_TRUE(send(*cam, 1).ok());
  server.reset();
  EXPECT_EQ(cam->next_frame(kPatience).error().kind, ErrorKind::device);
  ASSERT_TRUE(wait_until([&] { return !host->connected(); }));
  EXPECT_EQ(cam->start().error().kind, ErrorKind::device);
  serve();
  ASSERT_TRUE(wait_until([&] { return host->connected(); }));
  start(*cam);
  EXPECT_TRUE(send(*cam, 2).ok());
}

class HostPartsTest : public RemoteHostTest {
 protected:
  HostPartsTest() : folder(temp / "take") {
    test::record(folder, kLentLayout, 5, test::small_disk_options(session::Encoding::raw_nut));
    const auto manifest = session::read_manifest(folder);
    request.mutable_manifest()->set_session_id(manifest->session_id());
    request.mutable_manifest()->add_cameras()->set_camera_id("cam");
    begins_in(kPatience);
    known.set_session("take");
    known.set_state(v1::HostPart::RECORDING);
    known.add_camera_ids("cam");
  }
  /// The host that the parts are of.
  std::shared_ptr<RemoteHost> known_host() {
    auto host = reach();
    known.set_host(host->address());
    return host;
  }
  [[nodiscard]] v1::HostPart kept() const { return session::read_manifest(folder)->hosts(0); }
  void begin(HostParts& parts) const { parts.begin(folder, {request}, {known}); }
  /// When the recording of which these are parts does.
  void begins_in(Seconds time) { request.set_from_ns((SteadyClock().now() + time).ns); }
  void end(HostParts& parts) const {
    parts.end(folder, SteadyClock().now());
    ASSERT_TRUE(parts.close(folder, kPatience).ok());
  }
  static bool any_news(HostParts& parts, v1::HostPart::State state) {
    return wait_until([&] {
      for (const PartNews& news : parts.news())
        if (news.part.state() == state) return true;
      return false;
    });
  }

  fs::path folder;
  v1::PartRequest request;
  v1::HostPart known;
};

TEST_F(HostPartsTest, APartIsBegunEndedAndKnownToBeWhole) {
  HostParts parts({known_host()}, "dome at here");
  begin(parts);
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(lender.mutex);
    return lender.recorded.has_value();
  }));
  ASSERT_EQ(parts.of(folder).size(), 1U);
  EXPECT_EQ(parts.of(folder)[0].state(), v1::HostPart::RECORDING);
  EXPECT_EQ(lender.recorded->name(), "take");
  EXPECT_EQ(lender.recorded->leader(), "dome at here");
  end(parts);
  EXPECT_EQ(kept().state(), v1::HostPart::WHOLE) << kept().why();
  EXPECT_EQ(kept().frames(), 240U);
  EXPECT_EQ(kept().clock_size(), 2);
  EXPECT_TRUE(any_news(parts, v1::HostPart::WHOLE));
  EXPECT_TRUE(wait_until([&] { return parts.of(folder).empty(); })) << "nothing more is asked";
}

TEST_F(HostPartsTest, AHostThatHangsDoesntHoldTheNextTakeUp) {
  lender.answers_late = true;
  // A machine that stands still for 1.5 s could hide the answer; hardly five times.
  bool waited = true;
  for (int attempt = 0; waited && attempt < 5; ++attempt) {
    HostParts parts({known_host()});
    begin(parts);
    parts.begin(temp / "next", {request}, {known});
    waited = parts.of(folder)[0].state() == v1::HostPart::MISSING;  // it was given up meanwhile
  }
  lender.answers_late = false;
  EXPECT_FALSE(waited);
}

TEST_F(HostPartsTest, OneThatEndsEarlyIsShort) {
  lender.early_ns = 3'000'000'000;
  HostParts parts({known_host()});
  begin(parts);
  end(parts);
  EXPECT_EQ(kept().state(), v1::HostPart::SHORT);
  EXPECT_THAT(kept().why(), HasSubstr("3.0 s before"));
}

TEST_F(HostPartsTest, OneThatCantBeginIsMissingAndBeginsWhenItCan) {
  lender.refuses = true;
  begins_in(Seconds(-10));
  HostParts parts({known_host()});
  begin(parts);
  EXPECT_TRUE(any_news(parts, v1::HostPart::MISSING));
  EXPECT_THAT(parts.of(folder)[0].why(), HasSubstr("its disk is full"));
  EXPECT_EQ(parts.hosts()[0].parts_wanting(), 1U);
  {
    const std::lock_guard lock(lender.mutex);
    lender.refuses = false;
  }
  EXPECT_TRUE(any_news(parts, v1::HostPart::RECORDING));
  end(parts);
  EXPECT_EQ(kept().state(), v1::HostPart::SHORT);
  EXPECT_THAT(kept().why(), HasSubstr("after the recording does"));
}

TEST_F(HostPartsTest, OneOfWhichItIsNotKnownWhenItBeganIsntCalledWhole) {
  lender.loses_answers = true;
  begins_in(Seconds(-10));
  HostParts parts({known_host()});
  begin(parts);
  EXPECT_TRUE(any_news(parts, v1::HostPart::MISSING));
  {
    const std::lock_guard lock(lender.mutex);
    ASSERT_TRUE(lender.recorded.has_value());
    lender.loses_answers = false;
  }
  EXPECT_TRUE(any_news(parts, v1::HostPart::RECORDING));
  end(parts);
  EXPECT_EQ(kept().state(), v1::HostPart::SHORT);
  EXPECT_THAT(kept().why(), HasSubstr("its frames begin up to"));
}

TEST_F(HostPartsTest, OneWhoseHostIsAwayIsMissingAndKnownWhenItIsBack) {
  auto parts = std::make_unique<HostParts>(HostParts::Hosts{known_host()});
  begin(*parts);
  ASSERT_TRUE(wait_until([&] { return parts->of(folder)[0].clock_size() > 0; }));
  server.reset();
  parts->end(folder, SteadyClock().now());
  ASSERT_TRUE(any_news(*parts, v1::HostPart::MISSING));
  ASSERT_TRUE(parts->close(folder, kPatience).ok());
  EXPECT_EQ(kept().state(), v1::HostPart::MISSING);
  EXPECT_THAT(kept().why(), HasSubstr("doesn't answer"));
  // emberlockd is restarted meanwhile.
  parts = std::make_unique<HostParts>(HostParts::Hosts{reach(config)});
  parts->take_up({folder});
  serve();
  ASSERT_TRUE(wait_until([&] { return kept().state() == v1::HostPart::WHOLE; })) << kept().why();
  EXPECT_TRUE(any_news(*parts, v1::HostPart::WHOLE));
}

TEST_F(HostPartsTest, OneThatWasBegunAndIsntFoundIsMissingNotShort) {
  HostParts parts({known_host()});
  begin(parts);
  ASSERT_TRUE(wait_until([&] { return parts.of(folder)[0].clock_size() > 0; }));
  {
    const std::lock_guard lock(lender.mutex);
    lender.recorded.reset();
  }
  EXPECT_TRUE(any_news(parts, v1::HostPart::MISSING));
  EXPECT_THAT(parts.of(folder)[0].why(), HasSubstr("disk"));
}

TEST_F(HostPartsTest, AClockThatWasSetAnewMeanwhileIsntJoinedWithTheOldOne) {
  HostParts parts({known_host()});
  v1::ClockReading& before = *known.add_clock();
  before.set_at_ns(SteadyClock().now().ns - 1'000'000'000);
  before.set_ahead_ns(5'000'000'000'000);  // before the machine was started anew
  begin(parts);
  end(parts);
  EXPECT_EQ(kept().clock_size(), 1);
}

TEST_F(HostPartsTest, WhatIsWholeIsntAskedForAgain) {
  HostParts parts({known_host()});
  begin(parts);
  end(parts);
  HostParts again({reach()});
  again.take_up({folder, temp / "no session"});
  EXPECT_TRUE(again.of(folder).empty());
}

}  // namespace
}  // namespace emberlock::daemon
