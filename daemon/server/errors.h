// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <grpcpp/support/status.h>

#include "base/result.h"

namespace emberlock::daemon {

/// An error as a gRPC status: INVALID_ARGUMENT, FAILED_PRECONDITION, ... and the complete message
/// (services.proto).
grpc::Status grpc_status(const Error& error);
inline grpc::Status grpc_status(const Status& status) {
  return status.ok() ? grpc::Status::OK : grpc_status(status.error());
}

/// The message of NOT_FOUND, which only a sequence's frames are answered with.
inline constexpr const char* kNotFound =
    "frame: it isn't done, or no longer held. The status tells what is done; or reconstruct it again";

/// The same for HTTP: the status code, and gRPC's name for the code.
int http_status(ErrorKind kind);
std::string_view code_name(ErrorKind kind);

}  // namespace emberlock::daemon
