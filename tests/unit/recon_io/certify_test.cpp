// SPDX-License-Identifier: Apache-2.0
// What a volume's certificate tells of the files that it is made of.
#include "recon/pipeline/certify.h"

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recon/synthetic/flame.h"
#include "session/events.h"
#include "session/files.h"
#include "session/shutter_times.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"
#include "tests/support/scene_files.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

/// Three calibrated cameras at 100 Hz, six frames in segments of two.
class CertifySessionTest : public testing::Test {
 protected:
  void record(const std::vector<v1::Event>& events = {}) const {
    const ImageLayout layout{{16, 8}, PixelFormat::gray8, 8};
    v1::Manifest manifest = test::manifest_of({layout, layout, layout});
    manifest.set_created_utc("2026-11-27T12:00:00Z");
    for (int i = 0; i < 3; ++i) {
      v1::Calibration& c = *manifest.mutable_cameras(i)->mutable_calibration();
      c.set_fx(20 + i);
      c.set_fy(21);
      c.set_cx(8);
      c.set_cy(4);
      for (const double v : {1., 0., 0., -0.5 * i, 0., 1., 0., 0., 0., 0., 1., 2.})
        c.add_camera_from_world(v);
      for (int s = 0; s < 15; ++s) c.add_sigma(1e-3 * s);
    }
    session::WriterOptions options = test::small_disk_options();
    options.frames_per_segment = 2;
    auto writer = value_of(session::SessionWriter::create(session_, manifest, options));
    for (const v1::Event& event : events) ASSERT_TRUE(writer.append(event).ok());
    for (std::size_t camera = 0; camera < 3; ++camera)
      for (std::uint64_t f = 0; f < 6; ++f)
        ASSERT_TRUE(writer.write(camera, test::noise_frame(layout, f, camera)).ok());
    ASSERT_TRUE(writer.finish().ok());
  }
  void tell_times() const {
    v1::ShutterTimes times;
    for (int i = 0; i < 3; ++i) {
      auto* camera = times.add_cameras();
      camera->set_camera_id("cam" + std::to_string(i));
      camera->set_sigma_s(3e-5 + 1e-5 * i);
      for (int f = 0; f < 6; ++f) camera->add_late_s(i == 1 ? -1e-3 : 2e-3 * i);
    }
    ASSERT_TRUE(session::write_shutter_times(session_, times).ok());
  }
  [[nodiscard]] v1::VolumeCertificate told(FileHashes* hashes, std::size_t frame = 4) const {
    SceneOptions options;
    options.frame = frame;
    return value_of(origin_of(session_, options, {}, hashes));
  }

  test::TempFolder folder_;
  fs::path session_ = folder_ / "take";
  FileHashes hashes_;
};

TEST_F(CertifySessionTest, TellsWhoFilmedWhatWhen) {
  record();
  const v1::VolumeCertificate certificate = told(&hashes_);
  EXPECT_EQ(certificate.origin(), v1::VolumeCertificate::SESSION);
  const v1::FilmedSession& session = certificate.session();
  EXPECT_EQ(session.session_id(), "test");
  EXPECT_EQ(session.created_utc(), "2026-11-27T12:00:00Z");
  EXPECT_EQ(session.frame(), 4U);
  EXPECT_EQ(session.filmed_utc_ns(), 1'700'000'000'040'000'000);
  ASSERT_EQ(session.cameras_size(), 3);
  const auto& camera = session.cameras(1);
  EXPECT_EQ(camera.recorded(), 6U);
  EXPECT_EQ(camera.calibration().fx(), 21);
  EXPECT_THAT(camera.calibration().centre_m(), ElementsAre(0.5, 0, -2));
  EXPECT_THAT(camera.calibration().centre_sigma_m(), ElementsAre(1e-3 * 9, 1e-3 * 10, 1e-3 * 11));
  EXPECT_NE(camera.calibration().sha256(), session.cameras(2).calibration().sha256());
  EXPECT_TRUE(session.sync().source().empty()) << "nothing tells";
}

TEST_F(CertifySessionTest, HashesTheFilesThatTheFrameIsMadeOf) {
  record();
  std::vector<std::string> names;
  const v1::VolumeCertificate certificate = told(&hashes_, 2);
  for (const auto& file : certificate.session().files()) {
    names.push_back(file.file());
    EXPECT_EQ(file.sha256(), sha256(test::bytes_of(session_ / file.file())));
    EXPECT_EQ(file.bytes(), fs::file_size(session_ / file.file()));
  }
  EXPECT_THAT(names, ElementsAre("cam0/000001.mkv", "cam0/index.bin", "cam1/000001.mkv", "cam1/index.bin",
                                 "cam2/000001.mkv", "cam2/index.bin", "events.binpb", "manifest.json"));
  const v1::VolumeCertificate without = told(nullptr);
  EXPECT_EQ(without.session().files_size(), 0);
  EXPECT_TRUE(without.hashes_left_out());
  v1::Event event;
  event.set_note("a file that changes is hashed anew");
  test::put_bytes(session_ / "events.binpb", session::encode(event));
  EXPECT_EQ(told(&hashes_).session().files(6).sha256(), sha256(session::encode(event)));
}

TEST_F(CertifySessionTest, TellsHowWellTheCamerasWereInSyncByItsTimes) {
  record();
  tell_times();
  const v1::SyncEvidence sync = told(&hashes_).session().sync();
  EXPECT_EQ(sync.source(), "times.json");
  ASSERT_EQ(sync.cameras_size(), 3);
  EXPECT_DOUBLE_EQ(sync.cameras(2).late_s(), 4e-3);
  EXPECT_THAT(sync.worst_pair(), ElementsAre("cam2", "cam1"));
  EXPECT_DOUBLE_EQ(sync.worst_pair_s(), 5e-3);
  EXPECT_DOUBLE_EQ(sync.worst_pair_sigma_s(), std::hypot(4e-5, 5e-5));
}

TEST_F(CertifySessionTest, TellsHowWellTheCamerasWereInSyncByTheLastDecisionOfAnAlignment) {
  v1::Event first, last;
  for (int i = 0; i < 3; ++i) {
    first.mutable_decision()->add_cameras()->set_error_s(1);
    auto* camera = last.mutable_decision()->add_cameras();
    if (i < 2) camera->set_error_s(1e-4 * i);
    camera->set_sigma_s(1e-6);
  }
  record({first, last});
  const v1::SyncEvidence sync = told(&hashes_).session().sync();
  EXPECT_EQ(sync.source(), "events.binpb");
  EXPECT_DOUBLE_EQ(sync.worst_pair_s(), 1e-4);
  EXPECT_DOUBLE_EQ(sync.cameras(1).late_s(), -1e-4) << "its error is positive where it films earlier";
  EXPECT_FALSE(sync.cameras(2).has_late_s()) << "it wasn't read";
}

TEST_F(CertifySessionTest, TellsTheInstantsOfStaggeredCamerasByTheManifest) {
  record();
  auto manifest = value_of(session::read_manifest(session_));
  for (int i = 0; i < 3; ++i) manifest.mutable_cameras(i)->set_late_s(1e-3 * i);
  ASSERT_TRUE(session::write_manifest(session_, manifest).ok());
  const v1::SyncEvidence sync = told(&hashes_).session().sync();
  EXPECT_EQ(sync.source(), "manifest.json");
  ASSERT_EQ(sync.cameras_size(), 3);
  EXPECT_NEAR(sync.cameras(2).late_s(), 2e-3, 1e-9);
  EXPECT_FALSE(sync.has_worst_pair_s()) << "they are to be apart";
}

TEST_F(CertifySessionTest, EndsAsItIsAsked) {
  record();
  EXPECT_EQ(
      origin_of(session_, {}, {}, &hashes_, [](double, std::string_view) { return false; }).error().kind,
      ErrorKind::refused);
}

TEST(Certify, PicturesWithoutASessionSaySo) {
  const test::TempFolder folder;
  ASSERT_TRUE(test::write_scene(paper_scene(small_film({48, 36}, 16)), folder / "scene").ok());
  test::put_bytes(folder / "response.json", "{}");
  FileHashes hashes;
  const auto origin =
      value_of(origin_of(folder / "scene" / "transforms.json", {}, {folder / "response.json"}, &hashes));
  EXPECT_EQ(origin.origin(), v1::VolumeCertificate::PICTURES);
  EXPECT_FALSE(origin.has_session());
  std::vector<std::string> names;
  for (const auto& file : origin.made_from()) names.push_back(file.file());
  EXPECT_THAT(names, testing::IsSupersetOf({"response.json", "transforms.json", "view0.png"}));
}

}  // namespace
}  // namespace emberlock::recon
