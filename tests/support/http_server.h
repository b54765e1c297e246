// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "daemon/server/http_server.h"
#include "tests/support/fake_api.h"
#include "tests/support/http_client.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::test {

/// The console's server on a port of its own, before a daemon without devices.
class HttpServerTest : public testing::Test {
 protected:
  HttpServerTest() {
    std::filesystem::create_directories(folder / "console/assets");
    std::ofstream(folder / "console/index.html") << "<!doctype html>console";
  }
  static daemon::HttpServerOptions with_token(daemon::HttpServerOptions options = {}) {
    options.token = *rig::Token::parse(kHttpToken);
    return options;
  }
  void serve(daemon::HttpServerOptions options) {
    const daemon::HttpServerOptions usual;
    if (options.listen == usual.listen) options.listen = "127.0.0.1:0";
    // No client is cut off because the machine is busy.
    if (options.patience == usual.patience) options.patience = kHangGuard;
    options.console = folder / "console";
    auto started = daemon::HttpServer::start(api, std::move(options));
    ASSERT_TRUE(started.ok()) << started.error().message();
    server = std::move(started).value();
    port = server->port();
  }
  void show(v1::Phase phase) { api.show(phase); }
  /// Sends a call without a body, and leaves its answer to the caller.
  [[nodiscard]] UniqueFd call(const std::string& method, const std::string& headers = kLetIn) const {
    UniqueFd client = connect_to(port);
    send_all(client, "POST /api/v1/" + method + " HTTP/1.1\r\n" + headers + "Content-Length: 0\r\n\r\n");
    return client;
  }
  /// What comes until it has these words, or the server ends.
  static std::string read_until(const UniqueFd& client, const std::string& words) {
    std::string answer;
    for (char c = 0; answer.find(words) == std::string::npos && ::read(client.get(), &c, 1) == 1;)
      answer += c;
    return answer;
  }

  TempFolder folder;
  FakeApi api;
  std::unique_ptr<daemon::HttpServer> server;
  int port = 0;
};

}  // namespace emberlock::test
