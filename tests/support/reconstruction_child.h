// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "daemon/reconstruction/child.h"
#include "session/child_messages.h"
#include "session/files.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::test {

/// A folder with a session "candle", and a shell script in the place of `emberlock`.
class ReconstructionChildTest : public testing::Test {
 protected:
  ReconstructionChildTest() {
    std::filesystem::create_directories(root_ / "sessions/candle");
    v1::Manifest manifest = manifest_of({{{4, 4}, PixelFormat::gray8, 8}});
    manifest.mutable_cameras(0)->mutable_counts()->set_recorded(40);
    manifest.set_state(v1::Manifest::COMPLETE);
    manifest.set_format_version(session::kSessionFormatVersion);
    if (!session::write_manifest(root_ / "sessions/candle", manifest).ok()) ADD_FAILURE() << "no manifest";
    options_.program = root_ / "program";
    options_.sessions = root_ / "sessions";
    options_.results = root_ / "results";
  }

  /// With ROOT for the folder. What `message(NAME, ...)` wrote is sent by `cat ROOT/NAME >&3`.
  daemon::ReconstructionChild& with_script(const std::string& script) {
    std::ofstream(root_ / "program") << "#!/bin/sh\nROOT='" << root_.path().string() << "'\n"
                                     << script << "\n";
    std::filesystem::permissions(root_ / "program", std::filesystem::perms::owner_all);
    child_ = std::make_unique<daemon::ReconstructionChild>(options_, board_, jobs_.emplace());
    return *child_;
  }
  void message(const std::string& name, const v1::ChildMessage& message) const {
    std::ofstream(root_ / name, std::ios::binary) << session::framed(message);
  }
  void done_message() const {
    v1::ChildMessage done;
    done.mutable_done()->set_result("there");
    message("done", done);
  }
  static v1::ReconstructRequest request(const std::string& session = "candle") {
    v1::ReconstructRequest request;
    request.set_session(session);
    return request;
  }
  /// Waits until it runs no more.
  v1::ReconstructionStatus end() {
    wait_until([&] { return child_->status()->state() != v1::ReconstructionStatus::RUNNING; });
    return *child_->status();
  }
  v1::ReconstructionStatus end_of(const std::string& script) {
    const auto started = with_script(script).start(request());
    EXPECT_TRUE(started.ok()) << started.error().message();
    return end();
  }
  /// Waits until a script has written the file whole.
  std::string wait_for_line(const std::string& name) const {
    for (int i = 0; i < 2000; ++i) {
      std::ifstream in(root_ / name);
      std::string line;
      if (std::getline(in, line) && !in.eof()) return line;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ADD_FAILURE() << name << " never came";
    return {};
  }
  /// Whether a process is gone, or will be within seconds.
  static bool goes_away(const std::string& pid) {
    for (int i = 0; i < 1000; ++i) {
      if (::kill(std::stoi(pid), 0) != 0) return true;
      std::ifstream stat("/proc/" + pid + "/stat");
      std::string text;
      std::getline(stat, text);
      if (text.find(") Z ") != std::string::npos) return true;  // dead, and nobody has waited for it yet
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  TempFolder root_;
  daemon::Board board_;
  daemon::ReconstructionOptions options_;
  std::unique_ptr<daemon::ReconstructionChild> child_;
  std::optional<daemon::Jobs> jobs_;
};

}  // namespace emberlock::test
