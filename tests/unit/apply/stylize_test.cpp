// SPDX-License-Identifier: Apache-2.0
#include "apply/stylize.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/devices.h"
#include "tests/support/stylized_flame.h"

namespace emberlock::apply {
namespace {

using testing::HasSubstr;

void do_passes(Stylization& stylization, int passes) {
  for (int n = 0; n < passes; ++n) {
    const Status done = stylization.pass();
    ASSERT_TRUE(done) << done.error().message();
  }
}

void do_edit(Stylization& stylization, Operation operation) {
  const Status done = stylization.apply(std::move(operation));
  ASSERT_TRUE(done) << done.error().message();
}

/// A ball of light in the middle of the flame, as all input views would see it.
std::vector<ObjectEdit> ball_in_all_views(const recon::Scene& scene, const std::string& folder) {
  const auto file = test::write_object(test::folder_for(folder) / "ball.png", 32, [](double x, double y) {
    const double r = x * x + y * y;
    return r < 1 ? 200 * std::sqrt(1 - r) : 0;
  });
  std::vector<ObjectEdit> edits;
  for (const recon::View& view : scene.views) {
    if (view.role != recon::ViewRole::input) continue;
    ObjectEdit edit;
    edit.view = view.name;
    edit.file = file;
    edit.position = view.camera.project({0, 0, -0.02});
    const double away = (view.camera.center() - Eigen::Vector3d(0, 0, -0.02)).norm();
    edit.scale = 2 * view.camera.intrinsics.fx * 0.02 / away / 32;  // a radius of 2 cm
    edits.push_back(edit);
  }
  return edits;
}

double error_of(const Stylization& stylization, std::size_t view) {
  const recon::View& seen = stylization.scene().views[view];
  const recon::RadianceImage render = stylization.preview(stylization.shown(), view, seen.image->size.width);
  double squares = 0;
  for (std::size_t i = 0; i < render.rgb.size(); ++i)
    squares += std::pow(static_cast<double>(render.rgb[i] - seen.image->rgb[i]), 2);
  return std::sqrt(squares / static_cast<double>(render.rgb.size()));
}

double light_in(const recon::Volume& volume, const Region& region, bool inside) {
  const std::vector<std::uint8_t> dark = [&] {
    const Operation cut = RegionEdit{region, Part::cut};
    return dark_points(volume.grid, {&cut});
  }();
  double sum = 0;
  for (std::size_t p = 0; p < dark.size(); ++p)
    if ((dark[p] != 0) == inside)
      for (std::size_t c = 0; c < 3; ++c) sum += static_cast<double>(volume.emission[3 * p + c]);
  return sum;
}

const Region kSlab{Region::Shape::box, {0, 0, -0.01}, {0.2, 0.2, 0.03}, Meters(0)};

TEST(Stylization, AnObjectComesOutOfTheFlamePassByPass) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame);
  for (const ObjectEdit& edit : ball_in_all_views(flame.scene, "ball")) do_edit(*run, edit);
  do_passes(*run, 1);
  const double soon = error_of(*run, 0);
  do_passes(*run, 19);
  const double late = error_of(*run, 0);
  // What the volume as it was before shows of the edited picture.
  const auto before = test::begin_stylization(flame);
  const recon::RadianceImage was = before->preview(before->shown(), 0, 96);
  const recon::RadianceImage& asked = *run->scene().views[0].image;
  double squares = 0;
  for (std::size_t i = 0; i < was.rgb.size(); ++i)
    squares += std::pow(static_cast<double>(was.rgb[i] - asked.rgb[i]), 2);
  const double unedited = std::sqrt(squares / static_cast<double>(was.rgb.size()));
  EXPECT_LT(soon, 0.8 * unedited);
  EXPECT_LT(late, soon);
  EXPECT_LT(late, 0.5 * unedited);
}

TEST(Stylization, UndoGivesTheCapturedPictureBackToTheBit) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame);
  const std::string name = flame.scene.views[2].name;
  do_edit(*run, BrushEdit{name, {{48, 40}}, 9, BrushEdit::Mode::add, 80});
  do_passes(*run, 1);
  EXPECT_NE(run->scene().views[2].image->rgb, flame.scene.views[2].image->rgb);
  do_edit(*run, Undo{});
  do_passes(*run, 1);
  EXPECT_EQ(run->scene().views[2].image->rgb, flame.scene.views[2].image->rgb);
  do_edit(*run, Redo{});
  do_passes(*run, 1);
  EXPECT_NE(run->scene().views[2].image->rgb, flame.scene.views[2].image->rgb);
}

TEST(Stylization, ACutRegionIsDarkNothingMakesUpForItAndUndoGivesItsLightBack) {
  const auto run = test::begin_stylization(test::the_flame());
  do_passes(*run, 2);
  const recon::Volume before = run->shown().volume;
  const double inside = light_in(before, kSlab, true);
  const double outside = light_in(before, kSlab, false);
  ASSERT_GT(inside, 0.05 * outside);
  do_edit(*run, RegionEdit{kSlab, Part::cut});
  do_passes(*run, 10);
  EXPECT_EQ(light_in(run->shown().volume, kSlab, true), 0);
  EXPECT_NEAR(light_in(run->shown().volume, kSlab, false), outside, 0.02 * outside);
  do_edit(*run, Undo{});
  do_passes(*run, 1);
  EXPECT_NEAR(light_in(run->shown().volume, kSlab, true), inside, 0.05 * inside);
}

TEST(Stylization, LightBeyondTheFlameGrowsTheMediumWhereAllViewsAllowIt) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame);
  const Eigen::Vector3d beside(0.07, 0, 0.05);
  const Region there{Region::Shape::ellipsoid, beside, {0.03, 0.03, 0.03}, Meters(0)};
  const double before = light_in(run->shown().volume, there, true);
  for (const recon::View& view : flame.scene.views)
    if (view.role == recon::ViewRole::input)
      do_edit(*run, BrushEdit{view.name, {view.camera.project(beside)}, 5, BrushEdit::Mode::add, 120});
  do_passes(*run, 10);
  EXPECT_GT(run->shown().hull.count, flame.outcome.reconstruction.hull.count);
  EXPECT_GT(light_in(run->shown().volume, there, true),
            before + 0.02 * light_in(run->shown().volume, there, false));
}

TEST(Stylization, EditsMoveLightAndLeaveAReconstructedExtinctionAsItIs) {
  const test::ReconstructedFlame flame = test::reconstructed_flame({64, 48}, 20, 2, "extinction=field");
  const std::vector<float>& before = flame.outcome.reconstruction.volume.extinction;
  ASSERT_FALSE(before.empty());
  const auto run = test::begin_stylization(flame);
  const double inside = light_in(run->shown().volume, kSlab, true);
  do_edit(*run, BrushEdit{flame.scene.views[0].name, {{32, 26}}, 5, BrushEdit::Mode::erase, 0});
  do_edit(*run, RegionEdit{kSlab, Part::cut});
  do_passes(*run, 2);
  EXPECT_EQ(light_in(run->shown().volume, kSlab, true), 0);
  do_edit(*run, Undo{});
  do_passes(*run, 1);
  EXPECT_GT(light_in(run->shown().volume, kSlab, true), 0.5 * inside);
  const std::vector<float> after = run->shown().volume.extinction;
  for (std::size_t p = 0; p < before.size(); ++p) EXPECT_NEAR(after[p], before[p], 1e-5F * before[p]) << p;
}

TEST(Stylization, GoesDarkWhereAllPicturesAreMaskedOut) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame);
  for (const recon::View& view : flame.scene.views)
    if (view.role == recon::ViewRole::input)
      do_edit(*run, MaskEdit{view.name, {{-1, -1}, {200, -1}, {200, 200}, {-1, 200}}, Part::cut});
  const double before = light_in(run->shown().volume, kSlab, true);
  do_passes(*run, 12);
  EXPECT_LT(light_in(run->shown().volume, kSlab, true), 0.1 * before);
}

/// Edits of every kind while it runs.
void edit_live(Stylization& run, const recon::Scene& scene) {
  for (const ObjectEdit& edit : ball_in_all_views(scene, "live")) do_edit(run, edit);
  do_passes(run, 3);
  do_edit(run, RegionEdit{kSlab, Part::cut});
  do_edit(run, BrushEdit{scene.views[1].name, {{40, 30}, {50, 50}}, 6, BrushEdit::Mode::erase, 0});
  do_passes(run, 2);
  do_edit(run, Undo{});
  do_edit(run, Undo{});
  do_passes(run, 1);
  do_edit(run, Redo{});
  do_edit(run, BrightnessEdit{kSlab, 1.5});
  do_edit(run, ColourEdit{{{Kelvin(1500), {1, 0.5, 0}, 1}, {Kelvin(2300), {0, 0.5, 1}, 1}}});
  do_passes(run, 2);
}

TEST(Stylization, ReplaysToTheSameBitsWithAnyNumberOfThreads) {
  const test::ReconstructedFlame live = test::reconstructed_flame({64, 48}, 20, 2);
  const auto run = test::begin_stylization(live, Colours::flame);
  edit_live(*run, live.scene);
  const recon::Volume shown = run->shown().volume;
  const auto file = parse_edits(to_json(run->record()), "edits.json", "");
  ASSERT_TRUE(file) << file.error().message();
  for (const int threads : {1, 2}) {
    const test::ReconstructedFlame again = test::reconstructed_flame({64, 48}, 20, threads);
    ASSERT_TRUE(check_edits(*file, again.scene, "edits.json"));
    const auto replay = test::begin_stylization(again, file->colours, threads);
    for (const Step& step : file->steps) {
      do_passes(*replay, step.pass - replay->passes());
      do_edit(*replay, step.operation);
    }
    do_passes(*replay, file->passes - replay->passes());
    EXPECT_EQ(replay->shown().volume.emission, shown.emission) << threads;
    EXPECT_EQ(replay->shown().volume.extinction, shown.extinction);
    EXPECT_EQ(to_json(replay->record()), to_json(run->record()));
  }
}

TEST(Stylization, OtherDevicesShowTheSameWithinRounding) {
  const test::ReconstructedFlame flame = test::reconstructed_flame({64, 48}, 20, 2);
  const auto here = test::begin_stylization(flame);
  edit_live(*here, flame.scene);
  const recon::Volume by_cpu = here->shown().volume;
  const float brightest = *std::max_element(by_cpu.emission.begin(), by_cpu.emission.end());
  for (const recon::Device device : other_devices()) {
    recon::SolveOptions options = test::stylize_options();
    options.compute.device = device;
    const auto there = Stylization::begin(flame.scene, flame.outcome, options, Colours::captured,
                                          recon::standard_response());
    ASSERT_TRUE(there) << there.error().message();
    edit_live(**there, flame.scene);
    const recon::Volume by_gpu = (*there)->shown().volume;
    for (std::size_t i = 0; i < by_cpu.emission.size(); ++i)
      EXPECT_NEAR(by_gpu.emission[i], by_cpu.emission[i], 0.02F * brightest) << i;
  }
}

TEST(Stylization, WhatCannotBeDoneIsRefusedAndChangesNothing) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame);
  const auto refusal = [&](Operation operation) {
    const Status status = run->apply(std::move(operation));
    return status ? std::string() : status.error().message();
  };
  const auto brush_in = [](const std::string& view) {
    return BrushEdit{view, {{1, 1}}, 2, BrushEdit::Mode::erase, 0};
  };
  EXPECT_THAT(refusal(brush_in("nowhere")), HasSubstr("no view"));
  EXPECT_THAT(refusal(brush_in(flame.scene.views.back().name)), HasSubstr("held out"));
  EXPECT_THAT(refusal(Undo{}), HasSubstr("nothing to undo"));
  ObjectEdit object;
  object.view = flame.scene.views[0].name;
  object.file = "no/such.png";
  EXPECT_THAT(refusal(object), HasSubstr("no/such.png"));
  EXPECT_TRUE(run->record().steps.empty());
  EditFile file;
  file.steps.push_back({0, object});
  EXPECT_THAT(check_edits(file, flame.scene, "e.json").error().message(), HasSubstr("e.json: steps[0]"));
}

TEST(Stylization, TheOutcomeIsAsShownAndItsReportOfTheEditedPictures) {
  const test::ReconstructedFlame& flame = test::the_flame();
  const auto run = test::begin_stylization(flame, Colours::flame);
  do_edit(*run, RegionEdit{kSlab, Part::cut});
  do_passes(*run, 1);
  do_edit(*run, BrightnessEdit{kSlab, 3});
  const auto outcome = run->outcome();
  ASSERT_TRUE(outcome) << outcome.error().message();
  const EditedVolume shown = run->shown();
  EXPECT_EQ(outcome->reconstruction.volume.emission, shown.volume.emission);
  EXPECT_EQ(outcome->temperature->kelvin, shown.kelvin);
  EXPECT_EQ(outcome->renders.size(), flame.scene.views.size());
  EXPECT_EQ(outcome->report.views.size(), flame.scene.views.size());
}

}  // namespace
}  // namespace emberlock::apply
