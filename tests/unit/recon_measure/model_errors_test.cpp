// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/model_errors.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/kernels/planck.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/key_points.h"

namespace emberlock::recon {
namespace {

TEST(Dispersion, IsWhatSootOfAConstantIndexIsReadTooHotBy) {
  for (const CameraResponse& response : {test::lobes(1), standard_response()}) {
    const Thermometer meter(EmitterTable(response, Emitter::soot));
    const Dispersion dispersion(meter, response);
    for (int kelvin = 1250; kelvin < 2250; kelvin += 50) {
      const EmitterLevels levels = levels_of_constant_soot(response, Kelvin(kelvin));
      const Eigen::Vector3d level = Eigen::Vector3d::Map(levels.value.data());
      const double read = meter.read(glow_of(level, Eigen::Vector3d::Constant(1e-3))).kelvin;
      EXPECT_NEAR(read - dispersion.at(read), kelvin, 2);
      // By Wien's law of two wavelengths, whose absorptions differ by (a / b)^0.39.
      const double wien = 0.39 * std::log(620 / 460.0) / (kSecondRadiation * (1 / 460.0 - 1 / 620.0));
      EXPECT_NEAR(dispersion.at(read), -wien * kelvin * kelvin, 0.5 * wien * kelvin * kelvin);
    }
  }
}

TEST(Blended, IsTheMeanOfWhatGlows) {
  Reconstruction done;
  done.volume.grid = cube_grid(0.1, 8);
  each_point(done.volume.grid, [&](int i, int j, int k) {
    const bool glows = i + j + k > 3;
    for (int c = 0; c < 3; ++c)
      done.volume.emission.push_back(glows ? static_cast<float>(10 + i + 2 * j + c * k) : 0);
    done.volume.extinction.push_back(glows ? 5.0F : 0.0F);
  });
  const Volume blend = blended(done).volume;
  each_point(done.volume.grid, [&](int i, int j, int k, std::size_t p) {
    const bool glows = i + j + k > 3;
    EXPECT_EQ(blend.extinction[p], done.volume.extinction[p]) << "even, and dark where it was";
    if (!glows) {
      EXPECT_EQ(blend.emission[3 * p], 0);
    }
    const auto inner = [](int at) { return at > 0 && at < 8; };
    if (i + j + k > 6 && inner(i) && inner(j) && inner(k)) {
      EXPECT_NEAR(blend.emission[3 * p + 1], done.volume.emission[3 * p + 1], 1e-4) << "linear";
    }
  });
}

}  // namespace
}  // namespace emberlock::recon
