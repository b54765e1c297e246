// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/errors.h"

#include <array>

namespace emberlock::daemon {
namespace {

struct Code {
  ErrorKind kind;
  grpc::StatusCode code;
  std::string_view name;
  int http;
};

constexpr std::array<Code, 7> kCodes{{
    {ErrorKind::bad_input, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT", 400},
    {ErrorKind::io, grpc::StatusCode::INTERNAL, "INTERNAL", 500},
    {ErrorKind::device, grpc::StatusCode::UNAVAILABLE, "UNAVAILABLE", 503},
    {ErrorKind::out_of_data, grpc::StatusCode::OUT_OF_RANGE, "OUT_OF_RANGE", 416},
    {ErrorKind::timed_out, grpc::StatusCode::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED", 504},
    {ErrorKind::refused, grpc::StatusCode::FAILED_PRECONDITION, "FAILED_PRECONDITION", 409},
    {ErrorKind::not_converged, grpc::StatusCode::ABORTED, "ABORTED", 422},
}};

const Code& code_of(ErrorKind kind) {
  for (const Code& code : kCodes) {
    if (code.kind == kind) return code;
  }
  return kCodes[1];
}

}  // namespace

grpc::Status grpc_status(const Error& error) { return {code_of(error.kind).code, error.message()}; }
int http_status(ErrorKind kind) { return code_of(kind).http; }
std::string_view code_name(ErrorKind kind) { return code_of(kind).name; }

}  // namespace emberlock::daemon
