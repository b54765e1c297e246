// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "daemon/server/grpc_server.h"
#include "tests/support/fake_api.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"
#include "tests/support/wait.h"

namespace emberlock::test {

inline v1::DaemonStatus status_in(v1::Phase phase, v1::Light light = v1::GREEN,
                                  const std::string& reason = "") {
  v1::DaemonStatus status;
  status.set_phase(phase);
  status.set_light(light);
  status.set_reason(reason);
  status.set_rig("bench");
  return status;
}

/// Whether the running verb has printed these words: run_verb() captures stdout in a file.
inline bool has_printed(const std::string& words) {
  const UniqueFd out(::dup(STDOUT_FILENO));
  struct stat file {};
  if (::fstat(out.get(), &file) != 0 || !S_ISREG(file.st_mode)) return false;
  std::string text(static_cast<std::size_t>(file.st_size), '\0');
  text.resize(
      static_cast<std::size_t>(std::max<ssize_t>(0, ::pread(out.get(), text.data(), text.size(), 0))));
  return text.find(words) != std::string::npos;
}

/// Verbs that ask emberlockd, before a real server on a socket and a daemon without devices.
class VerbsOfADaemon : public testing::Test {
 protected:
  VerbsOfADaemon() {
    api_.board().show(status_in(v1::IDLE));
    daemon::GrpcServerOptions options;
    options.socket = folder_ / "socket";
    options.sessions = sessions_;
    auto server = daemon::GrpcServer::start(api_, options);
    if (!server) throw std::runtime_error(server.error().message());
    server_ = std::move(*server);
  }
  ~VerbsOfADaemon() override {
    for (std::thread& thread : threads_) thread.join();
  }

  [[nodiscard]] VerbRun run(AddVerb add, std::vector<std::string> words) const {
    words.insert(words.end(), {"--daemon", "unix:" + (folder_ / "socket").string()});
    return run_verb(add, std::move(words));
  }
  /// Acts as a daemon's engine does, from a thread of its own: as soon as the condition of each step holds.
  struct Step {
    std::function<bool()> when;
    std::function<void()> act;
  };
  void in_turn(std::vector<Step> steps) {
    threads_.emplace_back([steps = std::move(steps)] {
      for (const Step& step : steps) {
        EXPECT_TRUE(wait_until(step.when));
        step.act();
      }
    });
  }
  /// Shows the first status at once, and each further one when the verb has printed its words.
  void show_in_turn(v1::DaemonStatus first,
                    const std::vector<std::pair<std::string, v1::DaemonStatus>>& further = {}) {
    api_.board().show(std::move(first));
    std::vector<Step> steps;
    for (const auto& [words, status] : further)
      steps.push_back({[words = words] { return has_printed(words); },
                       [this, status = status] { api_.board().show(status); }});
    in_turn(std::move(steps));
  }

  TempFolder folder_;
  FakeApi api_;
  std::shared_ptr<daemon::ConsoleSessions> sessions_ = std::make_shared<daemon::ConsoleSessions>();
  std::unique_ptr<daemon::GrpcServer> server_;
  std::vector<std::thread> threads_;
};

}  // namespace emberlock::test
