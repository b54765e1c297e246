// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/model_errors.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/kernels/planck.h"
#include "tests/support/glowing_flame.h"

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

}  // namespace
}  // namespace emberlock::recon
