// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/paper.h"

#include <functional>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reconstruct.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(PapersSolver);
ON_EACH_DEVICE(PapersSolverSlow);
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

const Effects kPapersMedium = absorbing(PerMeter(32.8));

SolveOptions papers_options(int iterations = 1) { return solve_options(iterations, Solver::paper); }

Result<Reconstruction> solved_under(const std::function<void(Effects&, Scene&)>& change) {
  Scene scene = small_flame_scene();
  Effects effects = kPapersMedium;
  change(effects, scene);
  return solve(scene, grid_over(scene.box, 16), effects, papers_options());
}

TEST_P(PapersSolver, RefusesWhatItWouldIgnore) {
  const std::vector<std::pair<const char*, std::function<void(Effects&, Scene&)>>> unknown = {
      {"constant extinction", [](Effects& e, Scene&) { e.extinction.model = Extinction::Model::field; }},
      {"straight rays", [](Effects& e, Scene&) { e.refraction.rays = Refraction::Rays::curved; }},
      {"exposure",
       [](Effects& e, Scene&) {
         e.exposure = {Exposure::Shutter::integrated, Seconds(0.01), 1};
       }},
      {"saturated", [](Effects& e, Scene&) { e.sensor.clipping = Sensor::Clipping::at_white; }},
      {"saturated",
       [](Effects&, Scene& scene) {
         std::vector<std::uint8_t> bounds(160 * 120);
         bounds[60 * 160 + 80] = 1;
         scene.views[2].bounds = share(std::move(bounds));
       }},
      {"scatters evenly",
       [](Effects& e, Scene&) {
         e.scattering = {Scattering::Order::single, 0.3, 0.5};
       }},
  };
  for (const auto& [words, change] : unknown) {
    const auto r = solved_under(change);
    ASSERT_FALSE(r.ok()) << words;
    EXPECT_THAT(r.error().what, HasSubstr(words));
    EXPECT_THAT(r.error().remedy, HasSubstr("--solver default"));
  }
  SolveOptions twice = papers_options();
  twice.precision = Precision::float64;
  const Scene scene = small_flame_scene();
  EXPECT_EQ(solve(scene, grid_over(scene.box, 16), kPapersMedium, twice).error().where, "precision");
}

TEST_P(PapersSolver, KeepsWhatPassesAroundItHandle) {
  EXPECT_TRUE(solved_under([](Effects& e, Scene&) {
                e.scattering = {Scattering::Order::single, 0.3, 0};
              }).ok());
  EXPECT_TRUE(solved_under([](Effects& e, Scene&) {
                e.sensor.response = Sensor::Response::gamma;
                e.sensor.gamma = 2.2;
              }).ok());
  EXPECT_TRUE(solved_under([](Effects& e, Scene&) { e.motion = {Motion::Carry::uniform, {0, 0, 1}}; }).ok());
  EXPECT_TRUE(solved_under([](Effects&, Scene& scene) {
                scene.views[2].bounds = share(std::vector<std::uint8_t>(160 * 120));
              }).ok())
      << "bounds that no pixel has";
}

/// Light behind the flame is no flame, and pixels without flame aren't black but show it.
TEST_P(PapersSolver, FindsTheFlameBeforeABackground) {
  Scene black = small_flame_scene();
  const Reconstruction plain = solved_on(black, 32, {}, papers_options(20));
  for (const double level : {20., 60.}) {
    Scene lit = black;
    for (View& view : lit.views)
      edit(view.image, [&](RadianceImage& image) {
        for (float& value : image.rgb) value += static_cast<float>(level);
      });
    Effects effects;
    effects.background = {Background::Kind::constant, {level, level, level}};
    const Reconstruction r = solved_on(lit, 32, effects, papers_options(20));
    EXPECT_NEAR(input_error(r), input_error(plain), 0.05) << level;
    EXPECT_NEAR(all_channels(*r.heldout_rmse), all_channels(*plain.heldout_rmse), 0.05) << level;
  }
}

TEST_P(PapersSolverSlow, ARunListsWhereItIsNotThePapers) {
  ReconstructOptions options;
  options.voxels = 12;
  options.solve = papers_options(2);
  const Scene scene = small_flame_scene();
  const auto outcome = value_of(reconstruct(scene, options, test::CountingClock()));
  const std::vector<std::string>& deviations = outcome.report.deviations;
  for (const char* words : {"starts at the hull", "length", "channels stop together", "voxel edges",
                            "sigma_G = 0.05", "1000 iterations"})
    EXPECT_THAT(deviations, Contains(HasSubstr(words)));
  EXPECT_EQ(nlohmann::json::parse(to_json(outcome.report))["deviations"].size(), deviations.size());
  options.solve.solver = Solver::standard;
  const auto ours = value_of(reconstruct(scene, options, test::CountingClock()));
  EXPECT_THAT(ours.report.deviations, IsEmpty());
}

}  // namespace
}  // namespace emberlock::recon
