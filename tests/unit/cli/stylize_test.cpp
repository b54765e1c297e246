// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "apply/edit_file.h"
#include "base/file.h"
#include "cli/commands.h"
#include "cli/line_reader.h"
#include "recon/export/volume_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/stylized_flame.h"
#include "tests/support/typed_input.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class StylizeVerb : public testing::Test {
 protected:
  StylizeVerb() : folder_(test::folder_for("verb")) {
    recon::PaperSceneOptions options;
    options.image = {48, 36};
    options.truth_voxels = 16;
    EXPECT_TRUE(test::write_scene(recon::paper_scene(options), folder_ / "scene").ok());
    test::write_object(folder_ / "ball.png", 32,
                       [](double x, double y) { return x * x + y * y < 1 ? 200 : 0; });
  }
  [[nodiscard]] fs::path edits(const std::string& further = "") const {
    std::ofstream(folder_ / "edits.json")
        << R"({"format": "emberlock edits", "version": 1, "voxels": 12, "passes": 3, "steps": [
            {"pass": 0, "op": "object", "view": "VIEW", "file": "ball.png", "position": [24, 18], "scale": 0.5},
            {"pass": 1, "op": "cut", "region": {"center": [0, 0, 0.05], "size": [0.2, 0.2, 0.02]}})"
        << further << "]}";
    std::string text = *read_file(folder_ / "edits.json");
    text.replace(text.find("VIEW"), 4, view_);
    std::ofstream(folder_ / "edits.json") << text;
    return folder_ / "edits.json";
  }
  [[nodiscard]] test::VerbRun run(const std::vector<std::string>& further) const {
    std::vector<std::string> words = {"stylize",     (folder_ / "scene" / "transforms.json").string(),
                                      "--out",       out_.string(),
                                      "--effects",   "none",
                                      "--device",    "cpu",
                                      "--keep-poses"};
    words.insert(words.end(), further.begin(), further.end());
    return test::run_verb(add_stylize, words);
  }

  fs::path folder_;
  fs::path out_ = folder_ / "out";
  std::string view_ = "view0.png";
};

TEST_F(StylizeVerb, WritesTheResultAndAFileThatReplaysToTheSameBits) {
  const test::VerbRun first = run({"--edits", edits().string(), "--previews"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  for (const char* name : {"volume.vdb", "report.json", "report.html", "edits.json", "views/0000.png",
                           "previews/0001.png", "previews/0003.png", "edited/0000.png"})
    EXPECT_TRUE(fs::exists(out_ / name)) << name;
  const fs::path recorded = out_ / "edits.json";
  const auto volume = recon::read_volume(out_ / "volume.vdb");
  ASSERT_TRUE(volume);
  EXPECT_TRUE(recon::read_grid(out_ / "volume.vdb", "temperature"));
  out_ = folder_ / "again";
  fs::remove(folder_ / "ball.png");  // the result has its own
  const test::VerbRun second = run({"--edits", recorded.string()});
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(recon::read_volume(out_ / "volume.vdb")->emission, volume->emission);
}

TEST_F(StylizeVerb, RefusesAnotherScenesEditsAndWritesNothing) {
  ASSERT_EQ(run({"--edits", edits().string()}).exit_code, 0);
  const fs::path recorded = out_ / "edits.json";
  recon::PaperSceneOptions options;
  options.image = {48, 36};
  options.truth_voxels = 16;
  options.flame.seed = 2;
  ASSERT_TRUE(test::write_scene(recon::paper_scene(options), folder_ / "scene").ok());
  out_ = folder_ / "other";
  const test::VerbRun refused = run({"--edits", recorded.string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("another scene"));
  EXPECT_FALSE(fs::exists(out_));
}

TEST_F(StylizeVerb, SaysWhichStepCannotBeDone) {
  view_ = "nowhere.png";
  const test::VerbRun refused = run({"--edits", edits().string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("steps[0]"));
  EXPECT_FALSE(fs::exists(out_));
}

TEST_F(StylizeVerb, TakesStepsWhileItRunsAndRecordsThoseThatCouldBeDone) {
  const test::TypedInput typed(
      R"({"op": "brush", "view": "view1.png", "points": [[20, 20]], "radius": 4, "mode": "add", "strength": 50}
{"op": "brush"}
{"op": "undo"}
{"op": "undo"})");
  const test::VerbRun live = run({"--live", "--voxels", "12", "--passes", "2"});
  ASSERT_EQ(live.exit_code, 0) << live.err;
  EXPECT_THAT(live.out, HasSubstr(R"({"pass":2,)"));
  EXPECT_THAT(live.out, HasSubstr(R"("lines":4})"));
  EXPECT_THAT(live.err, HasSubstr("line 2 is left out"));
  EXPECT_THAT(live.err, HasSubstr("line 4 is left out"));
  const auto recorded = apply::read_edits(out_ / "edits.json");
  ASSERT_TRUE(recorded) << recorded.error().message();
  EXPECT_EQ(recorded->steps.size(), 2U);
  EXPECT_EQ(recorded->passes, 2);
}

TEST(LineReader, GivesFinishedLinesAndTheLastOneAtTheEnd) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  LineReader lines(ends[0]);
  EXPECT_TRUE(lines.take().empty());
  const auto send = [&](const std::string& text) {
    EXPECT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  };
  send("one\n\ntw");
  EXPECT_THAT(lines.take(), testing::ElementsAre("one"));
  EXPECT_FALSE(lines.ended());
  send("o\nthree");
  ::close(ends[1]);
  EXPECT_THAT(lines.take(), testing::ElementsAre("two", "three"));
  EXPECT_TRUE(lines.ended());
  ::close(ends[0]);
}

}  // namespace
}  // namespace emberlock::cli
