// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "daemon/server/grpc_server.h"
#include "tests/support/fake_api.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

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

  VerbRun run(AddVerb add, std::vector<std::string> words) const {
    words.insert(words.end(), {"--daemon", "unix:" + (folder_ / "socket").string()});
    return run_verb(add, std::move(words));
  }
  /// In a while, as a daemon's engine does it: each step a tenth of a second after the one before.
  void soon(std::vector<std::function<void()>> steps) {
    threads_.emplace_back([steps = std::move(steps)] {
      for (const auto& step : steps) {
        std::this_thread::sleep_for(std::chrono::milliseconds(150));
        step();
      }
    });
  }
  void show_soon(std::vector<v1::DaemonStatus> statuses) {
    std::vector<std::function<void()>> steps;
    for (v1::DaemonStatus& status : statuses)
      steps.emplace_back([this, status = std::move(status)] { api_.board().show(status); });
    soon(std::move(steps));
  }

  TempFolder folder_;
  FakeApi api_;
  std::shared_ptr<daemon::ConsoleSessions> sessions_ = std::make_shared<daemon::ConsoleSessions>();
  std::unique_ptr<daemon::GrpcServer> server_;
  std::vector<std::thread> threads_;
};

}  // namespace emberlock::test
