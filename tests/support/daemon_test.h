// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "session/camera_reader.h"
#include "session/files.h"
#include "session/verify.h"
#include "tests/support/program.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

namespace emberlock::test {

/// emberlockd with virtual cameras and what it records, and `emberlock` as its client on the socket
/// run/d.sock.
class DaemonTest : public ::testing::Test {
 protected:
  struct Setup {
    int cameras;
    std::string size, strobe, recording = "";  ///< further lines of [recording]
  };
  explicit DaemonTest(const Setup& setup) {
    std::ofstream(config()) << "[rig]\nname = \"test\"\n[[rig.camera]]\ndriver = \"virtual\"\ncount = "
                            << setup.cameras << "\nsize = \"" << setup.size << "\"\n[rig.strobe]\ndriver = \""
                            << setup.strobe << "\"\n[recording]\nfolder = \"" << sessions().string()
                            << "\"\nfree_space_floor_mib = 0\nencoding = \"raw\"\ntranscode = \"never\"\n"
                            << setup.recording << "[server]\nsocket = \"" << socket()
                            << "\"\nhttp_listen = \"\"\n";
  }
  [[nodiscard]] std::filesystem::path sessions() const { return temp_ / "sessions"; }
  [[nodiscard]] std::string config() const { return (temp_ / "d.toml").string(); }
  [[nodiscard]] std::string socket() const { return (temp_ / "run" / "d.sock").string(); }
  [[nodiscard]] std::vector<std::string> command() const {
    return {EMBERLOCKD_PROGRAM, "--config", config()};
  }
  [[nodiscard]] Shell client(const std::string& words) const {
    return shell(std::string(EMBERLOCK_PROGRAM) + " " + words + " --daemon unix:" + socket());
  }
  /// Asks until the answer has `words`.
  [[nodiscard]] bool answers(const std::string& question, const std::string& words) const {
    return wait_until([&] { return client(question).output.find(words) != std::string::npos; });
  }
  /// What the status reports of the recording; empty where there is none.
  [[nodiscard]] nlohmann::json recording() const {
    const auto status = nlohmann::json::parse(client("status --json").output, nullptr, false);
    return status.is_object() ? status.value("recording", nlohmann::json::object())
                              : nlohmann::json::object();
  }
  /// A number of a status; absent ones are 0, and large ones are strings, as JSON has no 64 bits.
  static double number(const nlohmann::json& object, const char* name) {
    const nlohmann::json value = object.value(name, nlohmann::json(0));
    return value.is_string() ? std::stod(value.get<std::string>()) : value.get<double>();
  }
  [[nodiscard]] std::size_t indexed_frames(const std::string& session, const std::string& camera) const {
    const auto index = session::read_index(sessions() / session, camera);
    return index.ok() ? index->records.size() : 0;
  }
  /// Waits until the index of each camera has so many frames. A session that ends before isn't whole.
  [[nodiscard]] bool every_camera_has(std::size_t frames, const std::string& session) const {
    return wait_until([&] {
      const auto manifest = session::read_manifest(sessions() / session);
      return manifest.ok() && std::all_of(manifest->cameras().begin(), manifest->cameras().end(),
                                          [&](const v1::CameraStream& camera) {
                                            return indexed_frames(session, camera.camera_id()) >= frames;
                                          });
    });
  }
  session::SessionCheck expect_whole(const std::string& session) const {
    auto check = session::verify_session(sessions() / session);
    EXPECT_TRUE(check.ok()) << check.error().message();
    if (!check) return {};
    EXPECT_TRUE(check->whole()) << check->to_do;
    return *std::move(check);
  }
  TempFolder temp_;
};

}  // namespace emberlock::test
