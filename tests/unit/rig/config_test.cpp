// SPDX-License-Identifier: Apache-2.0
#include "rig/config/config.h"

#include <fstream>
#include <regex>
#include <set>

#include <gmock/gmock.h>

#include "tests/support/recording.h"

namespace emberlock::rig {
namespace {
using ::testing::HasSubstr;

DaemonConfig parsed(const std::string& text) {
  const auto config = parse_config(text, "/etc/emberlock/emberlockd.toml");
  EXPECT_TRUE(config.ok()) << config.error().message();
  return config ? *config : DaemonConfig{};
}

/// The first problem's message.
std::string problem(const std::string& text) {
  const ConfigReading reading = read_config(text, "lab.toml");
  return reading.problems.empty() ? "" : reading.problems.front().message();
}

/// The commented file with every key of it in force.
std::string uncommented() {
  return std::regex_replace(commented_config(), std::regex("\n#(?=[a-z\\[])"), "\n");
}

TEST(Config, TheCommentedFileSaysWhatTheEmptyOneSaysButForASimulatedRig) {
  const std::string nothing = print_config(parsed(""));
  DaemonConfig commented = parsed(commented_config());
  ASSERT_EQ(commented.rig.cameras.size(), 1u);
  EXPECT_EQ(commented.rig.cameras[0].count, 4);
  EXPECT_EQ(commented.rig.strobe.source, StrobeSource::virtual_);
  commented.rig = {};
  EXPECT_EQ(print_config(commented), nothing);
  EXPECT_THAT(nothing, HasSubstr("policy = \"timed\"\n"));
  EXPECT_THAT(nothing, HasSubstr("flash_width_us = 20\n"));
  EXPECT_THAT(nothing, HasSubstr("picture_width = 480\n"));
}

TEST(Config, WhatTheFileLeavesToTheMachineIsFilledIn) {
  const test::TempFolder prefix;
  for (const char* folder : {"bin", "sbin"}) std::filesystem::create_directory(prefix / folder);
  DaemonConfig config = parsed("");
  fill_in(config, {"/run/user/7/emberlock", "/home/ada/data"}, prefix / "sbin/emberlockd");
  EXPECT_EQ(config.server.socket, "/run/user/7/emberlock/emberlockd.sock");
  EXPECT_EQ(config.recording.folder, "/home/ada/data/sessions");
  EXPECT_EQ(config.server.console, prefix / "share/emberlock/console");
  EXPECT_EQ(config.reconstruction.program, "emberlock") << "none is beside it: the one in PATH";
  std::ofstream(prefix / "bin/emberlock") << "#!/bin/sh\n";
  std::filesystem::permissions(prefix / "bin/emberlock", std::filesystem::perms::owner_all);
  for (const char* daemon : {"sbin/emberlockd", "bin/emberlockd"}) {
    DaemonConfig found = parsed("");
    fill_in(found, {}, prefix / daemon);
    EXPECT_EQ(found.reconstruction.program, prefix / "bin/emberlock") << daemon;
  }
  DaemonConfig said = parsed(
      "[server]\nsocket = \"/a/b.sock\"\n[recording]\nfolder = \"/c\"\n[reconstruction]\n"
      "program = \"emberlock\"\n");
  fill_in(said, {"/run/user/7/emberlock", "/home/ada/data"}, prefix / "bin/emberlockd");
  EXPECT_EQ(said.server.socket, "/a/b.sock");
  EXPECT_EQ(said.recording.folder, "/c");
  EXPECT_EQ(said.reconstruction.program, "emberlock");
}

TEST(Config, WhatIsPrintedIsReadAgain) {
  std::string text = uncommented();
  text =
      std::regex_replace(text, std::regex("\n(controls|host) = .*"), "");  // of others than simulated cameras
  const ConfigReading once = read_config(text, "/etc/emberlock/emberlockd.toml");
  ASSERT_TRUE(once.problems.empty()) << once.problems.front().message();
  const std::string printed = print_config(once.config);
  EXPECT_THAT(printed, HasSubstr("token_file = \"/etc/emberlock/token\"\n"));
  EXPECT_EQ(print_config(parsed(printed)), printed);
}

TEST(Config, TheCommentedFileExplainsEveryKeyWithRangeAndDefault) {
  const std::string text = commented_config();
  EXPECT_THAT(
      text,
      HasSubstr(
          "# Duration of one flash of the strobe. A number from 0.1 to 10000.\n#flash_width_us = 20\n"));
  EXPECT_THAT(text, HasSubstr("\"virtual\", \"v4l2\", \"aravis\", \"ptp\", \"replay\" or \"remote\""));
}

TEST(Config, AStrobeMayBeSetByHand) {
  const char* const camera = "[[rig.camera]]\ndriver = \"virtual\"\n";
  const StrobeConfig strobe =
      parsed(std::string(camera) + "[rig.strobe]\ndriver = \"manual\"\ndial_step = 1\n").rig.strobe;
  EXPECT_EQ(strobe.source, StrobeSource::manual);
  EXPECT_NEAR(60 * strobe.dial.step.value(), 1, 1e-12);
  EXPECT_THAT(print_config(parsed("")), HasSubstr("dial_step = 0.1\n"));
  EXPECT_FALSE(parse_config(std::string(camera) + "[rig.strobe]\ndial_step = 0\n", "c.toml").ok());
}

TEST(Config, VirtualReplayAndRealCamerasMixInOneRig) {
  const RigConfig rig = parsed(R"(
[[rig.camera]]
driver = "virtual"
count = 3
size = "640x480"
rate_hz = 24
[[rig.camera]]
driver = "replay"
id = "left"
[[rig.camera]]
driver = "aravis"
id = "Lucid-1234"
format = "gray16"
exposure_ms = 4
controls = { Gain = 3, PacketResend = "never", ReverseX = true, Gamma = 0.5 }
reset = "by-hand"
sensor = "rolling"
direction = "bottom-first"
[rig.replay]
session = "sessions/old"
[rig.strobe]
driver = "serial"
id = "ttyUSB0"
dialect = "scpi"
scpi_phase = "delay"
)")
                            .rig;
  ASSERT_EQ(rig.cameras.size(), 3u);
  EXPECT_EQ(rig.cameras[0].count, 3);
  EXPECT_EQ(rig.cameras[0].request.size, (ImageSize{640, 480}));
  EXPECT_EQ(rig.cameras[0].request.frame_rate, Hertz(24));
  EXPECT_EQ(rig.cameras[1].source, CameraSource::replay);
  EXPECT_EQ(rig.replay_session, "/etc/emberlock/sessions/old");
  const CameraConfig& real = rig.cameras[2];
  EXPECT_EQ(real.id, "Lucid-1234");
  EXPECT_EQ(real.request.format, PixelFormat::gray16);
  EXPECT_DOUBLE_EQ(in_milliseconds(*real.request.exposure), 4);
  EXPECT_THAT(real.request.controls,
              ::testing::UnorderedElementsAre(std::pair("Gain", "3"), std::pair("PacketResend", "never"),
                                              std::pair("ReverseX", "1"), std::pair("Gamma", "0.5")));
  EXPECT_EQ(real.reset, ShutterReset::by_hand);
  EXPECT_EQ(real.sensor, SensorKind::rolling_shutter);
  EXPECT_EQ(real.direction, smear::ReadDirection::bottom_first);
  EXPECT_EQ(rig.strobe.request.dialect, drivers::StrobeDialect::scpi);
  EXPECT_EQ(rig.strobe.request.options.phase, drivers::ScpiPhase::delay);
}

TEST(Config, UnitsAreThoseOfTheKeysNames) {
  const DaemonConfig config = parsed(R"(
[alignment]
tolerance = "5.4ms"
max_minutes = 2
flash_width_us = 50
[recording]
free_space_floor_mib = 3
[reconstruction]
budget_s = 60
hold_out = [3, 7]
)");
  EXPECT_DOUBLE_EQ(std::get<Seconds>(config.alignment.tolerance.value().amount).value(), 5.4e-3);
  EXPECT_EQ(config.alignment.run.align.limits->time, Seconds(120));
  EXPECT_DOUBLE_EQ(in_microseconds(config.alignment.run.flash_width), 50);
  EXPECT_EQ(config.recording.writer.min_free_bytes, 3u << 20);
  EXPECT_EQ(config.reconstruction.budget, Seconds(60));
  EXPECT_THAT(config.reconstruction.hold_out, ::testing::ElementsAre(3, 7));
}

TEST(Config, AValueOutOfRangeIsNamedWithPlaceRangeAndRemedy) {
  EXPECT_EQ(problem("\n[alignment]\n  flash_width_us = 20000\n"),
            "lab.toml:3:20: flash_width_us is 20000. Give a number from 0.1 to 10000");
  EXPECT_EQ(problem("[alignment]\nflash_width_us = nan\n"),
            "lab.toml:2:18: flash_width_us is nan. Give a number from 0.1 to 10000");
  EXPECT_EQ(problem("[server]\nviewers = 1.5\n"),
            "lab.toml:2:11: viewers is 1.5. Give a whole number from 1 to 1000");
  EXPECT_EQ(
      problem("[log]\nlevel = \"loud\"\n"),
      "lab.toml:2:9: level is \"loud\". Give \"trace\", \"debug\", \"info\", \"warn\", \"error\" or \"off\"");
  EXPECT_EQ(problem("[rig]\nname = 3\n"), "lab.toml:2:8: name is 3. Give text");
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"virtual\"\nsize = \"640 x 480\"\n"),
              HasSubstr("lab.toml:3:8: size is \"640 x 480\". Give WIDTHxHEIGHT"));
}

const std::string kOwnCamera = "[[rig.camera]]\ndriver = \"v4l2\"\nid = \"here\"\n";
const std::string kIdentity = "certificate = \"a\"\nkey = \"b\"\nauthority = \"c\"\n";
std::string remote_camera(const std::string& keys) { return "[[rig.camera]]\ndriver = \"remote\"\n" + keys; }

TEST(Config, AnotherHostsCameraNeedsItsHostItsIdAndCertificates) {
  const std::string hosts = "[hosts]\n" + kIdentity;
  const DaemonConfig config =
      parsed(kOwnCamera + remote_camera("id = \"there\"\nhost = \"lab-2:7143\"\n") + hosts);
  EXPECT_EQ(config.rig.cameras[1].source, CameraSource::remote);
  EXPECT_EQ(config.rig.cameras[1].host, "lab-2:7143");
  EXPECT_EQ(config.hosts.alone, Seconds(600));
  EXPECT_TRUE(config.hosts.key.is_absolute());
  EXPECT_THAT(problem(kOwnCamera + remote_camera("id = \"there\"\n") + hosts),
              HasSubstr("the camera has no host"));
  EXPECT_THAT(problem(kOwnCamera + remote_camera("id = \"there\"\nhost = \"lab-2\"\n") + hosts),
              HasSubstr("\"lab-2\" is no address"));
  EXPECT_THAT(problem(kOwnCamera + remote_camera("host = \"lab-2:7143\"\n") + hosts),
              HasSubstr("the camera has no id"));
  EXPECT_THAT(problem(kOwnCamera + remote_camera("id = \"here\"\nhost = \"lab-2:7143\"\n") + hosts),
              HasSubstr("two cameras have the id \"here\""));
  EXPECT_THAT(problem(remote_camera("id = \"there\"\nhost = \"lab-2:7143\"\n") + hosts),
              HasSubstr("all cameras are other hosts'"));
  EXPECT_THAT(problem(kOwnCamera + remote_camera("id = \"there\"\nhost = \"lab-2:7143\"\n")),
              HasSubstr("driver \"remote\" needs certificate"));
  EXPECT_THAT(problem(kOwnCamera + "host = \"lab-2:7143\"\n"), HasSubstr("host means nothing here"));
}

TEST(Config, AHostLendsWithCertificatesAndLeadsNone) {
  EXPECT_TRUE(
      parsed(kOwnCamera + "[hosts]\nlisten = \"0.0.0.0:7143\"\n" + kIdentity).hosts.listen.ends_with("7143"));
  EXPECT_THAT(problem(kOwnCamera + "[hosts]\nlisten = \"0.0.0.0:7143\"\n"),
              HasSubstr("listen needs certificate"));
  EXPECT_THAT(problem(kOwnCamera + "[hosts]\nlisten = \"here\"\n" + kIdentity), HasSubstr("is no address"));
  EXPECT_THAT(problem(kOwnCamera + remote_camera("id = \"there\"\nhost = \"lab-2:7143\"\n") +
                      "[hosts]\nlisten = \"0.0.0.0:7143\"\n" + kIdentity),
              HasSubstr("lends none"));
}

TEST(Config, AnUnknownKeyIsAnErrorThatSuggestsTheNearest) {
  EXPECT_EQ(problem("[alignment]\ntolerence = \"100rows\"\n"),
            "lab.toml:2:1: there is no key \"tolerence\" in [alignment]. Did you mean tolerance?");
  EXPECT_EQ(problem("[recordings]\n"),
            "lab.toml:1:2: there is no section \"recordings\". Did you mean recording?");
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"ptp\"\nid = \"a\"\nquux = 1\n"),
              HasSubstr("no key \"quux\" in [rig.camera]. There are driver, id, host, count"));
  EXPECT_THAT(problem("[rig.strope]\n"), HasSubstr("Did you mean strobe?"));
}

TEST(Config, EveryProblemIsReportedNotTheFirstAlone) {
  const ConfigReading reading =
      read_config("[log]\nlevel = 3\nfromat = \"json\"\n[rig.strobe]\ndriver = \"serial\"\n", "lab.toml");
  EXPECT_EQ(reading.problems.size(), 3u);
}

TEST(Config, WhatIsNotTomlIsNamedWithItsPlace) {
  EXPECT_THAT(problem("[rig\nname = 1\n"), HasSubstr("lab.toml:1:"));
  EXPECT_THAT(problem("[rig]\nname = \"a\"\nname = \"b\"\n"), HasSubstr("lab.toml:3:"));
  EXPECT_THAT(problem("rig = 3\n"), HasSubstr("rig is no section"));
  EXPECT_THAT(problem("[rig.camera]\ndriver = \"virtual\"\n"), HasSubstr("[[rig.camera]]"));
}

TEST(Config, AKeyThatMeansNothingToACamerasDriverIsAnError) {
  EXPECT_EQ(problem("[[rig.camera]]\ndriver = \"v4l2\"\nid = \"a\"\ncount = 3\n"),
            "lab.toml:4:9: count means nothing here: it is of driver \"virtual\". Leave it out");
  EXPECT_THAT(problem("[rig.replay]\nsession=\"s\"\n[[rig.camera]]\ndriver = \"replay\"\nexposure_ms = 3\n"),
              HasSubstr("exposure_ms means nothing here"));
}

TEST(Config, ThePathOfASharedStrobeStartsFromTheFilesFolder) {
  EXPECT_EQ(parsed("[rig.virtual]\nlight = \"light.txt\"\n").rig.virtual_rig.light,
            "/etc/emberlock/light.txt");
}

TEST(Config, WhatDoesNotFitTogetherIsAnError) {
  EXPECT_THAT(problem("[[rig.camera]]\nid = \"a\"\n"), HasSubstr("lab.toml:1:1: the camera has no driver"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"v4l2\"\n"), HasSubstr("the camera has no id"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"virtual\"\nid = \"../up\"\n"),
              HasSubstr("lab.toml:3:6: the id is no name"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"virtual\"\nid = \"..\"\n"), HasSubstr("the id is no name"));
  const std::string one = "[[rig.camera]]\ndriver = \"ptp\"\nid = \"a\"\n";
  EXPECT_THAT(problem(one + one), HasSubstr("lab.toml:6:6: two cameras"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver=\"virtual\"\ncount=60\n[[rig.camera]]\ndriver=\"virtual\"\nid="
                      "\"b\"\ncount=5\n"),
              HasSubstr("there are 65 virtual cameras"));
  EXPECT_THAT(problem(one + "[rig.virtual]\ntime = \"fast\"\n"), HasSubstr("lab.toml:5:8: real devices"));
  const std::string light = "[rig.virtual]\nlight = \"l\"\n";
  EXPECT_EQ(problem(light), "");
  EXPECT_EQ(problem(light + "[rig.strobe]\ndriver = \"virtual\"\n"), "");
  EXPECT_EQ(problem(light + "time = \"fast\"\n"),
            "lab.toml:2:9: several daemons share no time that runs faster than real. Say time = \"real\", or "
            "leave out light");
  EXPECT_THAT(problem(light + "[rig.strobe]\ndriver = \"manual\"\n"),
              HasSubstr("lab.toml:2:9: only a virtual strobe can be shared"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"replay\"\n"), HasSubstr("nothing to replay"));
  EXPECT_THAT(problem("[[rig.camera]]\ndriver = \"virtual\"\nrows = 720\nshifts = 700\n"),
              HasSubstr("lab.toml:4:10: shifts are fewer than rows. Give 720 at least"));
  EXPECT_THAT(problem("[rig.strobe]\ndriver = \"serial\"\n"), HasSubstr("the strobe has no id"));
}

TEST(Config, ANetworkAddressNeedsItsTokenAndTls) {
  const std::string beyond = "[server]\nhttp_listen = \"0.0.0.0:7140\"\n";
  EXPECT_EQ(
      problem(beyond),
      "lab.toml:2:15: http_listen beyond localhost needs tls_certificate. Give tls_certificate in [server]");
  EXPECT_EQ(read_config(beyond, "lab.toml").problems.size(), 3u);
  EXPECT_THAT(problem(beyond + "token_file = \"t\"\ntls_certificate = \"c\"\n"), HasSubstr("needs tls_key"));
  EXPECT_EQ(problem(beyond + "token_file = \"t\"\ntls_certificate = \"c\"\ntls_key = \"k\"\n"), "");
  for (const char* local : {"127.0.0.1:80", "localhost:7140", "[::1]:7140", ""})
    EXPECT_EQ(problem("[server]\nhttp_listen = \"" + std::string(local) + "\"\n"), "") << local;
  for (const char* wrong : {"7140", ":7140", "localhost:", "localhost:70000", "::1:80", "localhost:80x"})
    EXPECT_THAT(problem("[server]\nhttp_listen = \"" + std::string(wrong) + "\"\n"),
                HasSubstr("is no address"));
  const ConfigReading reading = read_config("[server]\nlisten = \"0.0.0.0:7141\"\n", "lab.toml");
  EXPECT_EQ(reading.problems.size(), 3u);
  EXPECT_EQ(print_config(parsed("[server]\nhttp_listen = \"\"\n")).find("127.0.0.1"), std::string::npos);
}

}  // namespace
}  // namespace emberlock::rig
