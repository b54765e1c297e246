// SPDX-License-Identifier: Apache-2.0
#include "evaluate/design.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "evaluate/twin.h"
#include "recon/kernels/planck.h"

namespace emberlock::evaluate {
namespace {
using testing::HasSubstr;

const ErrorLaw kLaw{6, {500, 3e4, 2, 900, 5000, 3}, 0.1};

DesignRequest request(double target) {
  DesignRequest r;
  r.target = target;
  return r;
}

TEST(PixelNoise, FallsWithTheRootOfLight) {
  const DesignRequest r;
  EXPECT_NEAR(pixel_noise(r, milliseconds(4)), r.noise, 1e-12);
  EXPECT_NEAR(pixel_noise(r, milliseconds(16)), r.noise / 2, 1e-12);
  DesignRequest hot;
  hot.temperature = Kelvin(2200);
  const double brighter = std::exp(recon::log_planck(600, 2200) - recon::log_planck(600, 1800));
  EXPECT_NEAR(pixel_noise(hot, milliseconds(4)), r.noise / std::sqrt(brighter), 1e-12);
}

TEST(DesignSlow, MeetsItsTargetWithTheFewestCamerasThatDo) {
  const Design d = design(kLaw, request(9));
  ASSERT_TRUE(d.reached);
  EXPECT_LE(d.chosen.error(), 9);
  for (const DesignedRig& rig : d.curve) {
    if (rig.cameras < d.chosen.cameras) {
      EXPECT_GT(rig.error(), 9) << rig.cameras;
    }
  }
}

TEST(DesignSlow, MoreCamerasAndFinerPicturesAreNeverPredictedWorse) {
  for (const ImageSize size : design_sizes())
    for (int n = 3; n < 32; ++n)
      EXPECT_LE(designed(kLaw, request(5), n + 1, size).error(),
                designed(kLaw, request(5), n, size).error() + 1e-9)
          << n;
  const std::vector<ImageSize> sizes = design_sizes();
  for (std::size_t i = 1; i < sizes.size(); ++i)
    EXPECT_LE(designed(kLaw, request(5), 8, sizes[i]).error(),
              designed(kLaw, request(5), 8, sizes[i - 1]).error());
}

/// No rig that a law is fitted to or checked by; each of its quantities on both sides of what they span.
TEST(DesignExtrapolation, IsNamedOutsideOfWhatWasSimulated) {
  for (const auto& rigs : {sweep_rigs(), check_rigs()})
    for (const NamedRig& one : rigs) EXPECT_THAT(list_extrapolated(one.rig), testing::IsEmpty()) << one.name;
  const TwinRig base = sweep_rigs().front().rig;
  const auto named = [&](const auto& change) {
    TwinRig rig = base;
    change(rig);
    const std::vector<std::string> all = list_extrapolated(rig);
    return all.size() == 1 ? all.front() : std::to_string(all.size());
  };
  for (const int cameras : {3, 17, 32})
    EXPECT_EQ(named([&](TwinRig& r) { r.towards = even_planes(cameras); }),
              std::to_string(cameras) + " cameras (simulated: 4 to 16)");
  for (const int width : {40, 241, 640})
    EXPECT_THAT(named([&](TwinRig& r) { r.pixel = twin_pixel(width); }), HasSubstr("(simulated: 48 to 240)"));
  for (const double noise : {5.1, 50.0})
    EXPECT_THAT(named([&](TwinRig& r) { r.noise = noise; }),
                HasSubstr("grey levels of noise (simulated: 0 to 5)"));
  for (const double rise : {0.151, 3.0})
    EXPECT_THAT(named([&](TwinRig& r) { r.exposed = rise; }), HasSubstr("in an exposure"));
  for (const double rise : {0.061, 3.0})
    EXPECT_THAT(named([&](TwinRig& r) { r.late = rise; }), HasSubstr("within the tolerance"));
}

TEST(DesignSlow, AnImpossibleTargetGivesTheMostAccurate) {
  const Design d = design(kLaw, request(0.5));
  EXPECT_FALSE(d.reached);
  for (const DesignedRig& rig : d.curve) EXPECT_GE(rig.error(), d.chosen.error());
}

TEST(DesignSlow, StepsLowerTheErrorByWhatTheySayTheLargestFirst) {
  const Design d = design(kLaw, request(9));
  ASSERT_FALSE(d.steps.empty());
  double before = INFINITY;
  for (const DesignStep& step : d.steps) {
    EXPECT_NEAR(d.chosen.error() - step.to.error(), step.gain, 1e-12);
    EXPECT_GT(step.gain, 0);
    EXPECT_LE(step.gain, before);
    before = step.gain;
  }
}

TEST(Design, AFasterFlameIsExposedShorterAndAHotterOneToo) {
  const auto exposure = [](double speed, double kelvin) {
    DesignRequest r;
    r.speed = speed;
    r.temperature = Kelvin(kelvin);
    return designed(kLaw, r, 8, {640, 480}).exposure;
  };
  EXPECT_LT(exposure(4, 1800), exposure(2, 1800));
  EXPECT_LT(exposure(2, 2200), exposure(2, 1800));
  EXPECT_LT(exposure(0, 1800), period(Hertz(24)));
  EXPECT_LE(exposure(2, 1800), exposure(0, 1800));
}

TEST(Design, TheSameAtAllScales) {
  DesignRequest large;
  large.size = Meters(1.6);
  large.speed = 20;
  const DesignedRig a = designed(kLaw, DesignRequest{}, 8, {640, 480});
  const DesignedRig b = designed(kLaw, large, 8, {640, 480});
  EXPECT_NEAR(a.error(), b.error(), 1e-9);
  EXPECT_NEAR(placed(large, b)[3].center().norm(), 10 * placed({}, a)[3].center().norm(), 1e-9);
}

TEST(Design, CamerasStandWhereTheFlameHasTheTwinsSize) {
  DesignRequest tele;
  tele.lens = 30;
  const DesignedRig rig = designed(kLaw, tele, 5, {640, 480});
  for (const recon::CameraModel& camera : placed(tele, rig)) {
    const double height = camera.project({0, 0, 0.5 * tele.size.value()}).y();
    EXPECT_NEAR((0.5 * 480 - height) * twin_pixel(640), 0.5, 0.05) << "in heights of the flame";
    EXPECT_NEAR(camera.project(Eigen::Vector3d::Zero()).x(), 320, 1e-6);
  }
}

TEST(Design, RangesAreNamed) {
  const auto told = [](auto change) {
    DesignRequest r;
    change(r);
    const Status status = check_design(r);
    return status.ok() ? std::string() : status.error().where;
  };
  EXPECT_EQ(told([](DesignRequest&) {}), "");
  EXPECT_THAT(told([](DesignRequest& r) { r.size = Meters(0); }), HasSubstr("--flame"));
  EXPECT_THAT(told([](DesignRequest& r) { r.temperature = Kelvin(NAN); }), HasSubstr("--flame"));
  EXPECT_THAT(told([](DesignRequest& r) { r.target = 0; }), HasSubstr("--target-error"));
  EXPECT_THAT(told([](DesignRequest& r) { r.most_cameras = 2; }), HasSubstr("--most-cameras"));
}

TEST(Recording, NeedsAsManyHostsAndDisksAsCarryIt) {
  DesignedRig rig;
  rig.cameras = 10;
  rig.size = {1000, 1000};
  DesignRequest r;
  r.rate = Hertz(100);                                          // 100 MB/s a camera
  r.host_link = 350e6;                                          // three cameras
  const Result<Recording> needs = recording_of(r, rig, 320e6);  // two cameras a disk
  ASSERT_TRUE(needs.ok());
  EXPECT_NEAR(needs->bytes_per_s, 1e9, 1);
  EXPECT_EQ(needs->hosts, 4);  // of 3, 3, 2, 2
  EXPECT_EQ(needs->disks, 6);
  EXPECT_EQ(recording_of(r, rig, 50e6).error().kind, ErrorKind::refused);
  r.host_link = 50e6;
  EXPECT_THAT(recording_of(r, rig, 320e6).error().where, HasSubstr("--host-link"));
}

TEST(NextCamera, StandsInTheGap) {
  TwinRig rig;
  rig.pixel = twin_pixel(160);
  for (const double degrees : {0, 18, 36, 54, 72, 90}) {  // of 180: opposite ones see the same
    const double a = degrees * std::numbers::pi / 180;
    rig.towards.emplace_back(std::cos(a), std::sin(a), 0);
  }
  const std::vector<NextCamera> places = next_cameras(kLaw, rig, 4);
  ASSERT_EQ(places.size(), 4u);
  const Eigen::Vector3d gap(std::cos(2.356), std::sin(2.356), 0);  // 135 degrees
  EXPECT_GT(std::abs(places[0].towards.dot(gap)), std::cos(30 * std::numbers::pi / 180));
  const double now = total(predict(kLaw, rig));
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_LE(places[i].error, now);
    if (i > 0) {
      EXPECT_GE(places[i].error, places[i - 1].error);
    }
  }
}

TEST(StandingRig, FindsTheFlameWhereTheCamerasLook) {
  const Eigen::Vector3d flame(3, -2, 1);
  std::vector<recon::CameraModel> cameras;
  const recon::Intrinsics lens{{640, 480}, 500, 500, 320, 240, {}};
  for (const Eigen::Vector3d& towards : even_planes(5))
    cameras.push_back(recon::look_at(lens, flame + 2 * towards, flame));
  const Result<StandingRig> rig = standing(cameras, {});
  ASSERT_TRUE(rig.ok());
  EXPECT_LT((rig->flame - flame).norm(), 1e-9);
  EXPECT_NEAR(rig->distance, 2, 1e-9);
  EXPECT_NEAR(rig->pixel, 2 / 500.0, 1e-9);
  for (std::size_t i = 0; i < cameras.size(); ++i)
    EXPECT_LT((cameras[i].center() - rig->flame - 2 * (rig->world_from_twin * rig->towards[i])).norm(), 1e-9);
  EXPECT_EQ(standing({cameras[0]}, {}).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(standing({cameras[0], cameras[0]}, {}).error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(standing(cameras, cameras[2].center()).ok());
}

}  // namespace
}  // namespace emberlock::evaluate
