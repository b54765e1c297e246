// SPDX-License-Identifier: Apache-2.0
// Smear removal knows no more of a CCD than which rows lighten which; the forward model of smear_sync knows
// the shift register. Here they meet.
#include <gtest/gtest.h>

#include "recon/preprocess/smear.h"
#include "smear_sync/ccd_model.h"

namespace emberlock {
namespace {

constexpr int kRows = 48;
constexpr double kLeak = 1e-2;  // of a row's light, were the register under it for a whole frame

/// What a steady light of 1 at `lit` rows adds to each row of image 0.
std::vector<double> smear_of(const smear::CcdTiming& timing, const std::vector<double>& light,
                             smear::SweepOut sweep_out) {
  std::vector<double> out(light.size());
  const double t_row = timing.row_time.value();
  const int periods = static_cast<int>(std::lround(timing.frame_period.value() / t_row));
  for (int row = 0; row < timing.rows; ++row)
    for (int step = -periods; step < periods; ++step)
      for (const smear::SmearDeposit& d :
           smear::smear_deposits(timing, row, {Seconds((step + 0.5) * t_row), Seconds(0)}, sweep_out))
        if (d.image == 0 && d.row != row)
          out[static_cast<std::size_t>(d.row)] +=
              kLeak / periods * d.fraction * light[static_cast<std::size_t>(row)];
  return out;
}

struct SmearCase {
  smear::ReadDirection direction;
  smear::SweepOut sweep_out;
  recon::SmearPath path;
};

TEST(SmearRemoval, UndoesWhatTheShiftRegisterDoes) {
  smear::CcdTiming timing;
  timing.rows = kRows;
  timing.shifts = kRows;
  timing.row_time = microseconds_per_row(50);
  timing.frame_period = Seconds(60 * 50e-6);
  std::vector<double> light(kRows);
  for (int y = 14; y < 30; ++y) light[static_cast<std::size_t>(y)] = 100 + 5 * y;
  for (const SmearCase& c :
       {SmearCase{smear::ReadDirection::top_first, smear::SweepOut::none, recon::SmearPath::whole_column},
        SmearCase{smear::ReadDirection::bottom_first, smear::SweepOut::none, recon::SmearPath::whole_column},
        SmearCase{smear::ReadDirection::top_first, smear::SweepOut::before_transfer,
                  recon::SmearPath::rows_above},
        SmearCase{smear::ReadDirection::bottom_first, smear::SweepOut::before_transfer,
                  recon::SmearPath::rows_below}}) {
    timing.direction = c.direction;
    const std::vector<double> smear = smear_of(timing, light, c.sweep_out);
    recon::Samples samples;
    samples.size = {32, kRows};
    samples.value.resize(32 * kRows);
    for (int y = 0; y < kRows; ++y)
      for (int x = 8; x < 24; ++x)
        samples.value[samples.index(x, y)] =
            static_cast<float>(light[static_cast<std::size_t>(y)] + smear[static_cast<std::size_t>(y)]);
    const double fraction = kLeak / 60;
    recon::remove_smear(samples, {{fraction, fraction, fraction}, 0, c.path});
    double worst = 0;
    double added = 0;
    for (int y = 0; y < kRows; ++y) {
      const auto row = static_cast<std::size_t>(y);
      worst =
          std::max(worst, std::abs(static_cast<double>(samples.value[samples.index(12, y)]) - light[row]));
      added = std::max(added, smear[row]);
    }
    EXPECT_GT(added, 0.3);
    // A row's own light, which a steady light can't be told from, is all that the whole column counts too
    // much.
    EXPECT_LT(worst, 0.15 * added) << static_cast<int>(c.path);
  }
}

}  // namespace
}  // namespace emberlock
