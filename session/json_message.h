// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <google/protobuf/message.h>

#include "base/result.h"

namespace emberlock::session {

/// Fills a message from protobuf's JSON mapping. The error says "not `what`", and why.
Status read_json(std::string_view json, google::protobuf::Message& message, const std::string& what,
                 const std::string& where, const std::string& remedy);

enum class Defaults {
  left_out,
  written,  ///< fields with default values are written too
};

/// The JSON that read_json() reads, indented. Error: a text that isn't UTF-8; names `what` and `where`.
Result<std::string> json_of(const google::protobuf::Message& message, Defaults defaults,
                            const std::string& what, const std::string& where);

}  // namespace emberlock::session
