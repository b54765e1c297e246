// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <grpcpp/support/status.h>

#include "base/result.h"

namespace emberlock::daemon {

/// An error as gRPC says it: INVALID_ARGUMENT, FAILED_PRECONDITION, ... and the whole message
/// (services.proto).
grpc::Status grpc_status(const Error& error);
inline grpc::Status grpc_status(const Status& status) {
  return status.ok() ? grpc::Status::OK : grpc_status(status.error());
}

/// The same over HTTP: its status, and gRPC's name for the code.
int http_status(ErrorKind kind);
std::string_view code_name(ErrorKind kind);

}  // namespace emberlock::daemon
