// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/blind_views.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "base/random.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/single_run.h"
#include "tests/support/counting_clock.h"
#include "tests/support/pictures.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

/// A ball of light as `cameras` around it see it.
Scene seen_ball(int cameras) {
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
      return 200 * std::exp(-closest * closest / (2 * 0.02 * 0.02)) / (c + 1);
    }));
    scene.views.push_back(std::move(view));
  }
  return scene;
}

using Edit = std::function<void(View&)>;

/// A picture of one level, with evenly distributed noise of this half width.
Edit level(double grey, double noise = 0) {
  return [=](View& view) {
    std::uint64_t n = 0;
    view.image = share(radiance_of({80, 60}, [&](int, int, int) {
      return std::clamp(grey + noise * (2 * random_uniform(7, 0, n++) - 1), 0.0, 255.0);
    }));
  };
}
Edit changed(const std::function<double(double level, int x)>& change) {
  return [=](View& view) {
    const RadianceImage was = *view.image;
    view.image = share(radiance_of({80, 60}, [&](int x, int y, int c) {
      return change(static_cast<double>(was.rgb[static_cast<std::size_t>(3 * (80 * y + x) + c)]), x);
    }));
  };
}
Edit aimed(const Eigen::Vector3d& at) {
  return [=](View& view) {
    view.camera = look_at(view.camera.intrinsics, view.camera.center(), view.camera.center() + at);
  };
}
Edit both(const Edit& a, const Edit& b) {
  return [=](View& view) {
    a(view);
    b(view);
  };
}

struct BlindCase {
  const char* name;
  Edit edit;
  const char* why;  // of the warning; nothing: it sees
};

const std::vector<BlindCase>& cases() {
  static const std::vector<BlindCase> all = {
      {"black", level(0), "black"},
      {"black, noisy", level(1.5, 1.5), "one grey"},
      {"white", level(255), "white"},
      {"nearly white", level(254), "white"},
      {"white, noisy", level(252, 3), "one grey"},
      {"dark grey", level(16), "one grey"},
      {"middle grey", level(128), "one grey"},
      {"grey, noisy", level(90, 4), "one grey"},
      {"away", aimed({1, 0, 0}), "looks past the box"},
      {"upwards", aimed({0.01, 0, 1}), "looks past the box"},
      {"sidewards", aimed({0, 1, 0.2}), "looks past the box"},
      {"away, and white", both(aimed({1, 0, 0}), level(255)), "looks past the box"},
      {"as filmed", [](View&) {}, nullptr},
      {"dim", changed([](double l, int) { return 0.05 * l; }), nullptr},
      {"half saturated", changed([](double l, int) { return std::min(255.0, 4 * l); }), nullptr},
      {"before grey", changed([](double l, int) { return std::min(255.0, 60 + l / 2); }), nullptr},
      {"dark before white", changed([](double l, int) { return 250 - l; }), nullptr},
      {"half of it white", changed([](double l, int x) { return x < 30 ? 255 : l; }), nullptr},
      {"fills most of the picture", changed([](double l, int) { return 255 * std::pow(l / 200, 0.1); }),
       nullptr},
      {"a little aside", aimed({-1, 0.05, 0}), nullptr},
  };
  return all;
}

Result<PreparedScene> looked_through(const Scene& scene, std::vector<std::string>& warnings) {
  return leave_out_blind_views(value_of(PreparedScene::create(scene, {})), {}, warnings);
}

TEST(BlindViews, AreLeftOutAndNamedWhereNothingOfTheFlameIsSeen) {
  for (const BlindCase& c : cases()) {
    Scene scene = seen_ball(5);
    c.edit(scene.views[0]);  // which looks along -x
    std::vector<std::string> warnings;
    const PreparedScene seeing = value_of(looked_through(scene, warnings));
    EXPECT_EQ(seeing.scene().views[0].role, c.why ? ViewRole::left_out : ViewRole::input) << c.name;
    for (std::size_t v = 1; v < 5; ++v) EXPECT_EQ(seeing.told().views[v].role, ViewRole::input) << c.name;
    ASSERT_EQ(warnings.size(), c.why ? 1U : 0U) << c.name;
    if (!c.why) continue;
    EXPECT_THAT(warnings[0], testing::AllOf(HasSubstr("camera 0"), HasSubstr(c.why))) << c.name;
  }
}

TEST(BlindViews, AreAnErrorWhereFewerThanTwoAreLeft) {
  for (const int blind : {2, 3, 4, 5}) {
    Scene scene = seen_ball(5);
    for (int v = 0; v < blind; ++v) level(255)(scene.views[static_cast<std::size_t>(v)]);
    std::vector<std::string> warnings;
    const auto seeing = looked_through(scene, warnings);
    EXPECT_EQ(seeing.ok(), blind < 4);
    if (blind < 4) continue;
    EXPECT_EQ(seeing.error().kind, ErrorKind::not_converged);
    EXPECT_THAT(seeing.error().what, HasSubstr("camera 3 shows no flame"));
  }
}

ReconstructOptions small_run() {
  ReconstructOptions options;
  options.voxels = 16;
  options.effects = EffectRequest{Effects{}};
  options.solve.iterations = 4;
  return options;
}

TEST(BlindViews, LeaveTheVolumeOfTheOthersAsItIsWithoutThem) {
  Scene scene = seen_ball(6);
  level(255)(scene.views[2]);
  level(0)(scene.views[5]);
  Scene others = scene;
  others.views.erase(others.views.begin() + 5);
  others.views.erase(others.views.begin() + 2);
  const Outcome with = value_of(reconstruct(scene, small_run(), test::CountingClock()));
  const Outcome without = value_of(reconstruct(others, small_run(), test::CountingClock()));
  EXPECT_EQ(with.reconstruction.volume.emission, without.reconstruction.volume.emission);
  EXPECT_EQ(with.report.input_rmse, without.report.input_rmse);
  EXPECT_EQ(with.report.views[2].role, ViewRole::left_out);
  EXPECT_EQ(with.renders.size(), 6U);
}

TEST(BlindViews, AVolumeMustExplainATenthOfTheLightOfItsViews) {
  struct Row {
    std::vector<double> left;  // of 100 grey levels, of each view
    bool explained;
  };
  for (const Row& row : std::vector<Row>{{{5, 5, 5}, true},
                                         {{5, 5, 95}, true},
                                         {{5, 95, 95}, true},
                                         {{85, 85, 85}, true},
                                         {{92, 92, 92}, false},
                                         {{99, 99, 99}, false},
                                         {{99}, false},
                                         {{30, 120, 120}, false}}) {
    Report report;
    for (const double left : row.left)
      report.views.push_back({"view " + std::to_string(report.views.size()),
                              ViewRole::input,
                              {left, left, left},
                              {100, 100, 100}});
    report.views.push_back({"aside", ViewRole::left_out, {100, 100, 100}, {100, 100, 100}});
    const Status done = check_explained(report);
    EXPECT_EQ(done.ok(), row.explained);
    const std::string words = done.ok() ? testing::PrintToString(report.warnings) : done.error().what;
    for (std::size_t v = 0; v < row.left.size(); ++v)
      EXPECT_EQ(words.find("view " + std::to_string(v)) != std::string::npos, row.left[v] > 90) << words;
  }
}

}  // namespace
}  // namespace emberlock::recon
