// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/watch_messages.h"

#include <cmath>
#include <cstdint>

#include <google/protobuf/util/json_util.h>
#include <nlohmann/json.hpp>

#include "base/nesting.h"
#include "daemon/server/json_api.h"

namespace emberlock::daemon {
namespace {

WatchMessage text_of(const char* name, const google::protobuf::Message& message) {
  return {WatchMessage::Kind::text, std::string("{\"") + name + "\":" + to_json(message) + "}"};
}

WatchMessage binary_of(const nlohmann::json& header, std::string_view bytes) {
  const std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  WatchMessage message{WatchMessage::Kind::binary, {}};
  message.bytes.reserve(4 + text.size() + bytes.size());
  for (unsigned shift = 0; shift < 32; shift += 8)
    message.bytes += static_cast<char>(static_cast<std::uint32_t>(text.size()) >> shift & 0xff);
  message.bytes += text;
  message.bytes += bytes;
  return message;
}

}  // namespace

WatchMessage watch_message(const v1::DaemonStatus& status) { return text_of("status", status); }
WatchMessage history_message(const v1::DaemonStatus& status) {
  v1::AlignmentStatus rounds;
  *rounds.mutable_history() = status.alignment().history();
  return text_of("rounds", rounds);
}
WatchMessage watch_message(const v1::Notice& notice) { return text_of("notice", notice); }

WatchMessage watch_message(const v1::Picture& picture) {
  return binary_of({{"kind", "picture"},
                    {"camera_id", picture.camera_id()},
                    {"frame_id", picture.frame_id()},
                    {"monotonic_ns", picture.monotonic_ns()},
                    {"width", picture.width()},
                    {"height", picture.height()}},
                   picture.jpeg());
}

std::vector<WatchMessage> watch_messages(const v1::IterationPreview& preview) {
  v1::IterationPreview numbers;
  numbers.set_reconstruction(preview.reconstruction());
  numbers.set_camera_id(preview.camera_id());
  if (preview.has_frame()) numbers.set_frame(preview.frame());
  *numbers.mutable_iteration() = preview.iteration();
  if (preview.has_live_delay_s()) numbers.set_live_delay_s(preview.live_delay_s());
  if (preview.has_stylization()) *numbers.mutable_stylization() = preview.stylization();
  std::vector<WatchMessage> messages{text_of("iteration", numbers)};
  const auto header = [&](const char* kind) {
    return nlohmann::json{{"kind", kind},
                          {"reconstruction", preview.reconstruction()},
                          {"iteration", preview.iteration().iteration()},
                          {"camera_id", preview.camera_id()}};
  };
  if (!preview.captured_jpeg().empty())
    messages.push_back(binary_of(header("captured"), preview.captured_jpeg()));
  if (!preview.rendered_jpeg().empty())
    messages.push_back(binary_of(header("rendered"), preview.rendered_jpeg()));
  if (preview.has_volume()) {
    const v1::VolumePreview& volume = preview.volume();
    nlohmann::json volume_header = header("volume");
    volume_header.erase("camera_id");
    volume_header.update({{"nx", volume.nx()},
                          {"ny", volume.ny()},
                          {"nz", volume.nz()},
                          {"box", nlohmann::json::parse(to_json(volume.box()), nullptr, false)},
                          {"brightest", volume.brightest()},
                          {"layers", nlohmann::json::array()}});
    std::string voxels = volume.voxels();
    for (const v1::VolumeLayer& layer : volume.layers()) {
      volume_header["layers"].push_back({{"kind", v1::VolumeLayer::Kind_Name(layer.kind())},
                                         {"low", layer.low()},
                                         {"high", layer.high()},
                                         {"quick", layer.quick()}});
      voxels += layer.voxels();
    }
    messages.push_back(binary_of(volume_header, voxels));
  }
  return messages;
}

Result<std::optional<v1::WatchPicturesRequest>> parse_wish(std::string_view text) {
  const Error unknown{ErrorKind::bad_input, "no such message", "WebSocket",
                      R"(send {"watch": {"camera_ids": [...], "rate_hz": 12}} or {"watch": null})"};
  EMBERLOCK_RETURN_IF_ERROR(
      check_json_nesting(text, "WebSocket"));  // because it is written to JSON again below
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.contains("watch")) return unknown;
  const nlohmann::json& watch = json["watch"];
  if (watch.is_null()) return std::optional<v1::WatchPicturesRequest>();
  v1::WatchPicturesRequest request;
  const std::string wish = watch.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (!watch.is_object() || !google::protobuf::util::JsonStringToMessage(wish, &request).ok()) return unknown;
  if (!std::isfinite(request.rate_hz()) || request.rate_hz() < 0) return unknown;
  return std::optional(std::move(request));
}

}  // namespace emberlock::daemon
