// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/adjust/picture_error.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/advice.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"
#include "session/media/frame_file.h"
#include "tests/support/ball_scene.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/pictures.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(Reconstruct);
namespace fs = std::filesystem;
using testing::HasSubstr;

/// Seven cameras on a circle of 0.5 m around a Gaussian ball of light (sigma 2 cm) in a 20 cm box: every
/// picture is known in closed form, a line integral through the ball being a Gaussian of the ray's distance
/// from its centre.
Scene ball(int cameras = 7) {
  constexpr double kSigma = 0.02;
  constexpr double kPeak = 200;
  Scene scene;
  scene.box.size = {0.2, 0.2, 0.2};
  for (int i = 0; i < cameras; ++i) {
    const double angle = 2.4 * i;
    View view;
    view.name = "camera " + std::to_string(i);
    view.camera =
        look_at({{80, 60}, 100, 100, 40, 30, {}},
                {0.5 * std::cos(angle), 0.5 * std::sin(angle), 0.1 * std::sin(3 * angle)}, {0, 0, 0});
    view.image = share(radiance_of({80, 60}, [&](int x, int y, int c) {
      const Ray ray = view.camera.ray({x + 0.5, y + 0.5});
      const double closest = ray.origin.cross(ray.direction).norm();
      return kPeak * std::exp(-closest * closest / (2 * kSigma * kSigma)) / (c + 1);
    }));
    scene.views.push_back(std::move(view));
  }
  return scene;
}

ReconstructOptions quick() {
  ReconstructOptions options;
  options.voxels = 24;
  options.effects = EffectRequest{Effects{}};
  return options;
}

Result<Outcome> run(const Scene& scene, const ReconstructOptions& options) {
  return reconstruct(scene, options, test::CountingClock());
}
Outcome outcome_of(const Scene& scene, const ReconstructOptions& options) {
  return value_of(run(scene, options));
}

TEST(GridChoice, ThePapersRuleOnAFrontalView) {
  // An edge of 0.2 m, 0.4 m in front of the camera, covers 100 * 0.2 / 0.4 = 50 pixels: 50 / 1.5 voxels.
  Scene scene = ball(1);
  scene.views[0].camera = look_at({{80, 60}, 100, 100, 40, 30, {}}, {0.5, 0, 0}, {0, 0, 0});
  EXPECT_EQ(voxels_by_the_paper(scene), 34);
}

TEST(GridChoice, AThinBoxIsSampledAlongItsThinSide) {
  Scene scene = ball(1);
  scene.views[0].camera = look_at({{80, 60}, 100, 100, 40, 30, {}}, {0.5, 0, 0}, {0, 0, 0});
  scene.box.size.z() = 0.8;
  EXPECT_GE(voxels_by_the_paper(scene), 4 * 33);
}

TEST(GridChoice, SharpPicturesAreCappedAndACameraInsideDecidesNothing) {
  Scene scene = ball(1);
  scene.views[0].camera.intrinsics.fx = 1e5;
  EXPECT_EQ(voxels_by_the_paper(scene), kLargestVoxels);
  EXPECT_EQ(finest_voxels(scene), kLargestChosenVoxels);
  scene.views[0].camera = look_at({{80, 60}, 100, 100, 40, 30, {}}, {0.01, 0, 0}, {0, 0, 0});
  EXPECT_LE(voxels_by_the_paper(scene), kLargestChosenVoxels);
}

/// n_max / alpha of the paper's words for one camera, written down apart from grid_choice.cpp: the box's
/// corners by the pinhole's own formula, the twelve edges between corners that differ in one coordinate.
double most_voxels_of(const View& view, const Box& box) {
  const Intrinsics& lens = view.camera.intrinsics;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector2d>> corners;
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) {
        const Eigen::Vector3d side(x, y, z);
        const Eigen::Vector3d p = view.camera.camera_from_world * (box.center + side.cwiseProduct(box.size));
        corners.emplace_back(side, Eigen::Vector2d(lens.fx * p.x() / p.z(), lens.fy * p.y() / p.z()));
      }
  double most = 0;
  int edges = 0;
  for (const auto& [a, at_a] : corners)
    for (const auto& [b, at_b] : corners) {
      if (((a - b).array() != 0).count() != 1) continue;
      ++edges;
      most = std::max(most, (at_a - at_b).cwiseAbs().maxCoeff());
    }
  EXPECT_EQ(edges, 2 * 12) << "each one from both ends";
  return most / 1.5;
}

TEST(GridChoice, ThePapersRuleOnThePapersOwnScene) {
  PaperSceneOptions film;
  film.truth_voxels = 8;
  const Scene scene = paper_scene(film);
  double least = 1e9;
  double most = 0;
  for (const View& view : scene.views) {
    if (view.role != ViewRole::input) continue;
    const double voxels = most_voxels_of(view, scene.box);
    least = std::min(least, voxels);
    most = std::max(most, voxels);
  }
  EXPECT_NEAR(least, 401.3, 0.05);
  EXPECT_NEAR(most, 441.3, 0.05);
  EXPECT_EQ(voxels_by_the_paper(scene), 442);
  EXPECT_EQ(finest_voxels(scene), 256);
}

TEST(Coverage, WarnsWhereTheInputErrorProvesNothing) {
  Scene scene = ball(8);
  scene.views[3].role = ViewRole::held_out;
  EXPECT_TRUE(coverage_warnings(scene).empty());
  scene.views[3].role = ViewRole::input;
  ASSERT_EQ(coverage_warnings(scene).size(), 1U);
  EXPECT_THAT(coverage_warnings(scene)[0], HasSubstr("no view is held out"));
  EXPECT_THAT(coverage_warnings(ball(1))[0], HasSubstr("the 1 input view lie"));
  EXPECT_THAT(coverage_warnings(ball(3))[0], HasSubstr("only 3 input views"));
}

TEST(Coverage, TwoOppositeViewsCountAsOne) {
  Scene scene = ball(2);
  const Intrinsics lens = scene.views[0].camera.intrinsics;
  scene.views[0].camera = look_at(lens, {0.5, 0, 0}, {0, 0, 0});
  scene.views[1].camera = look_at(lens, {-0.5, 0, 0}, {0, 0, 0});
  EXPECT_THAT(coverage_warnings(scene)[0], HasSubstr("degrees of one line"));
}

TEST(Coverage, TenViewsWithinTenDegrees) {
  Scene scene = ball(10);
  for (std::size_t i = 0; i < 10; ++i) {
    const double angle = 0.017 * static_cast<double>(i);
    scene.views[i].camera = look_at(scene.views[i].camera.intrinsics,
                                    {0.5 * std::cos(angle), 0.5 * std::sin(angle), 0}, {0, 0, 0});
  }
  EXPECT_THAT(coverage_warnings(scene)[0], HasSubstr("within 9 degrees of one line"));
}

Report report_of_errors(const std::vector<double>& errors) {
  Report report;
  report.heldout_rmse = ChannelRmse{};
  report.solve_time = Seconds(2);
  int i = 0;
  for (const double e : errors) report.trace.push_back({Seconds(i), ++i, {0, 0, 0}, {e, e, e}});
  return report;
}

TEST(Advice, ExtrapolatesAGeometricDecay) {
  // Each half of the run gains half of what the half before gained: 4, then 2, so 1 is left at most.
  const std::string advice = next_step(report_of_errors({20, 12, 8, 7, 6}));
  EXPECT_THAT(advice, HasSubstr("about 2 s"));
  EXPECT_THAT(advice, HasSubstr("at most about 1"));
}

TEST(Advice, SaysWhichIterationWasKeptAndWhatTheLastOneReached) {
  Report report = report_of_errors({20, 10, 5});
  EXPECT_EQ(what_was_kept(report), "");
  report.discarded = {{Seconds(3), 4, {}, {6, 6, 6}}, {Seconds(4), 5, {}, {7, 7, 7}}};
  report.iterations = 5;
  report.kept = {3, KeptBy::held_out};
  EXPECT_THAT(what_was_kept(report), HasSubstr("after iteration 3 of 5"));
  EXPECT_THAT(what_was_kept(report), HasSubstr("lowest (5.00), and at the end it was 7.00"));
  EXPECT_THAT(what_was_kept(report), HasSubstr("7.00 is the error that is free of their choice"));
  EXPECT_THAT(next_step(report), HasSubstr("more iterations don't help"));
  report.kept.by = KeptBy::input;
  EXPECT_THAT(what_was_kept(report), HasSubstr("the input error was lowest"));
}

TEST(Advice, AGoalIsMetOrItSaysWhatWasReachedAndWhatWouldDo) {
  Report report = report_of_errors({20, 8});
  report.total_time = Seconds(10.4);
  SolveOptions asked;
  EXPECT_TRUE(goals_met(asked, report).ok());
  asked.target_rmse = 8;
  asked.budget = Seconds(10);
  EXPECT_TRUE(goals_met(asked, report).ok()) << "a run ends between iterations";
  asked.target_rmse = 7.5;
  report.plan.emplace().remedy = "more views would";
  const Status missed = goals_met(asked, report);
  ASSERT_FALSE(missed.ok());
  EXPECT_NE(missed.error().kind, ErrorKind::bad_input) << "exit code 1";
  EXPECT_THAT(missed, FailsWith("8.00 grey levels, 0.50 above the target of 7.5", "More views would"));
  asked.target_rmse.reset();
  report.total_time = Seconds(12);
  const Status late = goals_met(asked, report);
  ASSERT_FALSE(late.ok());
  EXPECT_THAT(late, FailsWith("12.00 s, 2.00 s more than the budget of 10 s"));
}

TEST(Advice, FromAShortTraceTheLastIterationIsTheBound) {
  const std::string advice = next_step(report_of_errors({20, 19}));
  EXPECT_THAT(advice, HasSubstr("one more iteration costs about 1 s"));
  EXPECT_THAT(advice, HasSubstr("(19.00) by at most about 1"));
  EXPECT_EQ(next_step(report_of_errors({20})), "");
}

TEST_P(Reconstruct, AKnownBallOfLightIsFound) {
  Scene scene = ball();
  scene.views[2].role = ViewRole::held_out;
  const Outcome outcome = outcome_of(scene, quick());
  const Report& report = outcome.report;
  ASSERT_TRUE(report.heldout_rmse);
  EXPECT_LT((*report.heldout_rmse)[0], 6) << "of a peak of 200, on voxels of 8 mm";
  EXPECT_LT((*report.heldout_rmse)[2], 2);
  EXPECT_LT(report.input_rmse[0], 6);
  EXPECT_EQ(report.voxels, (std::array{24, 24, 24}));
  EXPECT_EQ(report.views.size(), 7U);
  EXPECT_EQ(outcome.renders.size(), 7U);
  EXPECT_GT(report.hull_voxels, 0U);
  EXPECT_GT(report.total_time.value(), 0);
  // The centre's emission in closed form: peak / (sigma sqrt(2 pi)) grey levels per metre.
  const Volume& volume = outcome.reconstruction.volume;
  const double centre = static_cast<double>(volume.emission[3 * volume.grid.index(12, 12, 12)]);
  EXPECT_NEAR(centre, 200 / (0.02 * std::sqrt(2 * M_PI)), 0.15 * 200 / (0.02 * std::sqrt(2 * M_PI)));
}

TEST_P(Reconstruct, TheReportsErrorIsThatOfTheLastTracePoint) {
  Scene scene = ball();
  scene.views[0].role = ViewRole::held_out;
  const Outcome outcome = outcome_of(scene, quick());
  ASSERT_FALSE(outcome.report.trace.empty());
  // The solver may return an earlier state than its last: the best of the trace, then.
  double best = INFINITY;
  for (const auto& point : outcome.report.trace) best = std::min(best, all_channels(point.heldout_rmse));
  EXPECT_NEAR(all_channels(*outcome.report.heldout_rmse), best, 0.2 * best + 0.05);
}

/// Four noisy views: iterations that fit their noise show a fifth view worse and worse.
TEST_P(Reconstruct, TheBestIterationIsKeptThoughALaterOneIsTheLast) {
  BallOptions noisy;
  noisy.views = 4;
  noisy.image = {96, 72};
  noisy.noise = 8;
  const Scene scene = ball_scene(noisy);
  ReconstructOptions options = quick();
  options.voxels = 40;
  options.solve.smoothness = 0;
  options.solve.iterations = 60;
  for (const Solver solver : {Solver::standard, Solver::paper}) {
    SCOPED_TRACE(name(solver));
    options.solve.solver = solver;
    const Outcome outcome = outcome_of(scene, options);
    const Report& report = outcome.report;
    EXPECT_EQ(report.trace.back().iteration, report.kept.iteration);
    if (solver == Solver::paper) continue;  // is regular enough to end here with its best
    EXPECT_EQ(report.iterations, 60);
    ASSERT_EQ(report.kept.by, KeptBy::held_out);
    ASSERT_LT(report.kept.iteration, 60);
    ASSERT_FALSE(report.discarded.empty());
    EXPECT_EQ(report.discarded.back().iteration, 60);
    const double kept = all_channels(report.trace.back().heldout_rmse);
    EXPECT_GT(all_channels(report.discarded.back().heldout_rmse), (1 + kRiseThatCounts) * kept);
    EXPECT_NEAR(all_channels(*report.heldout_rmse), kept, 0.02 * kept) << "of the volume that is written";

    ReconstructOptions fewer = options;
    fewer.solve.iterations = report.kept.iteration;
    const Outcome same = outcome_of(scene, fewer);
    EXPECT_EQ(same.report.kept.by, KeptBy::last);
    EXPECT_EQ(same.reconstruction.volume.emission, outcome.reconstruction.volume.emission);
    EXPECT_EQ(same.report.input_rmse, report.input_rmse);
  }
}

TEST_P(Reconstruct, ToldToStopItEndsWithTheBestSoFar) {
  ReconstructOptions options = quick();
  options.solve.iterations = 100000;
  int asked = 0;
  options.solve.stop = [&] { return ++asked > 40; };
  const Outcome outcome = outcome_of(ball(), options);
  EXPECT_TRUE(outcome.report.stopped);
  EXPECT_LT(outcome.report.iterations, 100);
  EXPECT_EQ(outcome.renders.size(), ball().views.size());
  options.solve.stop = {};
  options.solve.iterations = 2;
  EXPECT_FALSE(run(ball(), options)->report.stopped);
}

TEST_P(Reconstruct, ThePapersSolverTakesThePapersOpacityUnlessToldOtherwise) {
  ReconstructOptions options = quick();
  options.solve.solver = Solver::paper;
  options.solve.iterations = 12;
  options.effects.reset();
  const Outcome published = outcome_of(ball(), options);
  const double edge = published.report.voxel_edge.value();
  EXPECT_NEAR(published.reconstruction.effects.extinction.value.value() * edge, -std::log(0.95), 1e-6);
  ASSERT_FALSE(published.report.effects.empty());
  EXPECT_THAT(published.report.effects[0].reason, HasSubstr("paper"));
  options.effects = EffectRequest{Effects{}};
  const Outcome told = outcome_of(ball(), options);
  EXPECT_EQ(told.reconstruction.effects.extinction.value.value(), 0);
}

TEST_P(Reconstruct, BlackViewsAreNamedWithTheRemedy) {
  Scene scene = ball();
  for (std::size_t v = 1; v < scene.views.size(); ++v) scene.views[v].image = share(RadianceImage({80, 60}));
  const auto outcome = run(scene, quick());
  ASSERT_THAT(outcome, FailsWith("camera 1"));
  EXPECT_EQ(outcome.error().kind, ErrorKind::not_converged);
  EXPECT_FALSE(outcome.error().remedy.empty());
}

TEST_P(Reconstruct, ATargetWithoutAHeldOutViewIsRefused) {
  ReconstructOptions options = quick();
  options.solve.target_rmse = 3;
  EXPECT_EQ(run(ball(), options).error().kind, ErrorKind::bad_input);
}

TEST_P(Reconstruct, ATargetOnTheHeldOutErrorEndsTheRunEarly) {
  Scene scene = ball();
  scene.views[0].role = ViewRole::held_out;
  const auto full = run(scene, quick());
  ReconstructOptions options = quick();
  options.solve.target_rmse = 40;
  const Outcome early = outcome_of(scene, options);
  EXPECT_LE(all_channels(*early.report.heldout_rmse), 40);
  EXPECT_LT(early.report.iterations, full->report.iterations);
}

TEST_P(Reconstruct, ABudgetEndsTheRunWithTheBestSoFar) {
  ReconstructOptions options = quick();
  options.solve.iterations = 100000;
  options.solve.budget = Seconds(0.03);  // thirty looks at the clock
  const Outcome outcome = outcome_of(ball(), options);
  EXPECT_LT(outcome.report.iterations, 100);
}

TEST_P(Reconstruct, VoxelsOutOfRangeAndNonFinitePicturesAreRefused) {
  ReconstructOptions options = quick();
  for (const int voxels : {0, -1, kLargestVoxels + 1}) {
    options.voxels = voxels;
    EXPECT_EQ(run(ball(), options).error().where, "--voxels");
  }
  Scene scene = ball();
  edit(scene.views[4].image, [](RadianceImage& image) { image.rgb[100] = NAN; });
  EXPECT_THAT(run(scene, quick()), FailsWith("camera 4"));
}

TEST_P(Reconstruct, OneVoxelExplainsTooLittle) {
  ReconstructOptions options = quick();
  options.voxels = 1;
  EXPECT_THAT(run(ball(), options), FailsWith("less than a tenth of the light"));
}

class OutcomeTest : public OnEachDevice {
 protected:
  void SetUp() override {
    Scene scene = ball(5);
    scene.views[4].role = ViewRole::held_out;
    ReconstructOptions options = quick();
    options.voxels = 8;
    outcome_ = outcome_of(scene, options);
  }
  const test::TempFolder folder_;
  const fs::path root_ = folder_.path();
  Outcome outcome_;
};

INSTANTIATE_TEST_SUITE_P(Devices, OutcomeTest, testing::ValuesIn(every_device()),
                         [](const auto& on) { return device_name(on.param); });

TEST_P(OutcomeTest, EveryViewIsWrittenHeldOutOnesToo) {
  ASSERT_TRUE(write_outcome(outcome_, root_ / "out").ok());
  for (const char* name : {"0000.png", "0001.png", "0002.png", "0003.png", "0004.png"}) {
    const auto view = value_of(session::read_image(root_ / "out" / "views" / name));
    EXPECT_EQ(view.layout().size, (ImageSize{80, 60}));
  }
  const auto volume = value_of(read_volume(root_ / "out" / "volume.vdb"));
  EXPECT_EQ(volume.emission, outcome_.reconstruction.volume.emission);
  std::ifstream in(root_ / "out" / "report.json");
  EXPECT_TRUE(nlohmann::json::parse(in).contains("heldout_rmse"));
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), {}), 1) << "nothing partial stays beside it";
}

TEST_P(OutcomeTest, AnEarlierResultIsReplacedAnotherFolderIsNot) {
  ASSERT_TRUE(write_outcome(outcome_, root_ / "out").ok());
  EXPECT_TRUE(check_output(root_ / "out").ok());
  EXPECT_TRUE(write_outcome(outcome_, root_ / "out").ok());
  fs::create_directories(root_ / "thesis");
  std::ofstream(root_ / "thesis" / "chapter.tex") << "x";
  EXPECT_FALSE(check_output(root_ / "thesis").ok());
  EXPECT_FALSE(write_outcome(outcome_, root_ / "thesis").ok());
  EXPECT_TRUE(fs::exists(root_ / "thesis" / "chapter.tex"));
}

TEST_P(OutcomeTest, AFailureLeavesNothingBehind) {
  outcome_.renders[2] = RadianceImage();  // no picture can be encoded from it
  EXPECT_FALSE(write_outcome(outcome_, root_ / "out").ok());
  EXPECT_TRUE(fs::is_empty(root_));
}

}  // namespace
}  // namespace emberlock::recon
