// SPDX-License-Identifier: Apache-2.0
// Poses over time, against the truth: from true corners with noise, and from pictures with lost frames.
#include "apply/pose_track.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/marker_film.h"

namespace emberlock::apply {
namespace {

using test::off_truth;
using test::usual_marker;

constexpr double kRate = 30;

recon::Intrinsics arm_lens() { return {{640, 480}, 600, 600, 318.3, 243.1, {-0.2, 0.05, 0, 0.001, 0}}; }

/// The true corners, seen with noise of this sigma, pixels.
std::vector<MarkerPoint> seen(const Marker& marker, const recon::CameraModel& camera, double sigma,
                              std::uint64_t frame) {
  std::vector<MarkerPoint> points = test::true_corners(marker, camera);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int a = 0; a < 2; ++a)
      points[i].pixel[a] += sigma * random_normal(5, frame, 2 * i + static_cast<std::uint64_t>(a));
  return points;
}
struct Film {
  std::vector<recon::CameraModel> truth;
  std::vector<TrackStep> steps;
};
/// `lost`: the first of five lost frames.
Film film(double sway, double sigma, const std::vector<int>& lost, int frames = 90, int in_a_row = 5) {
  Film film;
  PoseTrack track(arm_lens());
  for (int f = 0; f < frames; ++f) {
    film.truth.push_back(test::in_a_hand(arm_lens(), f / kRate, sway));
    bool hidden = false;
    for (const int first : lost) hidden = hidden || (f >= first && f < first + in_a_row);
    const auto frame = static_cast<std::uint64_t>(f);
    film.steps.push_back(
        track.see(Seconds(f / kRate), hidden ? std::vector<MarkerPoint>{}
                                             : seen(usual_marker(), film.truth.back(), sigma, frame)));
  }
  return film;
}
/// The farthest that the flame's foot jumps against the truth from one frame to the next, and is off it.
struct Jumps {
  double most = 0, off = 0;
};
Jumps jumps(const std::vector<recon::CameraModel>& truth, const std::vector<TrackedPose>& poses,
            std::size_t from) {
  Jumps all;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (std::size_t f = from; f < poses.size(); ++f) {
    const recon::CameraModel camera{truth[f].intrinsics, poses[f].camera_from_marker};
    const Eigen::Vector2d off =
        camera.project(Eigen::Vector3d::Zero()) - truth[f].project(Eigen::Vector3d::Zero());
    if (f > from) all.most = std::max(all.most, (off - before).norm());
    all.off = std::max(all.off, off_truth(usual_marker(), truth[f], poses[f].camera_from_marker));
    before = off;
  }
  return all;
}
std::vector<TrackedPose> as_seen(const Film& film) {
  std::vector<TrackedPose> poses;
  for (const TrackStep& step : film.steps) poses.push_back(step.seen);
  return poses;
}

/// However much the hand sways, and corners are noisy.
TEST(PoseTrackTest, FiveLostFramesMakeNoJump) {
  for (const double sway : {0.5, 1.0, 2.0})
    for (const double sigma : {0.03, 0.1, 0.2}) {
      const Film lost = film(sway, sigma, {30, 55, 75});
      const Jumps live = jumps(lost.truth, as_seen(lost), 10);
      const Jumps later = jumps(lost.truth, smooth(lost.steps, arm_lens()), 10);
      EXPECT_LT(live.most, 2) << sway << ' ' << sigma;
      EXPECT_LT(later.most, 0.3) << sway << ' ' << sigma;
      EXPECT_LT(later.off, 0.5) << sway << ' ' << sigma;
      for (std::size_t f = 30; f < 35; ++f) {
        EXPECT_EQ(lost.steps[f].seen.from, TrackedPose::From::prediction);
        EXPECT_EQ(lost.steps[f].seen.shown, 1);
      }
    }
}

TEST(PoseTrackTest, TheSixthLostFrameIsHiddenAndTheFlameComesBackByAndBy) {
  const Film lost = film(1, 0.1, {30}, 60, 8);
  EXPECT_EQ(lost.steps[34].seen.from, TrackedPose::From::prediction);
  for (const std::size_t f : {35, 36, 37}) {
    EXPECT_EQ(lost.steps[f].seen.from, TrackedPose::From::nothing) << f;
    EXPECT_EQ(lost.steps[f].seen.shown, 0) << f;
  }
  for (std::size_t f = 38; f < 44; ++f) {
    EXPECT_EQ(lost.steps[f].seen.from, TrackedPose::From::marker);
    EXPECT_NEAR(lost.steps[f].seen.shown, static_cast<double>(f - 37) / 6, 1e-12);
  }
  const auto later = smooth(lost.steps, arm_lens());
  EXPECT_EQ(later[36].from, TrackedPose::From::nothing);
  EXPECT_LT(off_truth(usual_marker(), lost.truth[38], later[38].camera_from_marker), 0.5);
}

/// Its noise is less than that of frames on their own, and least when the future is known too.
TEST(PoseTrackTest, PosesOverTimeAreBetterThanEachFramesOwn) {
  const Film steady = film(1, 0.3, {});
  const auto later = smooth(steady.steps, arm_lens());
  double alone = 0;
  double live = 0;
  double smoothed = 0;
  for (std::size_t f = 20; f < 80; ++f) {
    const auto own = marker_poses(steady.steps[f].points, arm_lens());
    alone += std::pow(off_truth(usual_marker(), steady.truth[f], own.front().camera_from_marker), 2);
    live += std::pow(off_truth(usual_marker(), steady.truth[f], steady.steps[f].seen.camera_from_marker), 2);
    smoothed += std::pow(off_truth(usual_marker(), steady.truth[f], later[f].camera_from_marker), 2);
  }
  EXPECT_LT(live, alone);
  EXPECT_LT(smoothed, 0.7 * live);
}

/// A camera that flies by evenly, with a shutter that runs unevenly: the motion goes by the clock.
TEST(PoseTrackTest, TimesMayBeUneven) {
  PoseTrack track(arm_lens());
  double time = 0;
  double worst = 0;
  for (int f = 0; f < 40; ++f) {
    time += f % 3 == 0 ? 0.08 : 0.02;
    const auto camera =
        test::before_plate(arm_lens(), {-0.1 + 0.1 * time, -0.3, 0.4}, {-0.1 + 0.1 * time, 0, 0});
    const bool lost = f > 20 && f % 6 < 3;
    const auto step = track.see(
        Seconds(time), lost ? std::vector<MarkerPoint>{} : test::true_corners(usual_marker(), camera));
    if (f > 20) worst = std::max(worst, off_truth(usual_marker(), camera, step.seen.camera_from_marker));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(PoseTrackTest, OneWrongSightingChangesNothingButSeveralDo) {
  const auto camera = test::before_plate(arm_lens(), {0.1, -0.3, 0.4});
  const auto elsewhere = test::before_plate(arm_lens(), {-0.2, -0.25, 0.3}, {-0.1, 0.08, 0});
  const auto points = test::true_corners(usual_marker(), camera);
  const auto wrong = test::true_corners(usual_marker(), elsewhere);
  PoseTrack track(arm_lens());
  int frame = 0;
  const auto see = [&](const std::vector<MarkerPoint>& p) { return track.see(Seconds(frame++ / kRate), p); };
  for (int f = 0; f < 20; ++f) see(points);
  const TrackStep astray = see(wrong);
  EXPECT_EQ(astray.seen.from, TrackedPose::From::prediction);
  EXPECT_LT(off_truth(usual_marker(), camera, astray.seen.camera_from_marker), 0.2);
  EXPECT_EQ(see(points).seen.from, TrackedPose::From::marker);
  for (int f = 0; f < 4; ++f) see(wrong);
  EXPECT_LT(off_truth(usual_marker(), elsewhere, see(wrong).seen.camera_from_marker), 0.2);
}

/// From afar both poses of a marker explain a frame; the one that the motion leads to stays.
TEST(PoseTrackTest, TheMotionTellsWhichOfTwoPosesItIs) {
  const Marker marker = usual_marker();
  PoseTrack track(arm_lens());
  int alone_wrong = 0;
  for (int f = 0; f < 150; ++f) {
    const double away = 1.25 - 0.75 * std::cos(3.14159265358979 * std::clamp((f - 10) / 120.0, 0.0, 1.0));
    const auto camera = test::before_plate(arm_lens(), away * Eigen::Vector3d(0.25, -0.3, 0.9).normalized());
    const auto points = seen(marker, camera, 0.25, static_cast<std::uint64_t>(f));
    const auto turned = [&](const recon::Rigid3& pose) {
      return Eigen::AngleAxisd(pose.rotation * camera.camera_from_world.rotation.transpose()).angle();
    };
    const TrackStep step = track.see(Seconds(f / kRate), points);
    alone_wrong += turned(marker_poses(points, arm_lens()).front().camera_from_marker) > 0.35 ? 1 : 0;
    EXPECT_LT(turned(step.seen.camera_from_marker), 0.35) << f;
  }
  EXPECT_GT(alone_wrong, 0) << "else this tests nothing";
}

/// Pictures, with the detector, noise and lens: each frame within half a pixel of the truth.
TEST(PoseTrackSlow, AFilmOfAMarkerReprojectsWithinHalfAPixel) {
  const Marker marker = usual_marker();
  const test::Plate plate(marker);
  const recon::Intrinsics small{{320, 240}, 320, 320, 160, 120, {-0.2, 0.05, 0, 0, 0}};
  PoseTrack track(small);
  std::vector<TrackStep> steps;
  std::vector<recon::CameraModel> truth;
  for (int f = 0; f < 24; ++f) {
    truth.push_back(test::in_a_hand(small, f / kRate));
    test::PlateLook look;
    look.noise = 2;
    look.seed = static_cast<std::uint64_t>(f);
    look.hidden = f >= 12 && f < 17;
    look.srgb = false;
    steps.push_back(
        track.see(Seconds(f / kRate), find_marker(plate.seen_by(truth.back(), look).view(), marker, small)));
  }
  const auto poses = smooth(steps, small);
  for (std::size_t f = 0; f < poses.size(); ++f) {
    ASSERT_NE(poses[f].from, TrackedPose::From::nothing) << f;
    EXPECT_LT(off_truth(marker, truth[f], poses[f].camera_from_marker), 0.5) << f;
  }
  EXPECT_LT(jumps(truth, poses, 0).most, 2);
}

}  // namespace
}  // namespace emberlock::apply
