// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_file.h"

#include <optional>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recon/synthetic/flame.h"

namespace emberlock::apply {
namespace {

using testing::HasSubstr;

std::string with_steps(const std::string& steps) {
  return R"({"format": "emberlock edits", "version": 1, "passes": 9, "steps": [)" + steps + "]}";
}

std::string refusal(const std::string& text) {
  const auto edits = parse_edits(text, "e.json", "");
  return edits ? "" : edits.error().message();
}

TEST(EditFile, WhatIsWrittenIsReadBackToTheBit) {
  EditFile edits;
  edits.passes = 7;
  edits.voxels = 33;
  edits.colours = Colours::captured;
  ObjectEdit object;
  object.view = "a";
  object.file = "o.png";
  object.hash = "0123456789abcdef";
  object.position = {1.0 / 3, -7e-5};
  object.rotation = 0.1;
  object.combine = Combine::add;
  edits.steps.push_back({1, object});
  edits.steps.push_back({2, BrushEdit{"b", {{0.1, 0.2}}, 3.3, BrushEdit::Mode::erase, 0}});
  edits.steps.push_back({2, ColourEdit{{{Kelvin(1500.1), {0.3, 0.1, 0.7}, 1.7}}}});
  edits.steps.push_back({5, Undo{}});
  const std::string text = to_json(edits);
  const auto again = parse_edits(text, "e.json", "");
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(to_json(*again), text);
  const auto& read = std::get<ObjectEdit>(again->steps[0].operation);
  EXPECT_EQ(read.position, object.position);
  EXPECT_EQ(read.rotation, object.rotation);
  EXPECT_EQ(std::get<ColourEdit>(again->steps[2].operation).curve[0].colour[2], 0.7);
}

TEST(EditFile, SaysWhereItCannotBeUsed) {
  const std::string region = R"("region": {"center": [0, 0, 0], "size": [1, 1, 1]})";
  const std::pair<std::string, std::string> cases[] = {
      {"{}", "format"},
      {R"({"format": "emberlock edits", "version": 2, "steps": []})", "version"},
      {with_steps(R"({"pass": 0, "op": "blur"})"), "steps[0].op"},
      {with_steps(R"({"pass": 0, "op": "undo"})"), "nothing to undo"},
      {with_steps(R"({"pass": 0, "op": "cut", )" + region + R"(}, {"pass": 0, "op": "redo"})"),
       "nothing to redo"},
      {with_steps(R"({"pass": 3, "op": "cut", )" + region + R"(}, {"pass": 2, "op": "undo"})"), "goes back"},
      {with_steps(R"({"pass": 10, "op": "cut", )" + region + "}"), "after the last pass"},
      {with_steps(R"({"pass": 0, "op": "cut", "x": 1, )" + region + "}"), "steps[0].x"},
      {with_steps(R"({"pass": 0, "op": "cut", "region": {"center": [0, 0, 0], "size": [1, 0, 1]}})"), "size"},
      {with_steps(R"({"pass": 0, "op": "brightness", )" + region + R"(, "factor": -1})"), "factor"},
      {with_steps(R"({"pass": 0, "op": "brightness", )" + region + R"(, "factor": 1e999})"), "e.json"},
      {with_steps(R"({"pass": 0, "op": "brush", "view": "a", "points": [], "radius": 2, "mode": "erase"})"),
       "points"},
      {with_steps(R"({"pass": 0, "op": "brush", "view": "a", "points": [[0, 0]], "radius": 2})"), "strength"},
      {with_steps(R"({"pass": 0, "op": "mask", "view": "a", "polygon": [[0, 0], [1, 1]], "part": "cut"})"),
       "polygon"},
      {with_steps(R"({"pass": 0, "op": "colour", "curve": [{"kelvin": 2000, "colour": [0, 0, 0]}]})"),
       "black"},
      {with_steps(
           R"({"pass": 0, "op": "colour", "curve": [{"kelvin": 2000, "colour": [1, 0, 0]}, {"kelvin": 2000, "colour": [1, 0, 0]}]})"),
       "rise"},
      {with_steps(
           R"({"pass": 0, "op": "object", "view": "a", "file": "o", "position": [0, 0], "hash": "1"})"),
       "hash"}};
  for (const auto& [text, words] : cases) EXPECT_THAT(refusal(text), HasSubstr(words)) << text;
}

TEST(EditFile, UndoTakesTheNewestThatStandsAndRedoGivesItBack) {
  const auto edits = parse_edits(
      with_steps(R"({"pass": 0, "op": "brush", "view": "1", "points": [[0, 0]], "radius": 1, "mode": "erase"},
          {"pass": 0, "op": "brush", "view": "2", "points": [[0, 0]], "radius": 1, "mode": "erase"},
          {"pass": 0, "op": "undo"}, {"pass": 0, "op": "undo"}, {"pass": 1, "op": "redo"},
          {"pass": 2, "op": "brush", "view": "3", "points": [[0, 0]], "radius": 1, "mode": "erase"})"),
      "e.json", "");
  ASSERT_TRUE(edits) << edits.error().message();
  const auto history = history_of(edits->steps);
  ASSERT_TRUE(history);
  ASSERT_EQ(history->standing.size(), 2U);
  EXPECT_EQ(std::get<BrushEdit>(*history->standing[0]).view, "1");
  EXPECT_EQ(std::get<BrushEdit>(*history->standing[1]).view, "3");
  EXPECT_TRUE(history->undone.empty());
  std::vector<Step> steps = edits->steps;
  steps.push_back({3, Redo{}});  // what was undone is forgotten once something else was done
  EXPECT_FALSE(history_of(steps));
}

TEST(EditFile, WhoMayNameNoFilesGivesPicturesInstead) {
  const GivenPictures given{"there/a.png", "there/b.png"};
  const auto foreign = [](const std::string& text, const std::optional<GivenPictures>& pictures) {
    return parse_foreign_operation(text, "step", pictures);
  };
  const std::string object = R"({"op": "object", "view": "1", "position": [1, 2])";
  const auto read = foreign(object + "}", given);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(std::get<ObjectEdit>(*read).file, given.file);
  EXPECT_EQ(std::get<ObjectEdit>(*read).mask, given.mask);
  for (const std::string key : {"file", "mask"}) {
    const auto named = foreign(object + ", \"" + key + "\": \"/etc/hostname\"}", given);
    ASSERT_FALSE(named);
    EXPECT_THAT(named.error().message(), HasSubstr("step: " + key + ": names a file"));
  }
  EXPECT_THAT(foreign(object + "}", {}).error().message(), HasSubstr("step: picture: is missing"));
  EXPECT_THAT(foreign(R"({"op": "undo"})", given).error().message(), HasSubstr("picture: is for objects"));
  EXPECT_TRUE(foreign(R"({"op": "undo"})", {}));
  EXPECT_THAT(foreign(R"({"op": "undo", "pass": 3})", {}).error().message(), HasSubstr("pass: isn't known"));
}

TEST(EditFile, OfAnotherSceneIsRefusedAndSaysWhatDiffers) {
  recon::PaperSceneOptions options;
  options.image = {24, 18};
  options.truth_voxels = 12;
  const recon::Scene scene = recon::paper_scene(options);
  EditFile edits;
  edits.scene = known_views(scene);
  EXPECT_TRUE(check_scene_of(edits, scene, "e.json"));
  const auto otherwise = [&](const recon::Scene& other) {
    const Status status = check_scene_of(edits, other, "e.json");
    return status ? std::string() : status.error().message();
  };
  recon::Scene other = scene;
  recon::RadianceImage image = *other.views[3].image;
  image.rgb[100] += 1;
  other.views[3].image = recon::share(std::move(image));
  EXPECT_THAT(otherwise(other), HasSubstr(scene.views[3].name + " has another picture"));
  other = scene;
  other.views[2].camera.camera_from_world.translation.x() += 1e-9;
  EXPECT_THAT(otherwise(other), HasSubstr("another camera"));
  other = scene;
  other.views.pop_back();
  EXPECT_THAT(otherwise(other), HasSubstr("views"));
}

}  // namespace
}  // namespace emberlock::apply
