// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "daemon/reconstruction/child.h"
#include "session/files.h"
#include "tests/support/child_script.h"
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
    put_script(root_.path(), script);
    child_ = std::make_unique<daemon::ReconstructionChild>(options_, board_, jobs_.emplace());
    return *child_;
  }
  void message(const std::string& name, const v1::ChildMessage& message) const {
    put_message(root_ / name, message);
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
  /// Waits until it runs no more, and its thread has let go of it.
  v1::ReconstructionStatus end() {
    wait_until([&] { return child_->status()->state() != v1::ReconstructionStatus::RUNNING; });
    jobs_->drain();
    return *child_->status();
  }
  v1::ReconstructionStatus end_of(const std::string& script) {
    const auto started = with_script(script).start(request());
    EXPECT_TRUE(started.ok()) << started.error().message();
    return end();
  }
  /// Waits until a script has written the file whole.
  std::string wait_for_line(const std::string& name) const {
    std::string line;
    EXPECT_TRUE(wait_until([&] {
      std::ifstream in(root_ / name);
      return std::getline(in, line) && !in.eof();
    })) << name
        << " never came";
    return line;
  }
  /// Waits until a process is gone, or dead.
  static bool goes_away(const std::string& pid) {
    return wait_until([&] {
      std::ifstream stat("/proc/" + pid + "/stat");
      std::string text;
      return !std::getline(stat, text) || text.find(") Z ") != std::string::npos;
    });
  }
  /// Waits until no script runs any more.
  bool scripts_go_away() const {
    return wait_until([&] {
      const auto runs = [&](const std::filesystem::directory_entry& process) {
        std::ifstream in(process.path() / "cmdline");
        const std::string command((std::istreambuf_iterator<char>(in)), {});
        return command.find((root_ / "program").string()) != std::string::npos;
      };
      return std::none_of(std::filesystem::directory_iterator("/proc"), {}, runs);
    });
  }

  TempFolder root_;
  daemon::Board board_;
  daemon::ReconstructionOptions options_;
  std::unique_ptr<daemon::ReconstructionChild> child_;
  std::optional<daemon::Jobs> jobs_;
};

}  // namespace emberlock::test
