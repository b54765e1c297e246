// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/json_api.h"

#include <array>
#include <utility>

#include <google/protobuf/util/json_util.h>
#include <nlohmann/json.hpp>

namespace emberlock::daemon {
namespace {

template <class Request>
Result<Request> parse(const std::string& body) {
  Request request;
  if (body.empty()) return request;
  const auto status = google::protobuf::util::JsonStringToMessage(body, &request);
  if (status.ok()) return request;
  return Error{ErrorKind::bad_input, std::string(status.message()), "request",
               "send the JSON of emberlock.v1." + request.GetDescriptor()->name()};
}

Result<std::string> answer(const Status& status) {
  if (!status.ok()) return status.error();
  return std::string("{}");
}
template <class Message>
Result<std::string> answer(const Result<Message>& message) {
  if (!message) return message.error();
  return to_json(*message);
}
/// Nothing where there is none.
template <class Message>
Result<std::string> answer(const std::shared_ptr<const Message>& message) {
  return message ? to_json(*message) : std::string();
}

template <auto ask, class Request>
Result<std::string> call_with(Api& api, const std::string& body) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Request request, parse<Request>(body));
  return answer((api.*ask)(request));
}
template <auto ask>
Result<std::string> call_plain(Api& api, const std::string& body) {
  EMBERLOCK_RETURN_IF_ERROR(parse<v1::Empty>(body));
  return answer((api.*ask)());
}
Result<std::string> get_status(Api& api, const std::string& body) {
  EMBERLOCK_RETURN_IF_ERROR(parse<v1::Empty>(body));
  return to_json(*api.board().status());
}
template <auto ask, class Request>
Result<BeginJob> job_with(Api& api, const std::string& body) {
  EMBERLOCK_ASSIGN_OR_RETURN(Request request, parse<Request>(body));
  return BeginJob([&api, request = std::move(request)] { return (api.*ask)(request); });
}

constexpr std::array<JsonMethod, 23> kMethods{{
    {"Daemon/GetStatus", get_status, nullptr},
    {"Daemon/Acknowledge", call_with<&Api::acknowledge, v1::AcknowledgeRequest>, nullptr},
    {"Devices/List", call_plain<&Api::list_devices>, nullptr},
    {"Strobe/Get", call_plain<&Api::strobe>, nullptr},
    {"Strobe/Apply", call_with<&Api::apply_strobe, v1::StrobeState>, nullptr},
    {"Sync/Align", call_with<&Api::align, v1::AlignRequest>, nullptr},
    {"Sync/Stop", call_plain<&Api::stop_sync>, nullptr},
    {"Capture/Record", call_with<&Api::record, v1::RecordRequest>, nullptr},
    {"Capture/Stop", call_plain<&Api::stop_recording>, nullptr},
    {"Sessions/List", call_plain<&Api::list_sessions>, nullptr},
    {"Sessions/Get", call_with<&Api::session, v1::SessionRequest>, nullptr},
    {"Sessions/Verify", nullptr, job_with<&Api::verify_session, v1::SessionRequest>},
    {"Sessions/Repair", nullptr, job_with<&Api::repair_session, v1::SessionRequest>},
    {"Sessions/Export", nullptr, job_with<&Api::export_session, v1::ExportRequest>},
    {"Jobs/Cancel", call_with<&Api::cancel_job, v1::CancelJobRequest>, nullptr},
    {"Reconstruct/Start", call_with<&Api::reconstruct, v1::ReconstructRequest>, nullptr},
    {"Reconstruct/Cancel", call_plain<&Api::cancel_reconstruction>, nullptr},
    {"Reconstruct/Edit", call_with<&Api::edit_reconstruction, v1::EditRequest>, nullptr},
    {"Reconstruct/Finish", call_plain<&Api::finish_reconstruction>, nullptr},
    {"Reconstruct/Frame", call_with<&Api::reconstructed_frame, v1::FrameRequest>, nullptr},
    {"Ar/Results", call_plain<&Api::list_results>, nullptr},
    {"Ar/Start", call_with<&Api::start_ar, v1::ArRequest>, nullptr},
    {"Ar/Stop", call_plain<&Api::stop_ar>, nullptr},
}};

}  // namespace

const JsonMethod* find_json_method(std::string_view name) {
  for (const JsonMethod& method : kMethods) {
    if (method.name == name) return &method;
  }
  return nullptr;
}

std::string to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  // Fails only for types with opaque content (Any), of which we have none.
  (void)google::protobuf::util::MessageToJsonString(message, &json, options);
  return json;
}

std::string error_json(std::string_view code, std::string_view message) {
  const nlohmann::json error{{"code", code}, {"message", message}};
  return error.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace emberlock::daemon
