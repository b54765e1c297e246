// SPDX-License-Identifier: Apache-2.0
// Strobes behind the kernel's own serial drivers: a gadget's usb_f_acm at one end, cdc-acm and our driver at
// the other. EMBERLOCK_UNPLUG_ROUNDS says how often the plug is pulled (5).
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/ioctl.h>

#include "drivers/strobe_serial/strobe_serial.h"
#include "tests/support/wait.h"
#include "tests/vm/strobe/far_end.h"
#include "tests/vm/support/gadget.h"

namespace emberlock {
namespace {

using test::FarEnd;
using test::Trouble;
using testing::HasSubstr;

constexpr drivers::StrobeSettings kSettings{
    .output = drivers::StrobeOutput::flashing, .rate = Hertz(25), .width = milliseconds(4)};
constexpr const char* kSerial = "E7531";

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::optional<drivers::StrobeFound> found() {
  const auto all = drivers::find_serial_strobes();
  if (!all) return {};
  for (const drivers::StrobeFound& strobe : *all) {
    if (strobe.id == kSerial) return strobe;
  }
  return {};
}

int open_descriptors() {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

class StrobeOnTheUsb : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    gadget_ = std::make_unique<SerialGadget>(kSerial);
    far_end_ = std::make_unique<FarEnd>(test::make_device(drivers::StrobeDialect::emberlock));
  }
  static void TearDownTestSuite() {
    far_end_.reset();
    gadget_.reset();
  }
  void SetUp() override {
    ASSERT_TRUE(gadget_->ready()) << "no gadget: has the kernel dummy_hcd, libcomposite and cdc-acm?";
    ASSERT_TRUE(test::wait_until([] { return found().has_value(); }));
    far_end_->trouble(Trouble::none);
  }
  std::unique_ptr<drivers::Strobe> open(drivers::StrobeDialect dialect, std::optional<int> baud = {}) {
    far_end_->replace(test::make_device(dialect));
    auto strobe = drivers::open_serial_strobe(kSerial, {.dialect = dialect, .baud = baud});
    EXPECT_TRUE(strobe.ok()) << drivers::name_of(dialect) << ": " << strobe.error().message();
    return strobe.ok() ? std::move(*strobe) : nullptr;
  }
  static void expect_set(drivers::Strobe& strobe, const std::string& what) {
    const Status applied = strobe.apply(kSettings);
    ASSERT_TRUE(applied.ok()) << what << ": " << applied.error().message();
    const auto told = strobe.read_back();
    ASSERT_TRUE(told.ok()) << what << ": " << told.error().message();
    EXPECT_EQ(told->output, kSettings.output) << what;
    EXPECT_NEAR(told->rate.value(), kSettings.rate.value(), 1e-6) << what;
    EXPECT_NEAR(told->width.value(), kSettings.width.value(), 1e-8) << what;
  }

  static inline std::unique_ptr<SerialGadget> gadget_;
  static inline std::unique_ptr<FarEnd> far_end_;
};

TEST_F(StrobeOnTheUsb, IsFoundByItsSerialNumberWithItsMakersWords) {
  const auto strobe = found();
  EXPECT_EQ(strobe->model, "Emberlock strobe controller");
  EXPECT_THAT(strobe->address, HasSubstr("/dev/ttyACM"));
  // Who sees a new line's end first may open it for a moment.
  EXPECT_TRUE(test::wait_until([] { return !found()->holder; }));
  // The place will do as well.
  EXPECT_TRUE(drivers::open_serial_strobe("usb-dummy_hcd.0-1:1.0", {}).ok());
  EXPECT_THAT(drivers::open_serial_strobe("E0", {}).error().message(),
              HasSubstr("strobe E0: it isn't plugged in"));
}

TEST_F(StrobeOnTheUsb, EachDialectIsSetAndReadBack) {
  for (const drivers::StrobeDialect dialect : test::kAllDialects) {
    const Stopwatch watch;
    if (const auto strobe = open(dialect)) expect_set(*strobe, std::string(drivers::name_of(dialect)));
    std::cout << fmt::format("[ measured ] {}: opened, set and read back in {:.2f} s\n",
                             drivers::name_of(dialect), watch.seconds());
  }
}

TEST_F(StrobeOnTheUsb, EachDialectIsToldFromTheOthers) {
  for (const drivers::StrobeDialect dialect :
       {drivers::StrobeDialect::emberlock, drivers::StrobeDialect::siglent_bswv}) {
    far_end_->replace(test::make_device(dialect));
    const auto who = drivers::identify_strobe(kSerial);
    ASSERT_TRUE(who.ok()) << drivers::name_of(dialect) << ": " << who.error().message();
    EXPECT_EQ(who->dialect, dialect) << who->model;
  }
}

TEST_F(StrobeOnTheUsb, SpeaksAtAnyBaud) {
  for (const int baud : {1200, 9600, 57600, 115200, 921600}) {
    if (const auto strobe = open(drivers::StrobeDialect::emberlock, baud))
      expect_set(*strobe, fmt::format("{} baud", baud));
  }
  const auto never = drivers::open_serial_strobe(kSerial, {.baud = 7});
  EXPECT_EQ(never.error().kind, ErrorKind::bad_input);
}

TEST_F(StrobeOnTheUsb, ItsLinesEndIsLeftUpSoThatNoReopeningResetsIt) {
  ASSERT_TRUE(open(drivers::StrobeDialect::emberlock));
  const UniqueFd tty(::open(found()->address.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  ASSERT_EQ(::tcgetattr(tty.get(), &settings), 0);
  EXPECT_EQ(settings.c_cflag & HUPCL, 0U);
}

TEST_F(StrobeOnTheUsb, ACodeOf3720FlashesIsPlayed) {
  const auto strobe = open(drivers::StrobeDialect::emberlock);
  ASSERT_TRUE(strobe);
  drivers::StrobeSettings s = kSettings;
  for (int i = 0; i < 3720; ++i) s.code.push_back(i % 5 != 2);
  const Stopwatch watch;
  const Status applied = strobe->apply(s);
  ASSERT_TRUE(applied.ok()) << applied.error().message();
  std::cout << fmt::format("[ measured ] a code of 3720 flashes set and verified in {:.2f} s\n",
                           watch.seconds());
  EXPECT_EQ(strobe->read_back().value().code, s.code);
}

TEST_F(StrobeOnTheUsb, SilenceLatenessAndNoiseAreErrorsUntilTheyEnd) {
  for (const drivers::StrobeDialect dialect : test::kAllDialects) {
    const auto strobe = open(dialect);
    ASSERT_TRUE(strobe);
    expect_set(*strobe, std::string(drivers::name_of(dialect)));
    for (const Trouble trouble : {Trouble::silent, Trouble::garbled, Trouble::late}) {
      far_end_->trouble(trouble);
      const auto told = strobe->read_back();
      // What is late only may still be right in time by saying it again.
      EXPECT_TRUE(!told.ok() || trouble == Trouble::late)
          << drivers::name_of(dialect) << static_cast<int>(trouble);
      if (!told.ok()) {
        EXPECT_THAT(told.error().where, HasSubstr(kSerial));
      }
      far_end_->trouble(Trouble::none);
      EXPECT_TRUE(test::wait_until([&] { return strobe->read_back().ok(); })) << drivers::name_of(dialect);
      expect_set(*strobe, std::string(drivers::name_of(dialect)));
    }
  }
}

TEST_F(StrobeOnTheUsb, APortThatAProgramHasIsNamedWithIt) {
  const std::string address = found()->address;
  ASSERT_EQ(std::system(("sleep 30 <" + address + " & sleep 0.2").c_str()), 0);
  EXPECT_TRUE(test::wait_until([] { return found()->holder.has_value(); }));
  const auto refused = drivers::open_serial_strobe(kSerial, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("sleep"));
  ASSERT_EQ(std::system(fmt::format("kill {}", found()->holder->pid).c_str()), 0);
  EXPECT_TRUE(test::wait_until([] { return !found()->holder; }));
}

TEST_F(StrobeOnTheUsb, UnpluggedItIsReportedAndFoundAgainByItsNumberWithoutALeak) {
  const char* wished = std::getenv("EMBERLOCK_UNPLUG_ROUNDS");
  const int rounds = wished != nullptr ? std::atoi(wished) : 5;
  const int descriptors = open_descriptors();
  std::size_t memory = 0;
  double slowest_report = 0, slowest_return = 0;
  for (int round = 0; round < rounds; ++round) {
    const auto strobe = open(test::kAllDialects[static_cast<std::size_t>(round) % test::kAllDialects.size()]);
    ASSERT_TRUE(strobe);
    expect_set(*strobe, "before");
    // In the middle of a question as well as between two.
    const bool in_a_question = round % 2 == 0;
    if (in_a_question) far_end_->trouble(Trouble::silent);
    static constexpr double kLater = 0.1;
    std::thread plug([this] {
      std::this_thread::sleep_for(std::chrono::duration<double>(kLater));
      gadget_->unplug();
    });
    if (!in_a_question) plug.join();
    const Stopwatch report;
    const auto told = strobe->read_back();
    slowest_report = std::max(slowest_report, report.seconds() - (in_a_question ? kLater : 0));
    if (in_a_question) plug.join();
    ASSERT_FALSE(told.ok());
    EXPECT_EQ(told.error().kind, ErrorKind::device) << told.error().message();
    far_end_->trouble(Trouble::none);
    EXPECT_EQ(strobe->apply(kSettings).error().kind, ErrorKind::device);
    const Stopwatch back;
    gadget_->plug();
    ASSERT_TRUE(test::wait_until([&] { return strobe->read_back().ok(); })) << "round " << round;
    slowest_return = std::max(slowest_return, back.seconds());
    expect_set(*strobe, "after");
    // By then each dialect has been spoken once.
    if (round + 1 == static_cast<int>(test::kAllDialects.size())) memory = ::mallinfo2().uordblks;
  }
  // Of the gadget's end one more or less may be open.
  EXPECT_NEAR(open_descriptors(), descriptors, 1);
  if (memory != 0) {
    EXPECT_LT(::mallinfo2().uordblks, memory + 64 * 1024);
  }
  std::cout << fmt::format(
      "[ measured ] {} rounds: unplugged reported within {:.2f} s, back within {:.2f} s\n", rounds,
      slowest_report, slowest_return);
}

}  // namespace
}  // namespace emberlock
