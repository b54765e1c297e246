// SPDX-License-Identifier: Apache-2.0
// The code that runs on our microcontroller, without one.
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/strobe_serial/controller/protocol.h"

namespace emberlock_controller {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class ControllerThreads : public testing::Test {
 protected:
  std::string framed(const std::string& text, int number) {
    const std::string line = fmt::format(":{:02X} {}", number, text);
    return fmt::format("{}*{:04X}\n", line, crc16(line.data(), line.size()));
  }
  /// The answer without its frame; nothing when there is none.
  std::string raw(const std::string& bytes, std::uint32_t now_ms = 0) {
    std::string said;
    for (const char c : bytes) {
      if (controller_.take(c, now_ms)) said += controller_.reply();
    }
    return said;
  }
  std::string ask(const std::string& text, std::uint32_t now_ms = 0) {
    const std::string said = raw(framed(text, number_ = (number_ + 1) % 256), now_ms);
    if (said.size() < 10) return said;
    const std::string body = said.substr(0, said.size() - 6);
    EXPECT_EQ(said.substr(said.size() - 6), fmt::format("*{:04X}\n", crc16(body.data(), body.size())));
    EXPECT_THAT(body, StartsWith(fmt::format("={:02X} ", number_)));
    return body.substr(4);
  }
  static std::string set(const std::string& what) { return "set " + what + " len=0 sum=65535 dog=0"; }

  int number_ = 0;
  Controller controller_{{.model = "uno", .serial = "E7531", .tick = 500, .shortest_width = 10000}};
};

TEST_F(ControllerThreads, SaysWhatItIsAndIsDarkWhenSwitchedOn) {
  EXPECT_EQ(ask("hi"), "ok emberlock 1 uno E7531 tick=500 wid=10000 code=4096");
  EXPECT_EQ(ask("get"), "ok off per=41708375 pha=0 wid=20000 len=0 sum=65535 dog=0 n=0 bad=0");
}

TEST_F(ControllerThreads, AnswersTheExampleOfItsDocumentToTheByte) {
  std::ifstream document(std::string(EMBERLOCK_SOURCE_DIR) + "/drivers/strobe_serial/PROTOCOL.md");
  std::string asked;
  int answers = 0;
  bool example = false;
  for (std::string line; std::getline(document, line);) {
    example = example || line.starts_with("An example");
    if (example && line.starts_with("    :")) asked = line.substr(4);
    if (!example || !line.starts_with("    =")) continue;
    EXPECT_EQ(raw(asked + "\n"), line.substr(4) + "\n");
    ++answers;
  }
  EXPECT_EQ(answers, 3);
}

TEST_F(ControllerThreads, FitsAChipOfTwoKilobytes) { EXPECT_LE(sizeof(Controller), 1450U); }

TEST_F(ControllerThreads, RoundsPhaseAndWidthToItsTicks) {
  EXPECT_EQ(ask(set("flash per=41708375 pha=749 wid=20250")),
            "ok flash per=41708375 pha=500 wid=20500 len=0 sum=65535 dog=0 n=0 bad=0");
  EXPECT_EQ(ask(set("flash per=3000300 pha=3000299 wid=2990000")),
            "ok flash per=3000300 pha=3000000 wid=2990000 len=0 sum=65535 dog=0 n=0 bad=0");
}

TEST_F(ControllerThreads, RefusesWhatIsOutOfItsRangeAndStaysAsItWas) {
  EXPECT_EQ(ask(set("flash per=2999999 pha=0 wid=20000")), "err 3 per 3000000 2000000000");
  EXPECT_EQ(ask(set("flash per=5000000 pha=5000000 wid=20000")), "err 3 pha 0 4999999");
  EXPECT_EQ(ask(set("flash per=5000000 pha=0 wid=9999")), "err 3 wid 10000 4990000");
  EXPECT_EQ(ask("set flash per=5000000 pha=0 wid=20000 len=4097 sum=0 dog=0"), "err 3 len 0 4096");
  EXPECT_EQ(ask("set flash per=5000000 pha=0 wid=20000 len=0 sum=65535 dog=99"), "err 3 dog 100 600000");
  EXPECT_EQ(ask("code 4096 FF"), "err 3 code 0 4088");
  EXPECT_THAT(ask("get"), StartsWith("ok off per=41708375"));
}

TEST_F(ControllerThreads, RefusesWhatItDoesntUnderstand) {
  EXPECT_EQ(ask("jump"), "err 1 command");
  EXPECT_EQ(ask("hi there"), "err 1 command");
  for (const char* text :
       {"set", "set blink", "set flash", "set flash per=", "set flash per=4294967296 pha=0",
        "set flash pha=0 per=5000000 wid=20000 len=0 sum=65535 dog=0",
        "set flash per=5000000 pha=0 wid=20000 len=0 sum=65535 dog=0 x=1", "code 4 FF", "code 0 F",
        "code 0 fg", "code 0", "code FF", "bits", "bits 3", "bits 0 1"}) {
    EXPECT_EQ(ask(text), "err 2 syntax") << text;
  }
}

TEST_F(ControllerThreads, PlaysACodeOnlyOnceItsSumIsRight) {
  EXPECT_EQ(ask("code 0 B080"), "ok");
  EXPECT_THAT(ask("get"), HasSubstr("len=0"));
  EXPECT_EQ(ask("set flash per=5000000 pha=0 wid=20000 len=9 sum=1 dog=0"), "err 4 code");
  const char code[] = {'\xB0', '\x80'};
  EXPECT_THAT(ask(fmt::format("set flash per=5000000 pha=0 wid=20000 len=9 sum={} dog=0", crc16(code, 2))),
              HasSubstr("len=9"));
  std::string played;
  for (std::uint16_t i = 0; i < 9; ++i) played += controller_.flashes(i) ? '1' : '0';
  EXPECT_EQ(played, "101100001");
  EXPECT_THAT(ask("bits 0"), StartsWith("ok 0 B08000"));
  EXPECT_EQ(ask("bits 4088"), "ok 4088 00");
  // It needs no new upload to play on at another rate.
  EXPECT_THAT(ask(fmt::format("set flash per=6000000 pha=0 wid=20000 len=9 sum={} dog=0", crc16(code, 2))),
              HasSubstr("per=6000000"));
}

TEST_F(ControllerThreads, ALineSaidTwiceIsDoneOnceAndAnsweredTwice) {
  const std::string line = framed(set("flash per=5000000 pha=0 wid=20000"), 9);
  const std::string first = raw(line);
  EXPECT_EQ(controller_.changes(), 1);
  EXPECT_EQ(raw(line), first);
  EXPECT_EQ(controller_.changes(), 1);
  raw(framed(set("flash per=5000000 pha=0 wid=20000"), 10));
  EXPECT_EQ(controller_.changes(), 2);
}

TEST_F(ControllerThreads, SaysNothingToADamagedLineAndCountsIt) {
  const std::string line = framed("get", 3);
  int damaged = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    std::string wrong = line;
    wrong[i] = static_cast<char>(wrong[i] ^ 2);
    EXPECT_EQ(raw(wrong), "") << wrong;
    ++damaged;
  }
  EXPECT_EQ(raw(std::string(1000, 'x') + "\n"), "");
  EXPECT_EQ(raw("\n\r\n"), "") << "empty lines are nothing";
  EXPECT_THAT(ask("get"), HasSubstr(fmt::format("bad={}", damaged + 1)));
}

TEST_F(ControllerThreads, GoesDarkWhenNobodySpeaksForAsLongAsItWasTold) {
  ask("set steady per=5000000 pha=0 wid=20000 len=0 sum=65535 dog=1000", 5000);
  EXPECT_FALSE(controller_.watch(5999));
  ask("get", 5999);
  EXPECT_FALSE(controller_.watch(6998));
  EXPECT_TRUE(controller_.watch(6999));
  EXPECT_FALSE(controller_.watch(9999));
  EXPECT_THAT(ask("get", 9999), StartsWith("ok off per=5000000"));
}

TEST_F(ControllerThreads, TheLongestAnswerFitsItsLine) {
  for (int i = 0; i < 0x10001; ++i) raw("x\n");
  controller_.set_flashes(0xFFFFFFFF);
  for (int at = 0; at < 4096; at += 256)
    EXPECT_EQ(ask(fmt::format("code {} {}", at, std::string(64, 'F'))), "ok");
  const std::string code(512, '\xFF');
  const std::string said =
      ask(fmt::format("set steady per=2000000000 pha=1999999999 wid=1999990000 len=4096 sum={} dog=600000",
                      crc16(code.data(), code.size())));
  EXPECT_THAT(said, testing::EndsWith("dog=600000 n=4294967295 bad=65535"));
  EXPECT_LE(said.size() + 9, std::size_t{kLongestLine});
}

}  // namespace
}  // namespace emberlock_controller
