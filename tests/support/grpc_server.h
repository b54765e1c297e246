// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "daemon/server/grpc_server.h"
#include "emberlock/v1/services.grpc.pb.h"
#include "tests/support/fake_api.h"
#include "tests/support/recording.h"

namespace emberlock::test {

/// A real server on a socket of its own, before a daemon without devices.
class GrpcServerTest : public testing::Test {
 protected:
  void serve(daemon::GrpcServerOptions options = {}) {
    if (options.socket.empty() && options.tcp_address.empty()) options.socket = socket;
    auto started = daemon::GrpcServer::start(api, std::move(options));
    ASSERT_TRUE(started.ok()) << started.error().message();
    server = std::move(started).value();
  }
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel() const {
    return grpc::CreateChannel("unix:" + socket.string(), grpc::InsecureChannelCredentials());
  }

  void show(v1::Phase phase) { api.show(phase); }

  TempFolder folder;
  std::filesystem::path socket = folder / "emberlockd.sock";
  FakeApi api;
  std::unique_ptr<daemon::GrpcServer> server;
};

}  // namespace emberlock::test
