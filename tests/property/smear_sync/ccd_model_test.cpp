// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/ccd_model.h"

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/properties.h"

namespace emberlock::smear {
namespace {

using test::any_int;
using test::any_real;

/// The oracle: a vertical shift register of n cells that really moves its charge, row by row, for three
/// frames. Cell 0 stands at the output. Packets are labelled with the image that they carry when they leave.
class ShiftRegister {
 public:
  ShiftRegister(const CcdTiming& timing, SweepOut sweep_out, int lamp_row)
      : timing_(timing), sweep_out_(sweep_out), lamp_cell_(mirrored(lamp_row)), cells_(timing.rows) {}

  /// Runs frames -1..1 under a light that shines during [begin, end); returns charge by (image, displayed
  /// row).
  std::map<std::pair<int, int>, double> run(double begin, double end) {
    const double period = timing_.frame_period.value();
    const double row = timing_.row_time.value();
    for (int frame = -1; frame <= 1; ++frame) {
      const double start = frame * period;
      if (sweep_out_ == SweepOut::before_transfer) cells_.assign(cells_.size(), 0);
      for (int k = 0; k < timing_.shifts; ++k) {
        expose(start + k * row, start + (k + 1) * row, begin, end);
        deliver(frame, k);
      }
      expose(start + timing_.shifts * row, start + period, begin, end);
    }
    return image_;
  }

 private:
  int mirrored(int row) const {
    return timing_.direction == ReadDirection::top_first ? row : timing_.rows - 1 - row;
  }
  void expose(double from, double to, double begin, double end) {
    cells_[lamp_cell_] += std::max(0.0, std::min(to, end) - std::max(from, begin)) / (end - begin);
  }
  void deliver(int frame, int shift) {
    if (shift < timing_.rows && cells_[0] > 0) image_[{frame, mirrored(shift)}] += cells_[0];
    for (std::size_t i = 0; i + 1 < cells_.size(); ++i) cells_[i] = cells_[i + 1];
    cells_.back() = 0;
  }

  CcdTiming timing_;
  SweepOut sweep_out_;
  int lamp_cell_;
  std::vector<double> cells_;
  std::map<std::pair<int, int>, double> image_;
};

CcdTiming any_timing() {
  CcdTiming t;
  t.rows = any_int(1, 120);
  t.row_time = microseconds_per_row(any_real(20, 90));
  t.frame_period = Rows(t.rows + 20 + any_real(0, 30)) * t.row_time;
  const int most = static_cast<int>(std::floor((t.frame_period / t.row_time).value()));
  t.shifts = *rc::gen::element(t.rows, t.rows + 20, most);
  t.direction = *rc::gen::element(ReadDirection::top_first, ReadDirection::bottom_first);
  return t;
}

TEST(CcdModelLaws, AgreesWithARegisterThatMovesItsCharge) {
  ASSERT_TRUE(rc::check([] {
    for (int repeat = 0; repeat < 300; ++repeat) {
      const CcdTiming t = any_timing();
      RC_ASSERT(check(t).ok());
      const auto sweep_out = *rc::gen::element(SweepOut::none, SweepOut::before_transfer);
      const int lamp = any_int(0, t.rows);
      const Seconds width = t.row_time * Rows(any_real(0.01, *rc::gen::element(0.5, 3.0, 40.0)));
      // Begin within frames -1 and 0; the oracle ends with frame 1.
      const Seconds centre = t.frame_period * any_real(-0.99, 0.99) + width / 2;
      const Flash flash{centre, width};

      auto expected =
          ShiftRegister(t, sweep_out, lamp).run((centre - width / 2).value(), (centre + width / 2).value());
      std::map<std::pair<int, int>, double> got;
      for (const SmearDeposit& d : smear_deposits(t, lamp, flash, sweep_out)) {
        if (d.image > 1) continue;  // beyond what the oracle runs
        got[{d.image, d.row}] += d.fraction;
      }
      for (const auto& [where, charge] : got) expected[where] -= charge;
      for (const auto& [where, left] : expected) RC_ASSERT(std::abs(left) < 1e-9);
    }
  }));
}

RC_GTEST_PROP(CcdModelLaws, FractionsOfASplitSumToOne, ()) {
  const CcdTiming t = any_timing();
  const Seconds width = t.frame_period * any_real(0, 3);
  double sum = 0;
  for (const FlashPart& p : split(t, {t.frame_period * any_real(-5, 5), width})) sum += p.fraction;
  RC_ASSERT(std::abs(sum - 1) < 1e-9);
}

RC_GTEST_PROP(CcdModelLaws, AFrameLaterEverythingIsTheSameAnImageLater, ()) {
  const CcdTiming t = any_timing();
  const int lamp = any_int(0, t.rows);
  // In the middle of a standstill, so that rounding can't move it over a border.
  const Seconds centre = Rows(any_int(0, t.shifts) + any_real(0.1, 0.9)) * t.row_time;
  const auto now = smear_deposits(t, lamp, {centre, Seconds(0)});
  const auto later = smear_deposits(t, lamp, {centre + t.frame_period * 3, Seconds(0)});
  RC_ASSERT(now.size() == later.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    RC_ASSERT(later[i].image == now[i].image + 3);
    RC_ASSERT(later[i].row == now[i].row);
  }
}

RC_GTEST_PROP(CcdModelLaws, TheInverseRecoversTheShiftsOfEveryVisibleDot, ()) {
  const CcdTiming t = any_timing();
  const int lamp = any_int(0, t.rows);
  const int k = any_int(0, t.shifts);
  const auto at = landing(t, lamp, {.frame = 0, .shifts = k, .fraction = 1});
  RC_PRE(at.has_value());
  RC_ASSERT(shifts_between(t, Rows(lamp), Rows(at->row)) == Rows(k));
}

RC_GTEST_PROP(CcdModelLaws, TheCentreOfADotAgreesWithItsRow, ()) {
  const CcdTiming t = any_timing();
  const int lamp = any_int(0, t.rows);
  const FlashPart part{.frame = 0, .shifts = any_int(0, t.shifts + 1), .fraction = 1};
  const auto at = landing(t, lamp, part);
  const auto centre = smear_centre(t, Rows(lamp), part);
  RC_ASSERT(at.has_value() == centre.has_value());
  if (at) {
    RC_ASSERT(centre->image == at->image);
    RC_ASSERT(centre->row == Rows(at->row));
  }
}

RC_GTEST_PROP(CcdModelLaws, MirroringTheChipMirrorsTheDots, ()) {
  CcdTiming t = any_timing();
  t.direction = ReadDirection::top_first;
  CcdTiming mirrored = t;
  mirrored.direction = ReadDirection::bottom_first;
  const int lamp = any_int(0, t.rows);
  const FlashPart part{.frame = 0, .shifts = any_int(0, t.shifts + 1), .fraction = 1};
  const auto a = landing(t, lamp, part);
  const auto b = landing(mirrored, t.rows - 1 - lamp, part);
  RC_ASSERT(a.has_value() == b.has_value());
  if (a) RC_ASSERT(a->row + b->row == t.rows - 1);
}

}  // namespace
}  // namespace emberlock::smear
