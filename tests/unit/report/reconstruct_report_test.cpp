// SPDX-License-Identifier: Apache-2.0
#include "report/reconstruct_report.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>

#include "recon/hull/hull.h"
#include "report/measured_pictures.h"
#include "report/value_slices.h"
#include "report/volume_pictures.h"
#include "report/volume_view.h"
#include "tests/support/ball_scene.h"

namespace emberlock::report {
namespace {
using testing::HasSubstr;
using testing::Not;

recon::Scene small_ball() {
  BallOptions ball;
  ball.views = 4;
  ball.image = {48, 36};
  return ball_scene(ball);
}

/// One bright voxel off the middle, in a medium that takes light there.
recon::Volume one_light(int voxels) {
  recon::Volume v{
      recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, voxels), {}, {}};
  v.emission.resize(3 * v.grid.size());
  v.extinction.resize(v.grid.size());
  const std::size_t p = v.grid.index(voxels / 4, voxels / 2, 3 * voxels / 4);
  v.emission[3 * p] = 400;
  v.emission[3 * p + 1] = 100;
  v.extinction[p] = 8;
  return v;
}

TEST(SmallVolumeTest, IsCroppedToTheLightAndHoldsItsSquareRoot) {
  const SmallVolume small = small_volume(one_light(40));
  EXPECT_EQ(small.points, (std::array{3, 3, 3}));
  EXPECT_EQ(small.brightest, 400);
  EXPECT_EQ(small.densest, 8);
  const std::size_t middle = 1 + 3 * (1 + 3 * 1);
  EXPECT_EQ(small.light[3 * middle], 255);
  EXPECT_EQ(small.light[3 * middle + 1], 128);
  EXPECT_EQ(small.density[middle], 255);
  EXPECT_EQ(std::count(small.density.begin(), small.density.end(), 0), 26);
}

TEST(SmallVolumeTest, IsSmallHoweverLargeTheVolumeAndKeepsItsLight) {
  const recon::Volume large = one_light(300);
  const SmallVolume small = small_volume(large);
  EXPECT_LE(*std::max_element(small.points.begin(), small.points.end()), SmallVolume::kMostPoints);
  EXPECT_NEAR(small.edge, 3 * 0.2 / 300, 1e-6);
  EXPECT_NEAR(small.brightest * 27, 400, 1e-3) << "a point is the mean of 27";
  recon::Volume dark = one_light(8);
  std::fill(dark.emission.begin(), dark.emission.end(), 0.F);
  EXPECT_EQ(small_volume(dark).points, (std::array{9, 9, 9}));
  EXPECT_EQ(small_volume(dark).light[0], 0);
}

TEST(SmallVolumeTest, PicturesHaveUpUpwards) {
  recon::Volume v = one_light(8);
  v.emission[0] = 400;  // and one in the lowest corner, so that nothing is cropped away there
  const SmallVolume small = small_volume(v);
  const auto brightest_row = [&](const ShownAxes& axes) {
    const Image picture = volume_picture(small, axes, axes.away, Across::projection);
    int best = 0;
    int at = 0;
    for (int y = 0; y < picture.view().height(); ++y)
      for (int x = 1; x < picture.view().width(); ++x)
        if (picture.view().sample(x, y) > best) best = picture.view().sample(x, y), at = y;
    return static_cast<double>(at) / picture.view().height();
  };
  EXPECT_LT(brightest_row({2, 1, 0, 1}), 0.5) << "at three quarters of the height";
  EXPECT_GT(brightest_row({2, -1, 1, 0}), 0.5);
}

TEST(ShownAxesTest, UpIsWhatIsUpInThePictures) {
  recon::Scene scene = small_ball();
  const ShownAxes axes = shown_axes(scene.views);
  EXPECT_EQ(axes.up, 2);
  EXPECT_EQ(axes.sign, 1);
  for (recon::View& view : scene.views)
    view.camera = recon::look_at(view.camera.intrinsics, {0.3, 0.1, 0}, {0, 0, 0}, -Eigen::Vector3d::UnitY());
  const ShownAxes down = shown_axes(scene.views);
  EXPECT_EQ(down.up, 1);
  EXPECT_EQ(down.sign, -1);
  const Eigen::Vector3d up = down.sign * Eigen::Vector3d::Unit(down.up);
  EXPECT_GT(Eigen::Vector3d::Unit(down.across).cross(Eigen::Vector3d::Unit(down.away)).dot(up), 0);
}

TEST(VolumeView, CarriesTheVolumeAndSaysSoWhereItCannotBeTurned) {
  const std::string html = volume_view_html(small_volume(one_light(16)), {}, {1, 0, 0});
  EXPECT_THAT(html, HasSubstr("\"points\":[3,3,3]"));
  EXPECT_THAT(html, HasSubstr("webgl2"));
  EXPECT_THAT(html, HasSubstr("has no WebGL2"));
  EXPECT_THAT(html, HasSubstr("<noscript>"));
  EXPECT_THAT(html, Not(HasSubstr("http")));
}

/// One that tells 1700 K, and its errors, in the voxel that has light.
recon::Outcome measured_light() {
  recon::Outcome outcome;
  outcome.reconstruction.volume = one_light(16);
  const recon::Volume& volume = outcome.reconstruction.volume;
  const std::size_t points = volume.grid.size();
  const std::size_t lit = volume.grid.index(4, 8, 12);
  outcome.errors.emplace();
  outcome.errors->emission.assign(6 * points, 100);
  for (const std::size_t c : {0U, 3U, 5U}) outcome.errors->emission[6 * lit + c] = 3600;  // sigma 60 a metre
  outcome.errors->extinction.assign(points, 1);
  outcome.errors->extinction[lit] = 2.5F;
  outcome.errors->solves = 7;
  outcome.temperature.emplace();
  outcome.temperature->kelvin.assign(points, 0);
  outcome.temperature->kelvin[lit] = 1700;
  outcome.temperature->sigma.assign(points, 0);
  outcome.temperature->sigma[lit] = 12;
  recon::TemperatureSummary& summary = outcome.temperature->summary;
  summary.counts = {.emitting = 2, .told = 1, .unclear = 1};
  summary.mean = summary.low = summary.high = 1700;
  summary.sigma = 12;
  return outcome;
}

TEST(MeasuredPictures, TemperatureIsToldInSentencesAndDrawnWithABarInKelvin) {
  const std::string html = temperature_html(measured_light(), {});
  for (const char* part :
       {"<p>1700 K on average", "<p>Read from a grey glow", "<p>Not told: 1 can", "<span>1700 K</span>",
        "<span>1750 K</span>", "temperature in the middle, across z", "<p>Grey: not told."})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_EQ(temperature_html({}, {}), "");
}

TEST(MeasuredPictures, ErrorsOfLightAndExtinctionAreDrawnWhereThereIsLight) {
  recon::Outcome outcome = measured_light();
  const std::string html = errors_html(outcome, {});
  for (const char* part :
       {"<h2>Errors</h2>", "by solves without some of the views",
        "In volume.vdb: emission_sigma and density_sigma.<", "<span>0.6 grey levels a centimetre</span>",
        "<span>2.5 1/m</span>", "error of the extinction in the middle, across x"})
    EXPECT_THAT(html, HasSubstr(part));
  outcome.noise =
      recon::NoiseErrors{std::vector<float>(outcome.reconstruction.volume.emission.size(), 90), {}};
  outcome.report.errors = recon::error_summary(outcome.reconstruction.volume, *outcome.errors, outcome.noise);
  for (const char* part : {"by 7 solves", "what of it noise makes, in the middle, across x",
                           "would alone make", "<span>0.9 grey levels a centimetre</span>", "density_noise"})
    EXPECT_THAT(errors_html(outcome, {}), HasSubstr(part));
  outcome.errors->extinction.clear();
  outcome.report.errors->extinction = 0;
  EXPECT_THAT(errors_html(outcome, {}), Not(HasSubstr("1/m")));
  EXPECT_EQ(errors_html({}, {}), "");
}

TEST(ValueSlice, ShowsLowDarkHighBrightAndWhatIsNotToldGrey) {
  const recon::Grid grid{{0, 0, 0}, 1, 3, 1, 2};
  const std::vector<float> values = {1500, 0, 2000, 0, 0, 0};
  const Image slice = value_slice(grid, values, {}, 1, {1500, 2000, "K"});
  ASSERT_EQ(slice.layout().size, (ImageSize{3, 1})) << "cropped to what is told";
  const auto light = [&](int x) {
    const std::uint8_t* rgb = slice.view().row_as<std::uint8_t>(0) + 3 * x;
    return rgb[0] + rgb[1] + rgb[2];
  };
  EXPECT_LT(light(0), 20);
  EXPECT_EQ(light(1), 3 * 58);
  EXPECT_GT(light(2), 600);
}

TEST(ReconstructReport, ShowsEverythingInOnePageThatNeedsNoOther) {
  const recon::Scene scene = small_ball();
  recon::Outcome outcome;
  recon::Report& report = outcome.report;
  report.input = "<flame>";
  report.heldout_rmse = recon::ChannelRmse{5, 5, 5};
  report.effects = {{"extinction", true, 3.2, Seconds(0.5), "it shows", Seconds(0.01)}};
  report.iterations = 3;
  report.kept = {1, recon::KeptBy::held_out};
  report.trace = {{Seconds(1), 1, {6, 6, 6}, {5, 5, 5}}};
  report.discarded = {{Seconds(2), 2, {5, 5, 5}, {6, 6, 6}}, {Seconds(3), 3, {4, 4, 4}, {7, 7, 7}}};
  report.warnings = {"only 4 input views"};
  for (const recon::View& view : scene.views) {
    outcome.renders.push_back(*view.image);
    report.views.push_back({view.name, view.role, {1, 2, 3}});
  }
  outcome.reconstruction.volume = one_light(16);
  const std::string page = reconstruct_html(scene, outcome);
  for (const char* part :
       {"&lt;flame&gt;", "captured (held out)", "1.00 / 2.00 / 3.00", "it shows", "from above",
        "RMS error over the flame", "after iteration 1 of 3", "held out, not kept", "only 4 input views",
        "slice through the middle", "class=\"turn\""})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_LT(page.find("captured (held out)"), page.find("0: camera 0")) << "held-out views come first";
  for (const char* outside : {"http", "src=\"/", "href=", "@import", "url("})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
}

}  // namespace
}  // namespace emberlock::report
