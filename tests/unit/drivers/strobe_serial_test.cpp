// SPDX-License-Identifier: Apache-2.0
// What every strobe on a serial line does when the line or the device fails, over our simulations of the
// devices.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/strobe_bench.h"

namespace emberlock::drivers {
namespace {

using test::Fault;
using test::StrobeBench;
using testing::AnyOf;
using testing::HasSubstr;

constexpr StrobeSettings kAsked{
    .output = StrobeOutput::flashing, .rate = Hertz(25), .width = milliseconds(4)};

class SerialStrobeThreads : public testing::TestWithParam<StrobeDialect> {
 protected:
  void expect_same(const StrobeSettings& told, const StrobeSettings& asked) {
    EXPECT_EQ(told.output, asked.output);
    EXPECT_NEAR(told.rate.value(), asked.rate.value(), 1e-6);
    EXPECT_NEAR(told.width.value(), asked.width.value(), 1e-9);
    EXPECT_NEAR(told.phase.value(), asked.phase.value(), 1e-9);
  }
  bool numbered() const { return GetParam() == StrobeDialect::emberlock; }

  StrobeBench bench_{GetParam()};
};

TEST_P(SerialStrobeThreads, SaysItsModelAndTakesSettingsThatReadBack) {
  const auto model = bench_.strobe.greet(Seconds(1));
  ASSERT_TRUE(model.ok()) << model.error().message();
  EXPECT_THAT(*model, AnyOf(HasSubstr("33509B"), HasSubstr("SDG2042X"), HasSubstr("RT260F"),
                            HasSubstr("SCHOTT"), HasSubstr("uno E7531")));
  const Status applied = bench_.strobe.apply(kAsked);
  ASSERT_TRUE(applied.ok()) << applied.error().message();
  const auto told = bench_.strobe.read_back();
  ASSERT_TRUE(told.ok()) << told.error().message();
  expect_same(*told, kAsked);
}

TEST_P(SerialStrobeThreads, GoesDarkAndLightAgain) {
  for (const StrobeOutput output : {StrobeOutput::flashing, StrobeOutput::off, StrobeOutput::flashing}) {
    StrobeSettings s = kAsked;
    s.output = output;
    ASSERT_TRUE(bench_.strobe.apply(s).ok());
    EXPECT_EQ(bench_.strobe.read_back().value().output, output);
  }
}

TEST_P(SerialStrobeThreads, GoesFromLongFlashesOfASlowRateToShortOnesOfAFastOneAndBack) {
  for (int i = 0; i < 2; ++i) {
    for (const auto& [rate, width] : {std::pair{8.0, 0.1}, {250.0, 0.002}}) {
      const StrobeSettings s{.output = StrobeOutput::flashing, .rate = Hertz(rate), .width = Seconds(width)};
      const Status applied = bench_.strobe.apply(s);
      ASSERT_TRUE(applied.ok()) << applied.error().message();
      expect_same(bench_.strobe.read_back().value(), s);
    }
  }
}

TEST_P(SerialStrobeThreads, OneAnswerThatGoesWrongCostsATimeButNoError) {
  ASSERT_TRUE(bench_.strobe.apply(kAsked).ok());
  for (const Fault fault : {Fault::silent, Fault::garbled, Fault::truncated, Fault::late, Fault::chatter}) {
    bench_.spoil({fault});
    const double begin = bench_.seconds();
    const auto told = bench_.strobe.read_back();
    ASSERT_TRUE(told.ok()) << static_cast<int>(fault) << " " << told.error().message();
    expect_same(*told, kAsked);
    EXPECT_LT(bench_.seconds() - begin, 2) << static_cast<int>(fault);
  }
}

TEST_P(SerialStrobeThreads, ALateAnswerIsNeverTakenForTheNextOnes) {
  ASSERT_TRUE(bench_.strobe.apply(kAsked).ok());
  for (int lead = 0; lead < 4; ++lead) {
    bench_.spoil({Fault::none, Fault::none, Fault::none});
    bench_.faults.resize(static_cast<std::size_t>(lead));
    bench_.faults.insert(bench_.faults.end(), {Fault::late, Fault::late, Fault::silent});
    if (const auto told = bench_.strobe.read_back(); told.ok()) expect_same(*told, kAsked);
    bench_.faults.clear();
    const auto told = bench_.strobe.read_back();
    ASSERT_TRUE(told.ok()) << told.error().message();
    expect_same(*told, kAsked);
  }
}

TEST_P(SerialStrobeThreads, ASilentDeviceIsAnErrorWithinTwoSecondsThatSaysWhatToDo) {
  ASSERT_TRUE(bench_.strobe.apply(kAsked).ok());
  bench_.spoil_all(Fault::silent);
  const double begin = bench_.seconds();
  const auto told = bench_.strobe.read_back();
  ASSERT_FALSE(told.ok());
  EXPECT_EQ(told.error().kind, ErrorKind::timed_out);
  EXPECT_EQ(told.error().where, "strobe bench");
  EXPECT_THAT(told.error().remedy, HasSubstr("baud rate"));
  EXPECT_LT(bench_.seconds() - begin, 2);
  EXPECT_EQ(bench_.strobe.apply(kAsked).error().kind, ErrorKind::timed_out);

  bench_.spoil_all(Fault::none);
  EXPECT_TRUE(bench_.strobe.read_back().ok());
}

TEST_P(SerialStrobeThreads, AGarblingDeviceIsAnErrorAndNeverAGuess) {
  ASSERT_TRUE(bench_.strobe.apply(kAsked).ok());
  for (const Fault fault : {Fault::garbled, Fault::truncated, Fault::chatter}) {
    bench_.spoil_all(fault);
    const double begin = bench_.seconds();
    const auto told = bench_.strobe.read_back();
    ASSERT_FALSE(told.ok()) << static_cast<int>(fault);
    EXPECT_EQ(told.error().kind, ErrorKind::device);
    EXPECT_FALSE(told.error().remedy.empty());
    EXPECT_LT(bench_.seconds() - begin, 4);
    bench_.spoil_all(Fault::none);
    expect_same(bench_.strobe.read_back().value(), kAsked);
  }
}

TEST_P(SerialStrobeThreads, AnUnpluggedDeviceIsAnErrorAtOnceAndIsFoundAgainByTheNextCall) {
  ASSERT_TRUE(bench_.strobe.apply(kAsked).ok());
  bench_.plugged = false;
  const double begin = bench_.seconds();
  EXPECT_EQ(bench_.strobe.read_back().error().kind, ErrorKind::device);
  EXPECT_EQ(bench_.strobe.apply(kAsked).error().kind, ErrorKind::device);
  EXPECT_LT(bench_.seconds() - begin, 0.1);
  bench_.plugged = true;
  EXPECT_TRUE(bench_.strobe.read_back().ok());
  EXPECT_EQ(bench_.opened, 2);
}

TEST_P(SerialStrobeThreads, ADeviceThatBootsWhenItsPortIsOpenedIsWaitedFor) {
  bench_.spoil({Fault::silent, Fault::garbled, Fault::silent, Fault::none});
  EXPECT_TRUE(bench_.strobe.greet(Seconds(3)).ok());
  EXPECT_TRUE(bench_.strobe.apply(kAsked).ok());
}

TEST_P(SerialStrobeThreads, WhatCantBeIsRefusedWithoutAWordToTheDevice) {
  const auto refused = [&](StrobeSettings s, const char* what, const char* remedy) {
    const Status status = bench_.strobe.apply(s);
    ASSERT_FALSE(status.ok()) << what;
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(status.error().what, HasSubstr(what));
    EXPECT_THAT(status.error().remedy, HasSubstr(remedy));
  };
  refused({.rate = Hertz(400)}, "400 flashes a second", "to 333.33");
  refused({.rate = Hertz(0.1)}, "0.1 flashes a second", "give");
  refused({.rate = Hertz(std::nan(""))}, "nan", "give");
  refused({.rate = Hertz(25), .width = Seconds(0.05)}, "0.05", "less than a period of 0.04 s");
  refused({.rate = Hertz(25), .phase = Seconds(0.04)}, "0.04", "less than 0.04 s");
  refused({.rate = Hertz(25), .width = Seconds(0)}, "the flash width is 0 s", "give");
  if (!numbered()) refused({.code = {true, false}}, "can't skip flashes", "controller");
  EXPECT_EQ(bench_.heard, 0);
}

TEST_P(SerialStrobeThreads, ARateThatTheDeviceClampsWithoutAWordIsAnErrorThatNamesBoth) {
  bench_.device->silent_most_rate = 20;
  const Status status = bench_.strobe.apply(kAsked);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().what, HasSubstr("its rate is 20 flashes a second, asked for 25"));
  StrobeSettings slower = kAsked;
  slower.rate = Hertz(20);
  EXPECT_TRUE(bench_.strobe.apply(slower).ok());
}

TEST_P(SerialStrobeThreads, AWidthThatTheDeviceClampsWithoutAWordIsAnErrorThatNamesBoth) {
  bench_.device->silent_widest = 0.003;
  const Status status = bench_.strobe.apply(kAsked);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().what, HasSubstr("its flash width is 0.003 s, asked for 0.004 s"));
  StrobeSettings dark = kAsked;
  dark.output = StrobeOutput::off;
  EXPECT_TRUE(bench_.strobe.apply(dark).ok()) << "no flash that could be too short";
}

INSTANTIATE_TEST_SUITE_P(Dialects, SerialStrobeThreads, testing::ValuesIn(test::kAllDialects),
                         [](const auto& tested) {
                           std::string name(name_of(tested.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(SerialStrobeNumberedThreads, AnAnswerWithAWrongChecksumOrNumberIsAskedForAgain) {
  StrobeBench bench(StrobeDialect::emberlock);
  ASSERT_TRUE(bench.strobe.apply(kAsked).ok());
  for (const Fault fault : {Fault::flipped, Fault::renumbered, Fault::twice, Fault::silent}) {
    const std::uint8_t before = bench.as<test::ControllerDevice>().controller.changes();
    bench.spoil({Fault::none, fault, fault == Fault::twice ? fault : Fault::none});
    StrobeSettings s = kAsked;
    s.phase = milliseconds(1 + static_cast<int>(fault));
    ASSERT_TRUE(bench.strobe.apply(s).ok()) << static_cast<int>(fault);
    EXPECT_EQ(bench.strobe.read_back().value().phase, s.phase);
    // The command whose answer was lost was said twice and done once.
    EXPECT_EQ(bench.as<test::ControllerDevice>().controller.changes(), before + 1);
  }
}

TEST(SerialStrobeNumberedThreads, AlwaysWrongChecksumsAreAnError) {
  StrobeBench bench(StrobeDialect::emberlock);
  ASSERT_TRUE(bench.strobe.apply(kAsked).ok());
  bench.spoil_all(Fault::flipped);
  const auto told = bench.strobe.read_back();
  ASSERT_FALSE(told.ok());
  EXPECT_EQ(told.error().kind, ErrorKind::device);
  EXPECT_THAT(told.error().what, HasSubstr("checksum"));
}

TEST(SerialStrobeNumberedThreads, PlaysACodeAsLongAsTheFrameCodes) {
  StrobeBench bench(StrobeDialect::emberlock);
  for (const std::size_t length : {1, 7, 8, 31, 256, 257, 3720, 4096}) {
    StrobeSettings s = kAsked;
    for (std::size_t i = 0; i < length; ++i) s.code.push_back(i % 3 != 1 && i % 7 != 2);
    const Status applied = bench.strobe.apply(s);
    ASSERT_TRUE(applied.ok()) << length << " " << applied.error().message();
    EXPECT_EQ(bench.strobe.read_back().value().code, s.code) << length;
    for (std::size_t i = 0; i < length; ++i) {
      ASSERT_EQ(bench.as<test::ControllerDevice>().controller.flashes(static_cast<std::uint16_t>(i)),
                s.code[i]);
    }
    const int heard = bench.heard;
    s.phase = milliseconds(1);
    ASSERT_TRUE(bench.strobe.apply(s).ok());
    const int bits = static_cast<int>((length + 255) / 256);
    EXPECT_EQ(bench.heard - heard, 2 * (1 + bits) + 1) << "a code that is there is not sent again";
  }
  EXPECT_EQ(bench.strobe.apply({.code = std::vector<bool>(4097)}).error().kind, ErrorKind::bad_input);
}

TEST(SerialStrobeDevicesThreads, AnInterlockThatKeepsTheLightOffIsAnError) {
  StrobeBench bench(StrobeDialect::scpi);
  bench.as<test::ScpiDevice>().takes_settings = false;
  const Status status = bench.strobe.apply(kAsked);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().remedy, HasSubstr("interlock"));
}

TEST(SerialStrobeDevicesThreads, OldErrorsInAnInstrumentsQueueAreNotOurs) {
  StrobeBench bench(StrobeDialect::scpi);
  bench.as<test::ScpiDevice>().errors = {"-410,\"Query INTERRUPTED\"", "-113,\"Undefined header\""};
  EXPECT_TRUE(bench.strobe.apply(kAsked).ok());
  EXPECT_TRUE(bench.as<test::ScpiDevice>().errors.empty());
}

TEST(SerialStrobeDevicesThreads, WhatAnInstrumentRefusesIsToldWithItsOwnWords) {
  StrobeBench bench(StrobeDialect::scpi);
  bench.as<test::ScpiDevice>().most_rate = 20;
  const Status status = bench.strobe.apply(kAsked);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(status.error().what, HasSubstr("-222,\"Data out of range\""));
}

TEST(SerialStrobeDevicesThreads, ADelayThatAGeneratorIgnoresIsAnError) {
  StrobeBench bench(StrobeDialect::siglent_bswv);
  bench.as<test::SiglentDevice>().takes_delay = false;
  StrobeSettings s = kAsked;
  s.phase = milliseconds(39.5);
  const Status status = bench.strobe.apply(s);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().what, HasSubstr("its phase is 0 s, asked for 0.0395 s"));
}

TEST(SerialStrobeDevicesThreads, AGeneratorThatMakesNoPulsesIsNoStrobeUntilItIsSetUp) {
  for (const StrobeDialect dialect : {StrobeDialect::scpi, StrobeDialect::siglent_bswv}) {
    StrobeBench bench(dialect);
    EXPECT_EQ(bench.strobe.read_back().value().output, StrobeOutput::off);
    if (dialect == StrobeDialect::scpi)
      bench.as<test::ScpiDevice>().on = true;
    else
      bench.as<test::SiglentDevice>().on = true;
    EXPECT_THAT(bench.strobe.read_back().error().message(), HasSubstr("no pulses"));
    EXPECT_TRUE(bench.strobe.apply(kAsked).ok());
  }
}

TEST(SerialStrobeDevicesThreads, SomebodyElsesDeviceIsNotGreeted) {
  for (const StrobeDialect spoken : test::kAllDialects) {
    for (const StrobeDialect understood : test::kAllDialects) {
      if (spoken == understood) continue;
      // A Siglent understands *IDN? as well, and whoever calls it an SCPI instrument may be right.
      if (spoken == StrobeDialect::scpi && understood == StrobeDialect::siglent_bswv) continue;
      StrobeBench bench(make_dialect(spoken).value(), test::make_device(understood));
      EXPECT_FALSE(bench.strobe.greet(Seconds(1)).ok()) << name_of(spoken) << " to " << name_of(understood);
      EXPECT_LT(bench.seconds(), 2);
    }
  }
}

TEST(SerialStrobeDevicesThreads, AGardasoftMayEchoAndWhatItAdjustsIsAnError) {
  StrobeBench bench(StrobeDialect::gardasoft_rt);
  bench.as<test::GardasoftDevice>().echoes = true;
  ASSERT_TRUE(bench.strobe.apply(kAsked).ok());
  bench.as<test::GardasoftDevice>().widest = 3;
  EXPECT_THAT(bench.strobe.apply(kAsked).error().what, HasSubstr("0.003 s, asked for 0.004 s"));
  EXPECT_NEAR(bench.strobe.read_back().value().width.value(), 0.003, 1e-9);
}

TEST(SerialStrobeDevicesThreads, AGardasoftThatReportsAFaultOfItsLightIsAnError) {
  StrobeBench bench(StrobeDialect::gardasoft_rt);
  bench.as<test::GardasoftDevice>().event = 34;
  EXPECT_TRUE(bench.strobe.apply(kAsked).ok()) << "a fault of the past is cleared first";
  bench.as<test::GardasoftDevice>().lamp_fails = true;
  const Status status = bench.strobe.apply(kAsked);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().what, HasSubstr("Evt1,34"));
}

TEST(SerialStrobeDevicesThreads, SteadyLightIsForThoseThatCan) {
  for (const StrobeDialect dialect : test::kAllDialects) {
    StrobeBench bench(dialect);
    StrobeSettings s = kAsked;
    s.output = StrobeOutput::steady;
    const Status status = bench.strobe.apply(s);
    if (dialect == StrobeDialect::scpi || dialect == StrobeDialect::siglent_bswv) {
      EXPECT_THAT(status.error().what, HasSubstr("steady"));
    } else {
      ASSERT_TRUE(status.ok()) << name_of(dialect) << " " << status.error().message();
      EXPECT_EQ(bench.strobe.read_back().value().output, StrobeOutput::steady);
    }
  }
}

TEST(SerialStrobeDevicesThreads, ASchottRoundsToWholeHertzAndThousandthsAndHasNoPhase) {
  StrobeBench bench(StrobeDialect::schott_cv_ls);
  ASSERT_TRUE(bench.strobe.apply({.output = StrobeOutput::flashing, .rate = Hertz(23.976)}).ok());
  const StrobeSettings told = bench.strobe.read_back().value();
  EXPECT_EQ(told.rate, Hertz(24));
  EXPECT_NEAR(told.width.value(), 1.0 / 24000, 1e-12);
  const Status status = bench.strobe.apply({.rate = Hertz(24), .phase = milliseconds(1)});
  EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(status.error().remedy, HasSubstr("triggered"));
  EXPECT_THAT(bench.strobe.apply({.rate = Hertz(5)}).error().remedy, HasSubstr("give 6 to 333.33"));
}

}  // namespace
}  // namespace emberlock::drivers
