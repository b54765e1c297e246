// SPDX-License-Identifier: Apache-2.0
// An engine's calls build on each other: who leaves one out is told, on every device.
#include "recon/adjust/engine.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "recon/views/view.h"
#include "tests/support/devices.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

class EngineOrder : public OnEachDevice {
 protected:
  std::unique_ptr<Engine> engine(Absorb absorb = Absorb::nothing) {
    auto made = make_engine(problem_, {absorb, 0, 0, {}}, Precision::float32, pool_);
    made->set(points(1));
    return made;
  }
  [[nodiscard]] std::vector<Rgba> points(float light) const {
    return std::vector<Rgba>(problem_.grid().size(), Rgba{{light, light, light, 0.1F}});
  }
  [[nodiscard]] Problem two_subsets() {
    const MarchCase c = march_case();
    const View view{"a", c.cameras[0], share(RadianceImage(c.cameras[0].intrinsics.size))};
    ProblemOptions options;
    options.subsets = 2;
    options.subset_of = [](std::size_t, int x, int y) { return (x + y) % 2; };
    return make_problem({&view}, c.medium, options, pool_);
  }
  Pool pool_{2, device_here()};
  Problem problem_ = two_subsets();
};
INSTANTIATE_TEST_SUITE_P(Devices, EngineOrder, testing::ValuesIn(every_device()),
                         [](const auto& on) { return device_name(on.param); });

TEST_P(EngineOrder, WhatWasNeverKeptIsNotGoneBackTo) {
  const auto e = engine();
  EXPECT_THROW(e->restore(), std::logic_error);
  EXPECT_THROW(e->keep(), std::logic_error);
  e->mark();
  EXPECT_THROW(e->restore(), std::logic_error) << "marked alone";
  e->keep();
  EXPECT_THROW(e->keep(), std::logic_error) << "it would bring back what was kept before";
  e->set(points(7));
  e->restore();
  EXPECT_EQ(e->get().front().c[0], 1);
}

TEST_P(EngineOrder, WhatIsSavedStaysWhateverIsKept) {
  const auto e = engine();
  EXPECT_THROW(e->go_back(), std::logic_error);
  e->set(points(7));
  e->save();
  e->set(points(5));
  e->mark();
  e->keep();
  e->go_back();
  EXPECT_EQ(e->get().front().c[0], 7);
  EXPECT_THROW(e->backproject(0), std::logic_error) << "no residual is of this volume";
  e->restore();
  EXPECT_EQ(e->get().front().c[0], 5);
  e->go_back();
  EXPECT_EQ(e->get().front().c[0], 7) << "as often as one likes";
}

TEST_P(EngineOrder, OnlyTheLastResidualOfTheVolumeIsProjectedBack) {
  for (const Absorb absorb : {Absorb::nothing, Absorb::field}) {
    const auto e = engine(absorb);
    EXPECT_THROW(e->backproject(0), std::logic_error);
    e->residual(0);
    e->residual(1);
    EXPECT_THROW(e->backproject(0), std::logic_error) << "another subset's came last";
    EXPECT_NO_THROW(e->backproject(1));
    e->set_weights(std::vector<float>(problem_.grid().size(), 1));
    e->residual(0);
    e->descend({1, 0});
    EXPECT_THROW(e->backproject(0), std::logic_error) << "the volume is another one";
    e->residual(0);
    e->project(0);
    EXPECT_THROW(e->backproject(0), std::logic_error) << "no residual but a radiance";
  }
}

TEST_P(EngineOrder, ThePapersAdjustmentNeedsItsSubsetsResidual) {
  const auto e = engine();
  EXPECT_THROW(e->adjust(0, {0.1F, 1, 0.05F, 1}), std::logic_error);
  e->residual(0);
  e->residual(1);
  EXPECT_NO_THROW(e->adjust(0, {0.1F, 1, 0.05F, 1}));
  EXPECT_THROW(e->adjust(1, {0.1F, 1, 0.05F, 1}), std::logic_error) << "the first moved the volume";
}

TEST_P(EngineOrder, AFieldDescendsOnlyWhereThereIsOne) {
  const std::vector<float> ones(problem_.grid().size(), 1);
  EXPECT_THROW(engine(Absorb::constant)->set_field(ones, ones), std::logic_error);
  const auto e = engine(Absorb::field);
  EXPECT_THROW(e->raise_field_weights(1), std::logic_error);
  EXPECT_THROW((void)e->field_weights(), std::logic_error);
  EXPECT_THROW(e->descend_field({{1, 0}, 1, 1, 1}), std::logic_error);
  e->set_field(ones, ones);
  EXPECT_NO_THROW(e->descend_field({{1, 0}, 1, 1, 1}));
}

TEST_P(EngineOrder, ResidualsAreOfAVolumeThatIsThere) {
  const auto residuals = make_residual_engine(problem_, {}, Precision::float32, pool_);
  EXPECT_THROW(residuals->residual_of(*residuals, 0), std::logic_error);
  EXPECT_NO_THROW(residuals->residual_of(*engine(), 0));
  residuals->set(points(1));
  EXPECT_NO_THROW(residuals->residual_of(*residuals, 0));
}

}  // namespace
}  // namespace emberlock::recon
