// SPDX-License-Identifier: Apache-2.0
// The least that a strobe is (CONTRIBUTING.md, "A strobe"): it keeps to whole microseconds, and says what it
// really does.
#include "drivers/strobe.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

namespace emberlock::drivers {
namespace {

class MicrosecondStrobe final : public Strobe {
 public:
  [[nodiscard]] const std::string& id() const override { return id_; }
  Status apply(const StrobeSettings& wanted) override {
    if (!(wanted.rate >= Hertz(0.5) && wanted.rate <= Hertz(333.3)))
      return Error{ErrorKind::bad_input, "flashes 0.5 to 333.3 times a second", id_,
                   "Ask for a rate in between"};
    settings_ = wanted;
    settings_.phase = whole(wanted.phase);
    settings_.width = whole(wanted.width);
    settings_.rate = Hertz(1 / whole(period(wanted.rate)).value());
    return {};  // a device's answer is read before this
  }
  Result<StrobeSettings> read_back() override { return settings_; }

 private:
  static Seconds whole(Seconds time) { return microseconds(std::round(time.value() * 1e6)); }
  std::string id_ = "example";
  StrobeSettings settings_;
};

TEST(ExampleStrobe, SaysWhatItReallyDoes) {
  MicrosecondStrobe strobe;
  ASSERT_TRUE(strobe.apply({.output = StrobeOutput::flashing, .rate = Hertz(23.976)}).ok());
  EXPECT_NEAR(strobe.read_back()->rate.value(), 23.976, 3e-4);
  EXPECT_NE(strobe.read_back()->rate.value(), 23.976);
  EXPECT_EQ(strobe.apply({.rate = Hertz(1000)}).error().kind, ErrorKind::bad_input);
  EXPECT_NEAR(strobe.read_back()->rate.value(), 23.976, 3e-4) << "as it was";
}

}  // namespace
}  // namespace emberlock::drivers
