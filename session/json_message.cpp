// SPDX-License-Identifier: Apache-2.0
#include "session/json_message.h"

#include <google/protobuf/util/json_util.h>

namespace emberlock::session {

Status read_json(std::string_view json, google::protobuf::Message& message, const std::string& what,
                 const std::string& where, const std::string& remedy) {
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(json.data(), json.size()), &message);
  if (status.ok()) return {};
  return Error{ErrorKind::bad_input, "not " + what + ": " + std::string(status.message()), where, remedy};
}

Result<std::string> json_of(const google::protobuf::Message& message, Defaults defaults,
                            const std::string& what, const std::string& where) {
  std::string json;
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = defaults == Defaults::written;
  options.preserve_proto_field_names = true;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (status.ok()) return json;
  return Error{ErrorKind::bad_input, what + " has no JSON form: " + std::string(status.message()), where,
               "Use UTF-8 in its texts and camera ids"};
}

}  // namespace emberlock::session
