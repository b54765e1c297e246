// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/api.h"

// services.proto in protobuf's JSON: what POST /api/v1/<Service>/<Method> is asked and answers. Names are
// those of the .proto.
namespace emberlock::daemon {

/// A method of services.proto; the plain streams aren't among them, as a browser watches by WebSocket.
struct JsonMethod {
  std::string_view name;  ///< "Sync/Align"
  /// Exactly one is set. `body` empty: the empty request. What isn't JSON of the request's type is a
  /// bad_input.
  Result<std::string> (*call)(Api& api, const std::string& body);
  /// Reads the request; what it returns does the job.
  Result<std::function<Status(const JobObserver&)>> (*job)(Api& api, const std::string& body);
};

/// Null: there is none of that name.
const JsonMethod* find_json_method(std::string_view name);

std::string to_json(const google::protobuf::Message& message);
/// {"code": "FAILED_PRECONDITION", "message": "..."}
std::string error_json(std::string_view code, std::string_view message);

}  // namespace emberlock::daemon
