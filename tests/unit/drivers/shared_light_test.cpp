// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/shared_light.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include "base/file.h"
#include "base/log.h"
#include "drivers/virtual/virtual_rig.h"
#include "drivers/virtual/virtual_strobe.h"
#include "tests/support/recording.h"
#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using testing::HasSubstr;

constexpr auto kFlashes = StrobeOutput::flashing;
constexpr Seconds kBracket = microseconds(50);  // to which each process knows the wall clock, and far more
constexpr PartsPerMillion kError{1000};  // of the strobe's rate: 50 us within two flashes of 24 a second

/// A process's view of the strobe.
std::vector<LightPulse> seen(const StrobeTimeline& timeline, TimePoint from, Seconds duration) {
  return timeline.light(from, Seconds(0), duration);
}

void expect_same(const std::vector<LightPulse>& a, const std::vector<LightPulse>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].kind, b[i].kind) << i;
    EXPECT_NEAR(a[i].begin.value(), b[i].begin.value(), kBracket.value()) << i;
    EXPECT_NEAR(a[i].width.value(), b[i].width.value(), 2 * kBracket.value()) << i;
  }
}

class SharedLightThreads : public testing::Test {
 protected:
  std::unique_ptr<VirtualStrobe> lead() {
    led_ = std::make_shared<StrobeTimeline>(kError);
    return std::make_unique<VirtualStrobe>(VirtualStrobeOptions{}, clock_, led_,
                                           LightWriter::create(file_, kError, clock_).value());
  }
  void write(const std::string& text) const { std::ofstream(file_, std::ios::app) << text; }
  [[nodiscard]] std::string text() const { return read_file(file_).value(); }
  /// What the follower sees in the next ten seconds.
  std::vector<LightPulse> light() {
    follower_.look();
    return seen(*followed_, clock_->now(), Seconds(10));
  }

  test::TempFolder folder_;
  std::filesystem::path file_ = folder_ / "light.txt";
  std::shared_ptr<SteadyClock> clock_ = std::make_shared<SteadyClock>();
  std::shared_ptr<StrobeTimeline> led_;
  std::shared_ptr<StrobeTimeline> followed_ = std::make_shared<StrobeTimeline>(PartsPerMillion(0));
  LightFollower follower_{file_, clock_, followed_};
};

TEST_F(SharedLightThreads, AFollowerSeesTheFlashesOfEachSetting) {
  const auto strobe = lead();
  const TimePoint begin = clock_->now();
  // Rates at which no flash is near the instant of another setting.
  for (const StrobeSettings& next : std::vector<StrobeSettings>{
           {.output = StrobeOutput::off},
           {.output = kFlashes, .rate = Hertz(1)},
           {.output = kFlashes, .rate = Hertz(1), .phase = Seconds(0.4)},  // goes on with the same base
           {.output = StrobeOutput::steady},
           {.output = kFlashes, .rate = Hertz(1.5), .width = milliseconds(1), .code = {true, true, false}}}) {
    ASSERT_TRUE(strobe->apply(next).ok());
    follower_.look();
  }
  EXPECT_GT(seen(*led_, begin, Seconds(10)).size(), 9U);
  expect_same(seen(*followed_, begin, Seconds(10)), seen(*led_, begin, Seconds(10)));
}

TEST_F(SharedLightThreads, AFollowerThatComesLateSeesAll) {
  const TimePoint begin = clock_->now();
  const auto strobe = lead();
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(1)}).ok());
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(2), .phase = Seconds(0.1)}).ok());
  follower_.look();
  EXPECT_GT(seen(*led_, begin, Seconds(10)).size(), 18U);
  expect_same(seen(*followed_, begin, Seconds(10)), seen(*led_, begin, Seconds(10)));
}

TEST_F(SharedLightThreads, ASettingIsToldBeforeItTakesEffectAndInEffectWhenItsCallReturns) {
  const auto strobe = lead();
  const TimePoint before = clock_->now();
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(1)}).ok());
  const TimePoint after = clock_->now();
  const Seconds first = seen(*led_, before, Seconds(10)).at(0).begin;
  EXPECT_GE(first, milliseconds(20));
  EXPECT_LE(first, after - before);
}

TEST_F(SharedLightThreads, ASettingThatIsRefusedIsNotTold) {
  const auto strobe = lead();
  const std::string before = text();
  EXPECT_FALSE(strobe->apply({.rate = Hertz(1000)}).ok());
  EXPECT_EQ(text(), before);
}

TEST_F(SharedLightThreads, WhenTheLeaderStartsAnewSoDoTheFollowers) {
  auto strobe = lead();
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(1)}).ok());
  EXPECT_FALSE(light().empty());
  strobe.reset();
  EXPECT_FALSE(light().empty()) << "a lamp flashes on without its host";
  strobe = lead();
  EXPECT_TRUE(light().empty());
  // As much text as before, so that its length doesn't tell.
  const TimePoint now = clock_->now();  // before the first flash, on which the two agree to 50 us
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(2)}).ok());
  follower_.look();
  expect_same(seen(*followed_, now, Seconds(10)), seen(*led_, now, Seconds(10)));
  strobe = lead();
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(4)}).ok());
  const TimePoint later = clock_->now();
  follower_.look();
  EXPECT_GT(seen(*followed_, later, Seconds(10)).size(), 38U);
}

TEST_F(SharedLightThreads, AFileThatIsCutIsReadAnew) {
  const std::string first = first_light_line({});
  write(first + light_line({wall_clock(), {.output = kFlashes, .rate = Hertz(2)}}));
  EXPECT_FALSE(light().empty());
  std::filesystem::resize_file(file_, first.size());
  EXPECT_TRUE(light().empty());
  write(light_line({wall_clock(), {.output = kFlashes, .rate = Hertz(2)}}));
  EXPECT_FALSE(light().empty());
}

TEST_F(SharedLightThreads, ALineCountsWhenItIsWhole) {
  const std::string line = light_line({wall_clock(), {.output = kFlashes, .rate = Hertz(2)}});
  write(first_light_line({}));
  for (const char part : line) {
    EXPECT_TRUE(light().empty());
    write({part});
  }
  EXPECT_FALSE(light().empty());
}

TEST_F(SharedLightThreads, AFileThatIsNoneLeavesItDarkAndIsToldOfOnce) {
  std::ostringstream told;
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(told);
  log(LogCategory::drivers).sinks().push_back(sink);
  const auto times = [&](const std::string& words) {
    const std::string all = told.str();
    std::size_t count = 0;
    for (std::size_t at = all.find(words); at != std::string::npos; at = all.find(words, at + 1)) ++count;
    return count;
  };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(light().empty());
  EXPECT_EQ(times("can't open the file"), 1U) << told.str();
  write(first_light_line({}) + light_line({wall_clock(), {.output = kFlashes, .rate = Hertz(2)}}));
  EXPECT_FALSE(light().empty());
  write("something else\n");
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(light().empty());
  EXPECT_EQ(times(file_.string() + ":3: a setting has 2 words"), 1U) << told.str();
  write(light_line({wall_clock(), {.output = kFlashes, .rate = Hertz(2)}}));
  EXPECT_TRUE(light().empty()) << "what follows a bad line isn't believed";
  const auto strobe = lead();
  ASSERT_TRUE(strobe->apply({.output = kFlashes, .rate = Hertz(1)}).ok());
  EXPECT_FALSE(light().empty());
  std::filesystem::remove(file_);
  std::filesystem::create_directory(file_);
  EXPECT_TRUE(light().empty());
  EXPECT_EQ(times("can't read it"), 1U) << told.str();
  log(LogCategory::drivers).sinks().pop_back();
}

TEST_F(SharedLightThreads, ALeaderReplacesNoOtherFile) {
  write("a letter");
  const auto refused = LightWriter::create(file_, {}, clock_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(text(), "a letter");
  EXPECT_FALSE(LightWriter::create(folder_ / ".", {}, clock_).ok());
  const auto nowhere = LightWriter::create(folder_ / "absent/light.txt", {}, clock_);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_EQ(nowhere.error().kind, ErrorKind::io);
  std::filesystem::resize_file(file_, 0);
  EXPECT_TRUE(LightWriter::create(file_, {}, clock_).ok());
}

TEST_F(SharedLightThreads, TwoRigsSeeOneStrobe) {
  VirtualRigOptions options;
  options.cameras = {testing_support::small_camera()};
  options.light = SharedLightOptions{file_, false};
  const auto follower = VirtualRig::create(options, clock_).value();
  options.light->leads = true;
  options.strobe.rate_error = kError;
  const auto leader = VirtualRig::create(options, clock_).value();
  const auto flashes = [](VirtualRig& rig) {
    std::vector<TimePoint> all;
    for (std::uint64_t frame = 0; frame < 240; ++frame) {  // ten seconds
      for (const TrueDot& dot : rig.dots(0, frame)) all.push_back(dot.flash);
    }
    return all;
  };
  for (VirtualRig* rig : {follower.get(), leader.get()}) ASSERT_TRUE(rig->camera(0).start().ok());
  ASSERT_TRUE(leader->strobe().apply({.output = kFlashes, .rate = Hertz(100)}).ok());
  EXPECT_EQ(leader->strobe().read_back()->rate, Hertz(100));
  // Its own strobe lights nothing.
  ASSERT_TRUE(follower->strobe().apply({.output = StrobeOutput::off}).ok());
  const Seconds between = Seconds(0.01) / (1 + kError.value() * 1e-6);
  const auto led = flashes(*leader);
  const auto followed = flashes(*follower);
  ASSERT_GT(led.size(), 20U);
  ASSERT_GT(followed.size(), 20U);
  for (const TimePoint flash : followed) {
    const double number = (flash - led.front()) / between;
    EXPECT_NEAR(number, std::round(number), kBracket / between);
  }
}

TEST_F(SharedLightThreads, AStrobeThatIsSetByHandIsNotShared) {
  VirtualRigOptions options;
  options.cameras = {testing_support::small_camera()};
  options.light = SharedLightOptions{file_, true};
  options.strobe.dial = VirtualDialOptions{};
  const auto refused = VirtualRig::create(options, clock_);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("by hand"));
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST(LightText, ReadsBackWhatIsWritten) {
  const std::vector<LightSetting> settings{
      {{1'800'000'000'123'456'789},
       {.output = kFlashes, .rate = Hertz(1438.6 / 60), .phase = Seconds(0.0123457), .code = {true, false}}},
      {{1'800'000'000'123'456'789}, {.output = StrobeOutput::steady}},
      {{1'800'000'001'000'000'000}, {.output = StrobeOutput::off}}};
  std::string text = first_light_line(PartsPerMillion(-0.1));
  for (const LightSetting& each : settings) text += light_line(each);
  LightText reader("light.txt");
  EXPECT_FALSE(reader.rate_error());
  EXPECT_EQ(reader.take(text).value(), settings);
  EXPECT_EQ(reader.rate_error(), PartsPerMillion(-0.1));
}

TEST(LightText, SaysWhatIsWrong) {
  const std::string good = "emberlock-light 1 0\n";
  const std::string setting = "1800000000000000000 flashing 24 0 2e-05 -\n";
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"\n", "l:1: this is no file of a shared strobe"},
           {std::string("\0\0\n", 3), "l:1: this is no file"},
           {"emberlock-light\n", "l:1: the version"},
           {"emberlock-light 2 0\n", "l:1: the version"},
           {"emberlock-light 1\n", "l:1: the error of the strobe's rate"},
           {"emberlock-light 1 nan\n", "l:1: the error of the strobe's rate"},
           {"emberlock-light 1 1001\n", "l:1: the error of the strobe's rate"},
           {"emberlock-light 1 0 0\n", "l:1: the error of the strobe's rate"},
           {good + "\n", "l:2: a setting has 1 words"},
           {good + "1 off 24 0 2e-05\n", "l:2: a setting has 5 words"},
           {good + "1 off 24 0 2e-05 - \n", "l:2: a setting has 7 words"},
           {good + "-1 off 24 0 2e-05 -\n", "l:2: a setting's instant"},
           {good + "1.5 off 24 0 2e-05 -\n", "l:2: a setting's instant"},
           {good + "9223372036854775807 off 24 0 2e-05 -\n", "l:2: a setting's instant"},
           {good + "9223372036854775808 off 24 0 2e-05 -\n", "l:2: a setting's instant"},
           {good + "1 on 24 0 2e-05 -\n", "l:2: there is no such output"},
           {good + "1 off x 0 2e-05 -\n", "l:2: a setting lacks a number"},
           {good + "1 off 24 0x 2e-05 -\n", "l:2: a setting lacks a number"},
           {good + "1 off 24 0 1e999 -\n", "l:2: a setting lacks a number"},
           {good + "1 off nan 0 2e-05 -\n", "l:2: the rate is nan"},
           {good + "1 off 1000 0 2e-05 -\n", "l:2: the rate is 1000"},
           {good + "1 off 24 0.1 2e-05 -\n", "l:2: the phase is 0.1"},
           {good + "1 off 24 -inf 2e-05 -\n", "l:2: the phase is -inf"},
           {good + "1 off 24 0 0 -\n", "l:2: the flash width is 0"},
           {good + "1 off 24 0 2e-05 102\n", "l:2: a code holds"},
           {good + "1 off 24 0 2e-05 \n", "l:2: a code holds"},
           {good + "1 off 24 0 2e-05 " + std::string(4097, '1') + "\n", "l:2: the code has 4097 flashes"},
           {good + setting + "1799999999999999999 off 24 0 2e-05 -\n", "l:3: a setting is older"},
           {good + setting + std::string(9000, '1'), "l:3: a line has no end"}}) {
    LightText reader("l");
    const auto settings = reader.take(text);
    ASSERT_FALSE(settings.ok()) << text;
    EXPECT_EQ(settings.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(settings.error().message(), testing::StartsWith(words));
    EXPECT_FALSE(settings.error().remedy.empty());
  }
}

}  // namespace
}  // namespace emberlock::drivers
