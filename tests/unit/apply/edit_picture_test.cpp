// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_picture.h"

#include <cmath>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/stylized_flame.h"

namespace emberlock::apply {
namespace {

constexpr ImageSize kSize{40, 30};

recon::SharedImage some_picture() {
  recon::RadianceImage image(kSize);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<float>(i * 37 % 101) + 0.25F;
  return recon::share(std::move(image));
}

const float* pixel(const recon::SharedImage& image, int x, int y) {
  return &image->rgb[3 * static_cast<std::size_t>(x + y * image->size.width)];
}

recon::SharedImage edit(const recon::SharedImage& captured, const Operation& operation,
                        const ObjectPicture& object = {}) {
  return edited_picture(captured, "a", {&operation},
                        [&](const ObjectEdit&) -> const ObjectPicture& { return object; });
}

class Objects : public testing::Test {
 protected:
  Objects() {
    const auto grey = [](double x, double y) { return 120 + 60 * x + 50 * y; };
    put_.view = "a";
    put_.file = test::write_object(test::folder_for("object") / "o.png", 8, grey);
    put_.position = {20, 15};
    auto loaded = load_object(put_);
    EXPECT_TRUE(loaded);
    object_ = std::move(loaded).value();
  }
  [[nodiscard]] float grey(int x, int y) const { return object_.grey[static_cast<std::size_t>(x + 8 * y)]; }

  ObjectEdit put_;
  ObjectPicture object_;
  recon::SharedImage captured_ = some_picture();
};

TEST_F(Objects, GreenIsTheGreyWhereItCoversAll) {
  put_.combine = Combine::over;
  const auto edited = edit(captured_, put_, object_);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      const bool inside = x >= 16 && x < 24 && y >= 11 && y < 19;
      const float* now = pixel(edited, x, y);
      const float* then = pixel(captured_, x, y);
      EXPECT_NEAR(now[1], inside ? grey(x - 16, y - 11) : then[1], 1e-4F) << x << " " << y;
      EXPECT_EQ(now[0], inside ? 0 : then[0]);
    }
}

TEST_F(Objects, MeetsTheFlameByTheLargerOfBothOrTheirSumAndHalfOfItByOpacity) {
  const auto brighter = edit(captured_, put_, object_);
  put_.combine = Combine::add;
  put_.opacity = 0.5;
  const auto added = edit(captured_, put_, object_);
  for (int n = 0; n < 8; ++n) {
    const float* then = pixel(captured_, 16 + n, 12);
    EXPECT_FLOAT_EQ(pixel(brighter, 16 + n, 12)[1], std::max(then[1], grey(n, 1)));
    EXPECT_FLOAT_EQ(pixel(added, 16 + n, 12)[1], then[1] + 0.5F * grey(n, 1));
    for (const int c : {0, 2}) EXPECT_EQ(pixel(added, 16 + n, 12)[c], then[c]);
  }
}

TEST_F(Objects, IsScaledTurnedAndShrunkWithoutLosingLight) {
  put_.combine = Combine::over;
  put_.rotation = 90;  // clockwise: what was left is up
  const auto turned = edit(captured_, put_, object_);
  EXPECT_NEAR(pixel(turned, 23, 11)[1], grey(0, 0), 1e-3F);
  EXPECT_NEAR(pixel(turned, 16, 11)[1], grey(0, 7), 1e-3F);
  put_.rotation = 0;
  put_.scale = 0.25;
  const auto small = edit(captured_, put_, object_);  // 2 x 2 pixels
  double mean = 0;
  for (int y = 14; y < 16; ++y)
    for (int x = 19; x < 21; ++x) mean += static_cast<double>(pixel(small, x, y)[1]) / 4;
  EXPECT_NEAR(mean, 120, 1);
}

TEST_F(Objects, AMaskSaysWhereItIsSeen) {
  put_.mask = test::write_object(test::folder_for("mask") / "m.png", 8,
                                 [](double x, double) { return x < 0 ? 255 : 0; });
  put_.combine = Combine::over;
  const auto masked = load_object(put_);
  ASSERT_TRUE(masked) << masked.error().message();
  EXPECT_NE(masked->hash, object_.hash);
  const auto edited = edit(captured_, put_, *masked);
  EXPECT_NEAR(pixel(edited, 17, 15)[1], grey(1, 4), 1e-3F);
  EXPECT_EQ(pixel(edited, 23, 15)[1], pixel(captured_, 23, 15)[1]);
  put_.hash = object_.hash;
  EXPECT_THAT(load_object(put_).error().message(), testing::HasSubstr("something else"));
}

TEST(EditedPicture, IsTheCapturedOneItselfWhereNothingConcernsIt) {
  const auto captured = some_picture();
  EXPECT_EQ(edit(captured, BrushEdit{"b", {{1, 1}}, 4, BrushEdit::Mode::erase, 0}), captured);
  EXPECT_EQ(edit(captured, Operation{BrightnessEdit{}}), captured);
}

TEST(EditedPicture, ABrushActsWithinItsRadiusAndLeavesNoNegativeLight) {
  const auto captured = some_picture();
  const std::vector<Eigen::Vector2d> line = {{8, 8}, {24, 20}};
  const auto less = edit(captured, BrushEdit{"a", line, 5, BrushEdit::Mode::subtract, 70});
  const auto more = edit(captured, BrushEdit{"a", line, 5, BrushEdit::Mode::add, 70});
  const auto gone = edit(captured, BrushEdit{"a", line, 5, BrushEdit::Mode::erase, 0});
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      const Eigen::Vector2d along = (line[1] - line[0]).normalized();
      const Eigen::Vector2d off = Eigen::Vector2d(x + 0.5, y + 0.5) - line[0];
      const double t = std::clamp(off.dot(along), 0.0, 20.0);
      const double distance = (off - t * along).norm();
      const float then = pixel(captured, x, y)[1];
      EXPECT_GE(pixel(less, x, y)[1], 0);
      if (distance < 2.5) {
        EXPECT_FLOAT_EQ(pixel(more, x, y)[1], then + 70);
        EXPECT_FLOAT_EQ(pixel(less, x, y)[1], std::max(0.F, then - 70));
        EXPECT_EQ(pixel(gone, x, y)[1], 0);
      } else if (distance > 5) {
        for (const auto& picture : {more, less, gone}) EXPECT_EQ(pixel(picture, x, y)[1], then);
      }
    }
}

TEST(EditedPicture, AMaskKeepsOrCutsAPolygon) {
  const auto captured = some_picture();
  const std::vector<Eigen::Vector2d> triangle = {{5, 5}, {30, 5}, {5, 25}};
  const auto kept = edit(captured, MaskEdit{"a", triangle, Part::keep});
  const auto cut = edit(captured, MaskEdit{"a", triangle, Part::cut});
  for (const auto& [x, y, inside] : {std::tuple(8, 8, true), {25, 20, false}, {2, 2, false}, {27, 5, true}}) {
    EXPECT_EQ(pixel(kept, x, y)[0], inside ? pixel(captured, x, y)[0] : 0) << x;
    EXPECT_EQ(pixel(cut, x, y)[0], inside ? 0 : pixel(captured, x, y)[0]) << x;
  }
}

}  // namespace
}  // namespace emberlock::apply
