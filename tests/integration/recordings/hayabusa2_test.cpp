// SPDX-License-Identifier: Apache-2.0
// A real CCD frame with vertical smear: Hayabusa2's ONC-W2, the Earth as a steady source (ISAS/JAXA, public
// domain).
#include <filesystem>

#include <gtest/gtest.h>

#include "session/media/frame_file.h"
#include "smear_sync/detect/detect.h"
#include "tests/support/recordings.h"

namespace emberlock {
namespace {

class Hayabusa2 : public testing::TestWithParam<const char*> {};

TEST_P(Hayabusa2, TheEarthIsASteadyLampAndTheTrapIsNoDot) {
  const std::filesystem::path file = test::recordings() / "smear_hayabusa2" / GetParam();
  const Result<Image> image = session::read_image(file);
  ASSERT_TRUE(image.ok()) << image.error().message();
  EXPECT_EQ(image->layout().size, (ImageSize{1024, 1024}));
  const smear::SmearReading r = smear::detect(image->view());
  EXPECT_EQ(r.state, smear::SmearState::steady) << name(r.state) << ": " << r.reason;
  ASSERT_TRUE(r.lamp);
  // Centroid of the pixels of 1000 DN or more.
  EXPECT_NEAR(r.lamp->y.value(), 775.3, 0.5);
  EXPECT_NEAR(r.lamp->x, 560.5, 0.5);
  EXPECT_TRUE(r.lamp->saturated);
  // The small bright feature in rows 1014..1023, columns 833..835.
  EXPECT_TRUE(r.dots.empty());
}

INSTANTIATE_TEST_SUITE_P(Files, Hayabusa2,
                         testing::Values("hyb2_onc_w2_earth_smear_1024.pgm",
                                         "hyb2_onc_20151203_000006_w2f_l2a.fit"),
                         [](const auto& file) {
                           return std::string(file.param).ends_with("pgm") ? "Pgm" : "Fits";
                         });

}  // namespace
}  // namespace emberlock
