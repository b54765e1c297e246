// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/request.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "recon/calibrate/camera_response.h"
#include "recon/calibrate/rig.h"
#include "recon/compute/device.h"
#include "recon/temperature/emitter.h"
#include "recon/temperature/line_emitter.h"

namespace emberlock::daemon {

Error refuse_field(const char* field, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), field, std::move(remedy)};
}

namespace {

constexpr std::uint32_t kLargestVoxels = 1024;  // as `emberlock reconstruct --voxels` takes them

Status check_quantity(const v1::ReconstructRequest& request) {
  const bool temperature = request.quantity() == "temperature";
  if (!temperature && !request.quantity().empty() && request.quantity() != "colour")
    return refuse_field("quantity", fmt::format("\"{}\" is none", request.quantity()),
                        "Give colour or temperature");
  if (!request.emitter().empty()) {
    if (const auto emitter = recon::parse_emitter(request.emitter()); !emitter)
      return refuse_field("emitter", emitter.error().what, emitter.error().remedy);
    if (!temperature) return refuse_field("emitter", "is for temperatures", "Give quantity temperature too");
  }
  recon::CameraResponse response = recon::standard_response();
  if (request.has_response()) {
    if (!temperature) return refuse_field("response", "is for temperatures", "Give quantity temperature too");
    EMBERLOCK_ASSIGN_OR_RETURN(response, recon::camera_response_of(request.response(), "response"));
  }
  if (request.lines().empty()) return {};
  if (!temperature) return refuse_field("lines", "is for temperatures", "Give quantity temperature too");
  const auto lines = recon::parse_lines(request.lines());
  if (!lines) return refuse_field("lines", lines.error().what, lines.error().remedy);
  const bool paper = request.emitter() == recon::name(recon::Emitter::paper);
  if (!request.has_response() && !paper) return {};  // the session's response is read with it
  const Status told =
      recon::check_lines(response, paper ? recon::Emitter::paper : recon::Emitter::grey, *lines);
  return told.ok() ? Status() : refuse_field("lines", told.error().what, told.error().remedy);
}

/// A replay finds the same flame: so no clock may have a say in it.
Status check_stylization(const v1::ReconstructRequest& request) {
  if (!request.stylize()) return {};
  if (request.has_last_frame())
    return refuse_field("last_frame", "one frame is edited at a time", "Leave it away");
  if (request.budget_s() > 0)
    return refuse_field("budget_s", "can't be kept when the edits are replayed", "Leave it away");
  if (request.quantity() == "temperature" || request.errors())
    return refuse_field("stylize", "is of colours alone", "Reconstruct temperatures and errors apart");
  return {};
}

}  // namespace

Status check_request(const v1::ReconstructRequest& request) {
  if (!std::isfinite(request.budget_s()) || request.budget_s() < 0)
    return refuse_field("budget_s", "is no length of time", "Give seconds above 0, or 0 for none");
  if (request.voxels() > kLargestVoxels)
    return refuse_field(
        "voxels", fmt::format("{} are too many", request.voxels()),
        fmt::format("Give at most {}, or 0 for the knee of time against error", kLargestVoxels));
  EMBERLOCK_RETURN_IF_ERROR(check_quantity(request));
  EMBERLOCK_RETURN_IF_ERROR(check_stylization(request));
  if (!request.device().empty()) {
    if (const auto device = recon::parse_device(request.device()); !device) return device.error();
  }
  return {};
}

std::string input_for(const v1::ReconstructRequest& request) {
  if (!request.has_response()) return {};
  const auto response = recon::camera_response_of(request.response(), "response");
  return response ? recon::to_json(*response) : std::string();
}

}  // namespace emberlock::daemon
