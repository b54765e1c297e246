// SPDX-License-Identifier: Apache-2.0
// The words of each dialect, by the makers' manuals, and answers that no device should give.
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/strobe_serial/controller/protocol.h"
#include "drivers/strobe_serial/dialect.h"

namespace emberlock::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const StrobeSettings kSettings{.output = StrobeOutput::flashing,
                               .rate = Hertz(20),
                               .phase = milliseconds(12.5),
                               .width = microseconds(20)};

std::vector<std::string> said(StrobeDialect dialect, const StrobeSettings& settings = kSettings,
                              const std::optional<StrobeSettings>& now = kSettings,
                              const DialectOptions& options = {}) {
  std::vector<std::string> texts;
  const auto commands = make_dialect(dialect, options).value()->apply(settings, now).value();
  for (const Command& c : commands) texts.push_back(c.text);
  return texts;
}
Result<StrobeSettings> told(StrobeDialect dialect, const std::vector<std::string>& answers,
                            const DialectOptions& options = {}) {
  return make_dialect(dialect, options).value()->settings(answers);
}

TEST(StrobeDialects, HaveNamesThatAreFoundAgain) {
  for (const StrobeDialect d : {StrobeDialect::emberlock, StrobeDialect::scpi, StrobeDialect::siglent_bswv,
                                StrobeDialect::gardasoft_rt, StrobeDialect::schott_cv_ls})
    EXPECT_EQ(parse_strobe_dialect(name_of(d)).value(), d);
  EXPECT_THAT(parse_strobe_dialect("morse").error().message(), HasSubstr("siglent-bswv"));
}

TEST(StrobeDialects, RefuseOptionsOutOfRange) {
  EXPECT_THAT(make_dialect(StrobeDialect::scpi, {.channel = 3}).error().message(), HasSubstr("1 to 2"));
  EXPECT_FALSE(make_dialect(StrobeDialect::emberlock, {.channel = 2}).ok());
  EXPECT_FALSE(make_dialect(StrobeDialect::gardasoft_rt, {.brightness = 0}).ok());
  EXPECT_FALSE(make_dialect(StrobeDialect::emberlock, {.watchdog = Seconds(0.05)}).ok());
}

TEST(ScpiDialect, SaysRateWidthAndPhaseInItsOwnUnits) {
  EXPECT_THAT(said(StrobeDialect::scpi),
              ElementsAre("*CLS", ":SOUR1:FUNC PULS", ":SOUR1:FUNC:PULS:WIDT 2e-05", ":SOUR1:FREQ 20",
                          ":SOUR1:PHAS 270.0000 DEG", ":OUTP1 ON", "SYST:ERR?"));
  EXPECT_THAT(
      said(StrobeDialect::scpi, kSettings, kSettings, {.channel = 2, .phase = ScpiPhase::delay}).at(4),
      ":SOUR2:PHAS 90.0000 DEG");
}

TEST(ScpiDialect, PhasesThatRoundToAFullTurnAreZero) {
  StrobeSettings s = kSettings;
  s.phase = nanoseconds(0.1);
  EXPECT_EQ(said(StrobeDialect::scpi, s).at(4), ":SOUR1:PHAS 0.0000 DEG");
}

TEST(ScpiDialect, ReadsThePhaseAsItsInstrumentMeansIt) {
  const std::vector<std::string> start{"PULS", "+2.0E+01", "2.0E-05", "+2.7E+02", "1"};
  EXPECT_NEAR(told(StrobeDialect::scpi, start)->phase.value(), 0.0125, 1e-12);
  const std::vector<std::string> delay{"PULS", "+2.0E+01", "2.0E-05", "+1.5707963268E+00", "ON"};
  EXPECT_NEAR(told(StrobeDialect::scpi, delay, {.phase = ScpiPhase::delay})->phase.value(), 0.0125, 1e-9);
}

TEST(ScpiDialect, RefusesAnswersThatSayNothing) {
  const std::vector<std::string> right{"PULS", "20", "2E-5", "0", "1"};
  ASSERT_TRUE(told(StrobeDialect::scpi, right).ok());
  const std::vector<std::pair<std::size_t, std::string>> wrong{
      {0, "20"}, {0, ""},    {1, "-20"}, {1, "0"},     {1, "2O"},  {1, "nan"}, {1, "inf"},
      {1, ""},   {1, "2 0"}, {2, "0"},   {2, "1e999"}, {3, "1,2"}, {4, "2"},   {4, ""}};
  for (const auto& [at, text] : wrong) {
    std::vector<std::string> answers = right;
    answers[at] = text;
    const auto settings = told(StrobeDialect::scpi, answers);
    ASSERT_FALSE(settings.ok()) << at << " " << text;
    EXPECT_EQ(settings.error().kind, ErrorKind::device);
  }
}

TEST(SiglentDialect, SaysTheDelayInSecondsAsAPulseHasNoPhase) {
  EXPECT_THAT(said(StrobeDialect::siglent_bswv),
              ElementsAre("C1:BSWV WVTP,PULSE,FRQ,20,WIDTH,2e-05,DLY,0.0125",
                          "C1:BSWV WIDTH,2e-05,DLY,0.0125", "C1:OUTP ON"));
}

TEST(SiglentDialect, ReadsWhatItsGuidePrints) {
  const std::string wave =
      "C1:BSWV "
      "WVTP,PULSE,FRQ,500HZ,PERI,0.00200000016S,AMP,5V,OFST,2.5V,HLEV,5V,LLEV,0V,DUTY,67,WIDTH,0.00134,DLY,0";
  const auto settings = told(StrobeDialect::siglent_bswv, {wave, "C1:OUTP ON,LOAD,HZ,PLRT,NOR"});
  ASSERT_TRUE(settings.ok()) << settings.error().message();
  EXPECT_EQ(*settings, (StrobeSettings{
                           .output = StrobeOutput::flashing, .rate = Hertz(500), .width = Seconds(0.00134)}));
}

TEST(SiglentDialect, RefusesAnotherChannelsAndMangledAnswers) {
  for (const char* wave :
       {"C2:BSWV WVTP,PULSE,FRQ,500HZ,WIDTH,0.001,DLY,0", "C1:BSWV WVTP,PULSE,FRQ,500HZ,WIDTH,0.001",
        "C1:BSWV WVTP,PULSE,FRQ,500HZ,FRQ,50HZ,WIDTH,0.001,DLY,0",
        "C1:BSWV WVTP,PULSE,FRQ,500HZ,WIDTH,0.001,DLY", "C1:BSWV WVTP,PULSE,FRQ,5OOHZ,WIDTH,0.001,DLY,0",
        "C1:BSWV WVTP,PULSE,FRQ,0HZ,WIDTH,0.001,DLY,0", ""}) {
    EXPECT_FALSE(told(StrobeDialect::siglent_bswv, {wave, "C1:OUTP ON"}).ok()) << wave;
  }
  EXPECT_FALSE(
      told(StrobeDialect::siglent_bswv, {"C1:BSWV WVTP,PULSE,FRQ,500HZ,WIDTH,0.001,DLY,0", "C1:OUTP O"})
          .ok());
}

TEST(GardasoftDialect, SaysPeriodAndPulseInMilliseconds) {
  EXPECT_THAT(said(StrobeDialect::gardasoft_rt),
              ElementsAre("GR", "RT1,0.020,12.510,100", "TT1,50.000", "GR"));
  StrobeSettings off = kSettings;
  off.output = StrobeOutput::off;
  EXPECT_THAT(said(StrobeDialect::gardasoft_rt, off), ElementsAre("GR", "RT1,0.020,12.510,100", "TT0", "GR"));
  StrobeSettings steady = kSettings;
  steady.output = StrobeOutput::steady;
  EXPECT_THAT(said(StrobeDialect::gardasoft_rt, steady, kSettings, {.channel = 8, .brightness = 12.5}),
              ElementsAre("GR", "RS8,12.5", "GR"));
}

TEST(GardasoftDialect, ReadsTimesInAnyOfItsUnits) {
  const auto settings =
      told(StrobeDialect::gardasoft_rt,
           {"TM 1, TP 50.00ms",
            "CH 1, MD 1, S 60.0, 0.0, DL 12.51ms, PU 20us, RT 0s, IP 1, FL 0, CS 0.5A, RA 5.0A"});
  ASSERT_TRUE(settings.ok()) << settings.error().message();
  EXPECT_EQ(settings->output, StrobeOutput::flashing);
  EXPECT_NEAR(settings->phase.value(), 0.0125, 1e-12);
  EXPECT_NEAR(settings->width.value(), 20e-6, 1e-15);
}

TEST(GardasoftDialect, RefusesAnotherChannelsAndMangledAnswers) {
  const std::string light = "CH 1, MD 1, S 60.0, DL 1ms, PU 2ms";
  ASSERT_TRUE(told(StrobeDialect::gardasoft_rt, {"TM 1, TP 20ms", light}).ok());
  for (const char* general :
       {"", "TM 1", "TM 1, TP", "TM 1, TP 0ms", "TM x, TP 20ms", "TM 1, TM 1, TP 20ms", "TM 1; TP 20ms"})
    EXPECT_FALSE(told(StrobeDialect::gardasoft_rt, {general, light}).ok()) << general;
  for (const char* other : {"CH 2, MD 1, S 60.0, DL 1ms, PU 2ms", "CH 1, MD 1, S 60.0, DL 1ms", "60, MD 1",
                            "CH 1, MD 1, S 60.0, DL 1ms, PU 2xs", "CH 1, MD 3, S 60.0, DL 1ms, PU 2ms"})
    EXPECT_FALSE(told(StrobeDialect::gardasoft_rt, {"TM 1, TP 20ms", other}).ok()) << other;
}

TEST(SchottDialect, SaysWholeHertzAndThousandths) {
  StrobeSettings s = kSettings;
  s.phase = {};
  s.width = milliseconds(5);
  EXPECT_THAT(said(StrobeDialect::schott_cv_ls, s),
              ElementsAre("&PM0", "&RF20", "&RD1,100", "&RM1", "&L1,1"));
}

TEST(SchottDialect, RefusesRefusalsAndMangledAnswers) {
  const auto dialect = make_dialect(StrobeDialect::schott_cv_ls).value();
  EXPECT_TRUE(dialect->accepted({"&RF20", Answer::status}, "&rf20").ok());
  EXPECT_THAT(dialect->accepted({"&RF20", Answer::status}, "&nRFp20").error().what,
              HasSubstr("refuses &RF20"));
  EXPECT_FALSE(dialect->accepted({"&RF20", Answer::status}, "&rd1,5").ok());
  const std::vector<std::string> right{"&l1,1", "&pm0", "&rm1", "&rf20", "&rd1,100"};
  ASSERT_TRUE(told(StrobeDialect::schott_cv_ls, right).ok());
  for (std::size_t i = 0; i < right.size(); ++i) {
    for (const char* wrong : {"", "&nRFp20", "&rf", "&l2,1", "&rd1,-5"}) {
      std::vector<std::string> answers = right;
      answers[i] = wrong;
      EXPECT_FALSE(told(StrobeDialect::schott_cv_ls, answers).ok()) << i << " " << wrong;
    }
  }
}

TEST(EmberlockDialect, FramesEachLineWithItsNumberAndChecksum) {
  EXPECT_EQ(emberlock_controller::crc16("123456789", 9), 0x29B1) << "CRC-16/CCITT-FALSE's check value";
  const auto dialect = make_dialect(StrobeDialect::emberlock).value();
  EXPECT_EQ(dialect->frame("hi", 7), ":07 hi*2F7E\n");
  EXPECT_THAT(said(StrobeDialect::emberlock, kSettings, kSettings, {.watchdog = Seconds(5)}),
              ElementsAre("set flash per=50000000 pha=12500000 wid=20000 len=0 sum=65535 dog=5000"));
  StrobeSettings coded = kSettings;
  coded.code = {true, false, true, true, false, false, false, false, true};
  EXPECT_THAT(said(StrobeDialect::emberlock, coded), ElementsAre("code 0 B080", HasSubstr("len=9 sum=")));
}

TEST(EmberlockDialect, PassesOverAnswersToOtherNumbersAndRefusesWrongChecksums) {
  const auto dialect = make_dialect(StrobeDialect::emberlock).value();
  std::string line = dialect->frame("ok", 7);
  line[0] = '=';
  const std::string body = line.substr(0, 6);
  line = body + fmt::format("*{:04X}", emberlock_controller::crc16(body.data(), body.size()));
  EXPECT_EQ(dialect->unframe(line, 7).value(), "ok");
  EXPECT_EQ(dialect->unframe(line, 8).value(), std::nullopt);
  for (std::size_t i = 0; i < line.size(); ++i) {
    std::string wrong = line;
    wrong[i] = static_cast<char>(wrong[i] ^ 1);
    EXPECT_FALSE(dialect->unframe(wrong, 7).ok()) << wrong;
    EXPECT_FALSE(dialect->unframe(line.substr(0, i), 7).ok()) << i;
  }
}

TEST(EmberlockDialect, TurnsTheControllersRangesIntoErrorsThatNameThem) {
  const auto dialect = make_dialect(StrobeDialect::emberlock).value();
  const Status status = dialect->accepted({"set flash wid=5000", Answer::status}, "err 3 wid 10000 49990000");
  EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(status.error().what, HasSubstr("wid"));
  EXPECT_EQ(status.error().remedy, "give 10000 to 49990000");
  EXPECT_EQ(dialect->accepted({"set", Answer::status}, "err 2 syntax").error().kind, ErrorKind::device);
  EXPECT_THAT(dialect->model("ok emberlock 2 uno 1").error().message(), HasSubstr("version 2"));
}

}  // namespace
}  // namespace emberlock::drivers
