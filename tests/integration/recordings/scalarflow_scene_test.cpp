// SPDX-License-Identifier: Apache-2.0
// The same real smoke from its pictures to a scene: reconstructed as lit, shown by `render` and in a scene.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "cli/commands.h"
#include "tests/support/recording.h"
#include "tests/support/recordings.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

class ScalarFlowScene : public testing::Test {
 protected:
  static void SetUpTestSuite() { setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1); }
  void reconstruct(const std::string& effects) const {
    const auto done = test::run_verb(
        add_reconstruct,
        {"reconstruct", (test::recordings() / "scalarflow" / "transforms.json").string(), "--voxels", "48",
         "--effects", effects, "--device", "cpu", "--out", (temp_ / "smoke").string()});
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }
  [[nodiscard]] test::VerbRun draw(test::AddVerb verb, std::vector<std::string> words,
                                   const std::string& out) const {
    words.insert(words.end(), {"--image", "120x200", "--format", "exr", "--out", (temp_ / out).string()});
    return test::run_verb(verb, std::move(words));
  }
  /// Of the smoke alone, with what else is told of it and of the scene.
  [[nodiscard]] test::VerbRun draw_scene(const std::string& flame, const std::string& rest) const {
    std::ofstream(temp_ / "scene.json")
        << R"({"format": "emberlock scene", "version": 1, "flames": [{"result": "smoke")" << flame
        << R"(}], "camera": {"from": [2.5, 0.5, 0.8], "look_at": [0.3, 0.3, 0.5]})" << rest << "}";
    return draw(add_scene, {"scene", (temp_ / "scene.json").string()}, "scene");
  }
  [[nodiscard]] test::VerbRun render(std::vector<std::string> words = {}) const {
    words.insert(words.begin(), {"render", (temp_ / "smoke").string(), "--camera", "2.5,0.5,0.8", "--look-at",
                                 "0.3,0.3,0.5", "--up", "z", "--device", "cpu"});
    return draw(add_render, std::move(words), "rendered");
  }
  /// Of the two pictures, of the brightest pixel.
  struct Difference {
    double largest, rms;
  };
  [[nodiscard]] Difference difference() const {
    const cv::Mat a = cv::imread((temp_ / "rendered/frame-0000.exr").string(), cv::IMREAD_UNCHANGED);
    const cv::Mat b = cv::imread((temp_ / "scene/frame-0000.exr").string(), cv::IMREAD_UNCHANGED);
    double most = 0;
    double brightest = 0;
    double squares = 0;
    EXPECT_EQ(a.size(), b.size());
    for (int y = 0; y < a.rows; ++y)
      for (int x = 0; x < a.cols; ++x)
        for (int c = 0; c < 3; ++c) {
          const auto at = [&](const cv::Mat& m) {
            return static_cast<double>(m.ptr<float>(y)[x * m.channels() + c]);
          };
          const double off = std::abs(at(a) - at(b));
          most = std::max(most, off);
          squares += off * off;
          brightest = std::max(brightest, at(a));
        }
    const Difference found{most / brightest, std::sqrt(squares / (3.0 * a.rows * a.cols)) / brightest};
    std::printf("largest difference %.2g of the brightest pixel (%.1f grey levels), RMS %.2g\n",
                found.largest, 255 * brightest, found.rms);
    EXPECT_GT(brightest, 0.1);
    return found;
  }

  test::TempFolder temp_;
};

TEST_F(ScalarFlowScene, LitSmokeIsAsItWasFilmedAndTakesAnotherLightAsRenderShowsIt) {
  reconstruct("light=even");
  ASSERT_EQ(render().exit_code, 0);
  ASSERT_EQ(draw_scene("", "").exit_code, 0);
  // `render` marches lit smoke through its whole box, scenes through the voxels that hold any: the middles of
  // steps differ.
  EXPECT_LT(difference().rms, 1e-3);
  const auto relit = render({"--light", "distant:x=1:y=0:z=1"});
  ASSERT_EQ(relit.exit_code, 0) << relit.err;
  const std::size_t at = relit.out.find("1, 0, 1: ");
  ASSERT_NE(at, std::string::npos) << relit.out;
  double rgb[3] = {};
  ASSERT_EQ(std::sscanf(relit.out.c_str() + at, "1, 0, 1: %lf / %lf / %lf", rgb, rgb + 1, rgb + 2), 3);
  const auto level = [&](int c) { return std::to_string(4 * rgb[c]); };
  const auto done = draw_scene(R"(, "albedo": 1)", R"(, "light": {"towards": [1, 0, 1], "level": [)" +
                                                       level(0) + ", " + level(1) + ", " + level(2) + "]}");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_LT(difference().rms, 1e-3);
}

TEST_F(ScalarFlowScene, SmokeThatScattersItsOwnLightIsAsRenderShowsIt) {
  reconstruct("extinction=field,scattering=multiple:albedo=0.8:g=0.3");
  ASSERT_EQ(render().exit_code, 0);
  ASSERT_EQ(draw_scene("", "").exit_code, 0);
  EXPECT_LT(difference().largest, 1e-4);
}

}  // namespace
}  // namespace emberlock::cli
