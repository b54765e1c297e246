// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/api.h"

// services.proto in protobuf's JSON: requests and answers of POST /api/v1/<Service>/<Method>. Names are those
// of the .proto.
namespace emberlock::daemon {

using BeginJob = std::function<Result<std::shared_ptr<JobHandle>>()>;

/// A method of services.proto. Without the plain streams, which a browser gets by WebSocket.
struct JsonMethod {
  std::string_view name;  ///< "Sync/Align"
  /// Exactly one is set. An empty `body` is the empty request. A body that isn't JSON of the request's type
  /// is a bad_input. An empty answer: what is asked for isn't there (NOT_FOUND).
  Result<std::string> (*call)(Api& api, const std::string& body);
  /// Parses the request; the returned function begins the job.
  Result<BeginJob> (*job)(Api& api, const std::string& body);
};

/// Null if there is no such method.
const JsonMethod* find_json_method(std::string_view name);

std::string to_json(const google::protobuf::Message& message);
/// {"code": "FAILED_PRECONDITION", "message": "..."}
std::string error_json(std::string_view code, std::string_view message);

}  // namespace emberlock::daemon
