// SPDX-License-Identifier: Apache-2.0
// Several hosts as one rig: an emberlockd each, in a network namespace of its own and with a clock of its
// own.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "session/files.h"
#include "session/reader.h"
#include "session/verify.h"
#include "tests/support/certificate.h"
#include "tests/support/lab_hosts.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kCamerasAHost = 2;
using test::write_private;

class HostsSlow : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(::geteuid(), 0U) << "makes network namespaces: run it as root"; }
  [[nodiscard]] std::unique_ptr<test::LabHost> make_host(int number) const {
    return std::make_unique<test::LabHost>(
        test::LabHost::Setup{temp_.path(), number, kCamerasAHost, "320x240"}, *network_, authority_,
        test::LabHost::Programs{EMBERLOCKD_PROGRAM, EMBERLOCK_PROGRAM});
  }
  void begin(int others) {
    network_ = std::make_unique<test::HostNetwork>(others + 1);
    ASSERT_EQ(network_->trouble(), "");
    leader_ = make_host(0);
    for (int i = 1; i <= others; ++i) {
      others_.push_back(make_host(i));
      others_.back()->lends();
    }
    leader_->leads(others_);
    leader_->start();  // its strobe's light is there before the others look for it
    ASSERT_TRUE(leader_->answers("status", "dome"));
    for (auto& other : others_) other->start();
    ASSERT_TRUE(all_film());
  }
  [[nodiscard]] nlohmann::json status() const {
    return nlohmann::json::parse(leader_->client("status --json").output, nullptr, false);
  }
  [[nodiscard]] bool until(const std::function<bool(const nlohmann::json&)>& holds) const {
    const bool held = test::wait_until([&] {
      const nlohmann::json now = status();
      return now.is_object() && holds(now);
    });
    EXPECT_TRUE(held) << leader_->client("status").output;
    return held;
  }
  [[nodiscard]] bool all_film() const {
    return until([this](const nlohmann::json& now) {
      if (now["cameras"].size() != (others_.size() + 1) * kCamerasAHost) return false;
      for (const auto& camera : now["cameras"])
        if (camera["state"] != "FILMING") return false;
      return true;
    });
  }
  /// One that is given up, as a dot stayed hidden or the machine was busy, is asked for again, as an operator
  /// would.
  [[nodiscard]] bool aligns() const {
    for (int attempt = 0; attempt < 3; ++attempt) {
      const Shell align = leader_->client("align --tolerance 60rows");
      if (align.status == 0) return true;
      std::printf("%s\n", align.output.c_str());
    }
    return false;
  }
  [[nodiscard]] v1::Manifest manifest(const test::LabHost& host, const std::string& session) const {
    const auto read = session::read_manifest(host.sessions() / session);
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().message());
    return read.ok() ? *read : v1::Manifest();
  }

  test::TempFolder temp_;
  test::CertificateAuthority authority_{"who signs hosts"};
  std::unique_ptr<test::HostNetwork> network_;
  std::unique_ptr<test::LabHost> leader_;
  std::vector<std::unique_ptr<test::LabHost>> others_;
};

TEST_F(HostsSlow, TwoAreLockedByOneStrobeAndRecordOneSession) {
  ASSERT_NO_FATAL_FAILURE(begin(1));
  ASSERT_TRUE(aligns());
  EXPECT_THAT(others_[0]->client("align").output, HasSubstr("lent to dome at"));
  EXPECT_THAT(others_[0]->client("record mine --unlocked").output, HasSubstr("lent to dome at"));
  const double known = status()["alignment"]["worst_pair_s"];
  const Shell record = leader_->client("record take --seconds 2");
  EXPECT_EQ(record.status, 0) << record.output;
  const Seconds truth = test::true_worst_pair({leader_.get(), others_[0].get()}, "take", Hertz(23.976));
  EXPECT_NEAR(known, truth.value(), 0.05 * truth.value() + 2e-4)
      << "the other host's sensors are read rightly";

  const v1::Manifest whole = manifest(*leader_, "take");
  EXPECT_EQ(whole.cameras_size(), kCamerasAHost);
  ASSERT_EQ(whole.hosts_size(), 1);
  const v1::HostPart& part = whole.hosts(0);
  EXPECT_EQ(part.state(), v1::HostPart::WHOLE) << part.why();
  EXPECT_EQ(part.host(), others_[0]->address());
  EXPECT_EQ(part.lost(), 0U);
  EXPECT_NEAR(static_cast<double>(part.frames()), 2 * 48, 4);
  ASSERT_GE(part.clock_size(), 2);
  EXPECT_NEAR(1e-9 * static_cast<double>(part.clock(0).ahead_ns()), 1000, 0.02);
  const v1::Manifest there = manifest(*others_[0], "take");
  EXPECT_EQ(there.session_id(), whole.session_id());
  EXPECT_THAT(there.led_by(), HasSubstr("dome at"));
  for (const test::LabHost* host : {leader_.get(), others_[0].get()}) {
    const auto check = session::verify_session(host->sessions() / "take");
    ASSERT_TRUE(check.ok()) << check.error().message();
    EXPECT_TRUE(check->whole()) << check->to_do;
  }
}

TEST_F(HostsSlow, TheStrobesCodeSaysWhichOfTheirFramesBelongTogether) {
  ASSERT_NO_FATAL_FAILURE(begin(1));
  ASSERT_TRUE(aligns());
  const double row_time_s = status()["alignment"]["row_time_s"];
  ASSERT_EQ(leader_->client("align --stop").status, 0);
  // A hundredth faster than the cameras: the dots wander through the pictures.
  ASSERT_EQ(leader_->client("strobe --frame-code --play --rate 24.2").status, 0);
  ASSERT_EQ(leader_->client("record code --purpose alignment --unlocked --seconds 25").status, 0);
  const fs::path joined = temp_ / "joined";
  const Shell join =
      shell(std::string(EMBERLOCK_PROGRAM) + " sessions join " + (others_[0]->sessions() / "code").string() +
            " " + (leader_->sessions() / "code").string() + " --out " + joined.string());
  ASSERT_EQ(join.status, 0) << join.output;
  EXPECT_TRUE(session::verify_session(joined)->whole());
  const auto reader = session::SessionReader::open(joined);
  ASSERT_TRUE(reader.ok()) << reader.error().message();
  ASSERT_EQ(reader->camera_count(), 2U * kCamerasAHost);
  const Shell verified = shell("(" + std::string(EMBERLOCK_PROGRAM) + " verify " + joined.string() +
                               "/*/000000.nut --flash-rate 24.2 --shifts 260 --tolerance 60rows --json "
                               "--row-time-us " +
                               std::to_string(1e6 * row_time_s) + " 2>/dev/null)");
  const auto said = nlohmann::json::parse(verified.output, nullptr, false);
  ASSERT_TRUE(said.is_object()) << verified.output;
  ASSERT_EQ(said["cameras"].size(), 2U * kCamerasAHost);
  // What the films say of the frames is what the stamps, all on one clock, say.
  constexpr std::size_t kSome = 10;
  const TimePoint at = reader->stamps(0)[kSome].monotonic_time;
  for (std::size_t i = 1; i < said["cameras"].size(); ++i) {
    const auto& camera = said["cameras"][i];
    ASSERT_EQ(camera["offset_by"], "code") << camera;
    const TimePoint same =
        reader->stamps(i).at(kSome + camera["frame_offset"].get<std::size_t>()).monotonic_time;
    EXPECT_NEAR((same - at).value(), -1e-3 * camera["error_ms"].get<double>(), 2e-3) << camera;
  }
}

TEST_F(HostsSlow, OneThatIsCutOffRecordsOnAndTheSessionIsWholeAfterwards) {
  ASSERT_NO_FATAL_FAILURE(begin(2));
  std::jthread recording(
      [this] { static_cast<void>(leader_->client("record take --unlocked --seconds 20")); });
  for (const auto& other : others_) EXPECT_TRUE(other->records("take", 24));
  network_->cut_off(1);
  const std::size_t before = others_[0]->recorded("take");
  ASSERT_TRUE(until([](const nlohmann::json& now) {
    for (const auto& fault : now["faults"])
      if (fault["kind"] == "PART_WANTING" && !fault.value("over", false)) return true;
    return false;
  }));
  EXPECT_TRUE(others_[0]->records("take", before + 10 * 24));
  network_->connect(1);
  recording.join();
  ASSERT_TRUE(until([this](const nlohmann::json&) {
    const v1::Manifest now = manifest(*leader_, "take");
    return now.hosts_size() == 2 && now.hosts(0).state() == v1::HostPart::WHOLE &&
           now.hosts(1).state() == v1::HostPart::WHOLE;
  }));
  const v1::Manifest whole = manifest(*leader_, "take");
  for (const v1::HostPart& part : whole.hosts()) {
    EXPECT_EQ(part.lost(), 0U) << part.host();
    EXPECT_NEAR(static_cast<double>(part.frames()), 20 * 48, 10) << part.host();
  }
}

TEST_F(HostsSlow, OneThatIsKilledHasWhatItHadAndTheLeaderSaysSo) {
  ASSERT_NO_FATAL_FAILURE(begin(1));
  std::jthread recording(
      [this] { static_cast<void>(leader_->client("record take --unlocked --seconds 8")); });
  EXPECT_TRUE(others_[0]->records("take", 2 * 24));
  others_[0]->kill();
  others_[0]->start();
  recording.join();
  ASSERT_TRUE(until([this](const nlohmann::json&) {
    const v1::Manifest now = manifest(*leader_, "take");
    return now.hosts_size() == 1 && now.hosts(0).state() == v1::HostPart::SHORT;
  }));
  const v1::HostPart part = manifest(*leader_, "take").hosts(0);
  EXPECT_THAT(part.why(), HasSubstr("salvaged"));
  EXPECT_GT(part.frames(), 24U);
  EXPECT_TRUE(all_film()) << "it is taken up again";
  EXPECT_TRUE(aligns());
}

TEST_F(HostsSlow, ALeaderThatIsKilledFindsThePartsWhenItIsBack) {
  ASSERT_NO_FATAL_FAILURE(begin(1));
  std::jthread recording([this] { static_cast<void>(leader_->client("record take --unlocked")); });
  EXPECT_TRUE(leader_->records("take", 1));
  EXPECT_TRUE(others_[0]->records("take", 30));
  leader_->kill();
  recording.join();
  leader_->start();
  ASSERT_TRUE(until([this](const nlohmann::json&) {
    const v1::Manifest now = manifest(*leader_, "take");
    return now.hosts_size() == 1 && now.hosts(0).state() == v1::HostPart::WHOLE;
  }));
  EXPECT_EQ(manifest(*leader_, "take").state(), v1::Manifest::SALVAGED);
  EXPECT_GT(manifest(*leader_, "take").hosts(0).frames(), 48U);
}

TEST_F(HostsSlow, WhoHasNoCertificateOfTheirsIsntLetIn) {
  ASSERT_NO_FATAL_FAILURE(begin(1));
  const test::CertificateAuthority foreign("somebody else");
  const rig::TlsIdentity stranger = foreign.issue(test::HostNetwork::address(0));
  const fs::path folder = temp_ / "host-0";
  write_private(folder / "host.crt", stranger.certificate);
  write_private(folder / "host.key", stranger.key);
  leader_->kill();
  leader_->start();
  EXPECT_TRUE(until([](const nlohmann::json& now) {
    return now.contains("hosts") && now["hosts"].size() == 1 && !now["hosts"][0].value("connected", false) &&
           now["cameras"][2]["state"] == "LOST";
  }));
  EXPECT_TRUE(others_[0]->answers("status", "state      idle"));
  EXPECT_TRUE(test::wait_until(
      [this] { return others_[0]->client("status").output.find("lent to") == std::string::npos; }));
}

}  // namespace
}  // namespace emberlock
