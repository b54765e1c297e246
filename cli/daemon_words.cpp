// SPDX-License-Identifier: Apache-2.0
#include "cli/daemon_words.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <google/protobuf/util/json_util.h>

#include "cli/hosts_words.h"

namespace emberlock::cli {
namespace {

/// A camera's phase in a line of the table: "+3.2 rows +-0.4", or the phase's state.
std::string sight(const v1::CameraStatus& camera) {
  if (!camera.has_error_rows()) return camera.sight();
  std::string text = fmt::format("{:+.1f} rows", camera.error_rows());
  if (camera.has_sigma_rows()) text += fmt::format(" +-{:.1f}", camera.sigma_rows());
  if (camera.has_error_s()) text += fmt::format(" ({:+.3f} ms)", 1e3 * camera.error_s());
  return text;
}

void add_line(std::string& text, std::string_view label, const std::string& value) {
  if (!value.empty()) text += fmt::format("{:<10} {}\n", label, value);
}

std::string camera_line(const v1::CameraStatus& camera) {
  const bool filming = camera.state() == v1::CameraStatus::FILMING;
  std::string line =
      fmt::format("  {}{:<14} {:<6} {:<11}", camera.reset_next() ? '*' : ' ', camera.id(),
                  in_words(camera.light()), in_words(v1::CameraStatus::State_Name(camera.state())));
  line += fmt::format(" {:>7}", filming ? fmt::format("{:.1f} Hz", camera.measured_rate_hz()) : "");
  line += fmt::format("  {:<32}", sight(camera));
  if (camera.has_drift_ppm()) line += fmt::format(" {:+.2f} ppm", camera.drift_ppm());
  if (camera.has_time_left_s()) line += fmt::format(", {} left", seconds_in_words(camera.time_left_s()));
  if (!camera.host().empty()) line += "  on " + camera.host();
  if (!camera.reason().empty()) line += fmt::format("  {}", camera.reason());
  while (line.back() == ' ') line.pop_back();
  return line + "\n";
}

std::string strobe_line(const v1::StrobeStatus& strobe) {
  if (strobe.id().empty()) return "none";
  const v1::StrobeState& settings = strobe.settings();
  if (strobe.by_hand()) {
    std::string text = fmt::format("set by hand, {}", in_words(strobe.light()));
    if (settings.output() == v1::StrobeState::FLASHING)
      text += fmt::format(": to {:.6g} a minute ({:.6g} Hz)", 60 * settings.rate_hz(), settings.rate_hz());
    if (strobe.measured_hz() > 0)
      text += fmt::format(", measured {:.6g} ({:.6g} Hz)", 60 * strobe.measured_hz(), strobe.measured_hz());
    return strobe.reason().empty() ? text : text + ". " + strobe.reason();
  }
  std::string text = fmt::format("{}, {}: {}", strobe.id(), in_words(strobe.light()),
                                 in_words(v1::StrobeState::Output_Name(settings.output())));
  if (settings.output() == v1::StrobeState::FLASHING)
    text += fmt::format(" at {:.6g} Hz, {:.4g} us", settings.rate_hz(), settings.width_s() * 1e6);
  return strobe.reason().empty() ? text : text + ". " + strobe.reason();
}

/// ", 2 frames failed" of a sequence; else nothing.
std::string failed_in_words(const v1::ReconstructionStatus& reconstruction) {
  const auto failed = std::count_if(
      reconstruction.frames().begin(), reconstruction.frames().end(),
      [](const v1::SequenceFrame& frame) { return frame.state() == v1::ReconstructionStatus::FAILED; });
  return failed == 0 ? "" : fmt::format(", {} frame{} failed", failed, failed == 1 ? "" : "s");
}

std::string reconstruction_line(const v1::ReconstructionStatus& reconstruction) {
  std::string text = fmt::format("{}: {}", reconstruction.session(),
                                 in_words(v1::ReconstructionStatus::State_Name(reconstruction.state())));
  switch (reconstruction.state()) {
    case v1::ReconstructionStatus::RUNNING:
      return text + fmt::format(", {:.0f} %, {}, {}{}", 100 * reconstruction.fraction(),
                                reconstruction.doing(), seconds_in_words(reconstruction.seconds()),
                                failed_in_words(reconstruction));
    case v1::ReconstructionStatus::DONE:
      return text + fmt::format(" after {}, in {}", seconds_in_words(reconstruction.seconds()),
                                reconstruction.result());
    case v1::ReconstructionStatus::FAILED:
      return text + ". " + reconstruction.error();
    case v1::ReconstructionStatus::CANCELLED:
      return fmt::format("{}: {}", reconstruction.session(), reconstruction.doing());
    default:
      return text;
  }
}

constexpr double kSilent = 30;  // s: of a job that tells nothing so long somebody should know

const char* name_of(v1::Job::Kind kind) {
  switch (kind) {
    case v1::Job::SALVAGE:
      return "salvage";
    case v1::Job::COMPRESS:
      return "compression";
    case v1::Job::FINISH:
      return "end";
    case v1::Job::VERIFY:
      return "verification";
    case v1::Job::REPAIR:
      return "repair";
    case v1::Job::EXPORT:
      return "export";
    case v1::Job::RECONSTRUCT:
      return "reconstruction";
    default:
      return "work";
  }
}

std::string storage_line(const v1::StorageStatus& storage) {
  return fmt::format("{}, {} free, {:.0f} min of recording left", storage.folder(),
                     bytes_in_words(static_cast<double>(storage.free_bytes())),
                     std::floor(storage.minutes_left()));
}

std::string fault_lines(const v1::Fault& fault) {
  std::string text = fmt::format(
      "  {:<6} {}{}: {}{}\n", in_words(fault.light()), in_words(v1::Fault::Kind_Name(fault.kind())),
      fault.subject().empty() ? "" : " " + fault.subject(), fault.what(), fault.over() ? " (over)" : "");
  if (!fault.remedy().empty()) text += fmt::format("         {}\n", fault.remedy());
  return text;
}

std::string round_head(const v1::AlignmentStatus& alignment) {
  std::string text =
      fmt::format("round {}: {} {} resets so far", alignment.round(), alignment.reason(), alignment.resets());
  if (alignment.has_worst_pair_s())
    text += fmt::format("; worst pair {:.3f} ms", alignment.worst_pair_s() * 1e3);
  return text + "\n";
}

}  // namespace

std::string in_words(std::string enum_name) {
  for (char& c : enum_name)
    c = c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return enum_name.ends_with("unspecified") ? "unknown" : enum_name;
}

std::string in_words(v1::Light light) { return in_words(v1::Light_Name(light)); }

std::string bytes_in_words(double bytes) {
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 999.5 && unit + 1 < kUnits.size(); ++unit) bytes /= 1000;
  return fmt::format("{:.{}f} {}", bytes, unit == 0 || bytes >= 99.95 ? 0 : 1, kUnits[unit]);
}

std::string seconds_in_words(double seconds) {
  if (!std::isfinite(seconds)) return "unknown";
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(std::min(seconds, 1e15)));
  if (whole < 120) return fmt::format("{} s", whole);
  if (whole < 7200) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole / 60 % 60);
}

std::string tolerance_in_words(double seconds, double rows) {
  const double ms = 1e3 * seconds;
  return fmt::format("{:.{}f} ms ({:.{}f} rows)", ms,
                     ms < 0.1 ? 4
                     : ms < 1 ? 3
                              : 2,
                     rows, rows < 100 ? 1 : 0);
}

std::string lock_in_words(const v1::AlignmentStatus& alignment) {
  if (alignment.verdict() != v1::AlignmentStatus::ALIGNED) return "";
  if (!alignment.has_time_left_s()) return "no end in sight";
  std::string text = fmt::format("a take may be {} long", seconds_in_words(alignment.time_left_s()));
  if (alignment.has_likely_left_s() && alignment.likely_left_s() > 1.1 * alignment.time_left_s())
    text += fmt::format(", most likely {}", seconds_in_words(alignment.likely_left_s()));
  if (!alignment.leaves_first().empty())
    text += fmt::format(", then {} leaves tolerance", alignment.leaves_first());
  if (alignment.has_renewed_left_s() && alignment.renewed_left_s() > 1.1 * alignment.time_left_s())
    text += fmt::format("; {} if renewed", seconds_in_words(alignment.renewed_left_s()));
  return text;
}

std::string losses(const v1::Counts& counts) {
  std::vector<std::string> parts;
  const auto add = [&](std::uint64_t n, const char* cause) {
    if (n > 0) parts.push_back(fmt::format("{} {}", n, cause));
  };
  add(counts.camera_gap(), "never came from the camera");
  add(counts.transport(), "on the way");
  add(counts.underrun(), "for want of a buffer");
  add(counts.queue(), "in the queue");
  add(counts.disk(), "refused by the disk");
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string recording_line(const v1::RecordingStatus& recording) {
  const std::string lost = losses(recording.lost());
  std::string line = fmt::format("{}: {}, {}, {} frames recorded", recording.session(),
                                 in_words(v1::RecordingStatus::State_Name(recording.state())),
                                 seconds_in_words(recording.seconds()), recording.frames());
  // Frames that are neither recorded nor lost yet, by stage.
  const v1::FrameProgress& progress = recording.progress();
  if (progress.arrived() > recording.frames() && progress.queued() + progress.written() > progress.safe())
    line += fmt::format(" of {} that came ({} in memory, {} not yet synced, the oldest {} old)",
                        progress.arrived(), progress.queued(), progress.written() - progress.safe(),
                        seconds_in_words(progress.at_risk_s()));
  return line + fmt::format(", {} lost, {}, {}/s, queue {:.0f} %", lost,
                            bytes_in_words(static_cast<double>(recording.bytes())),
                            bytes_in_words(recording.bytes_per_s()), 100 * recording.queue_fill());
}

std::string live_line(const v1::LiveStatus& live, std::int64_t now_ns) {
  const bool runs = live.state() == v1::LiveStatus::RUNNING;
  std::vector<std::string> parts;
  if (!runs) parts.push_back(in_words(v1::LiveStatus::State_Name(live.state())));
  if (live.has_frame()) {
    const bool goes_on = runs || live.state() == v1::LiveStatus::PAUSED;
    const double ago = 1e-9 * static_cast<double>(now_ns - live.filmed_ns());
    parts.push_back(fmt::format("frame {}, {:.1f} s {}", live.frame(),
                                std::max(goes_on ? ago : live.delay_s(), 0.0),
                                goes_on ? "ago" : "after it was filmed"));
    parts.push_back(fmt::format("{} voxels", live.voxels()));
    parts.push_back(fmt::format("{:.2f} s a volume", live.takes_s()));
  }
  if (live.volumes() + live.skipped() > 0)
    parts.push_back(fmt::format("{} shown, {} skipped", live.volumes(), live.skipped()));
  if (!live.device().empty()) parts.push_back("on " + live.device());
  std::string line = fmt::format("{}", fmt::join(parts, ", "));
  return live.reason().empty() ? line : line + ". " + live.reason();
}

std::string live_preview_line(const v1::IterationPreview& preview) {
  return fmt::format("{}: frame {}, {:.1f} s after it was filmed, {:.2f} s a volume",
                     preview.reconstruction(), preview.frame(), preview.live_delay_s(),
                     preview.iteration().seconds());
}

std::string iteration_line(const v1::Iteration& iteration) {
  std::string text = fmt::format("iteration {}: {:.1f} s, input error {:.2f}", iteration.iteration(),
                                 iteration.seconds(), iteration.input_rmse());
  if (iteration.has_heldout_rmse())
    text += fmt::format(", held-out error about {:.2f}", iteration.heldout_rmse());
  return text + " grey levels";
}

std::string frame_line(const v1::SequenceFrame& frame) {
  std::string text = fmt::format("frame {}: {}", frame.frame(),
                                 in_words(v1::ReconstructionStatus::State_Name(frame.state())));
  if (frame.state() != v1::ReconstructionStatus::DONE)
    return frame.error().empty() ? text : text + ". " + frame.error();
  text += fmt::format(", input error {:.2f}", frame.input_rmse());
  if (frame.has_heldout_rmse()) text += fmt::format(", held-out error about {:.2f}", frame.heldout_rmse());
  text += " grey levels";
  return frame.temperature().empty() ? text : text + "; " + frame.temperature();
}

std::string round_line(const v1::DaemonStatus& status) {
  std::string text = round_head(status.alignment());
  for (const v1::CameraStatus& camera : status.cameras())
    if (camera.reset_next() || camera.state() != v1::CameraStatus::FILMING) text += camera_line(camera);
  return text;
}

std::string round_table(const v1::DaemonStatus& status) {
  std::string text = round_head(status.alignment());
  for (const v1::CameraStatus& camera : status.cameras()) text += camera_line(camera);
  return text;
}

std::string status_screen(const v1::DaemonStatus& status) {
  std::string text;
  add_line(text, "rig",
           fmt::format("{} (emberlockd {}, up {})", status.rig(), status.version(),
                       seconds_in_words(status.uptime_s())));
  add_line(text, "state",
           fmt::format("{}, {}{}{}", in_words(v1::Phase_Name(status.phase())), in_words(status.light()),
                       status.reason().empty() ? "" : ": ", status.reason()));
  add_line(text, "next", status.next_step());
  if (!status.lent_to().empty()) add_line(text, "lent to", status.lent_to() + ": align and record there");
  if (status.has_alignment()) {
    const v1::AlignmentStatus& alignment = status.alignment();
    if (alignment.tolerance_s() > 0)
      add_line(text, "tolerance", tolerance_in_words(alignment.tolerance_s(), alignment.tolerance_rows()));
    add_line(text, "lock", lock_in_words(alignment));
  }
  add_line(text, "strobe", strobe_line(status.strobe()));
  if (status.has_storage()) add_line(text, "disk", storage_line(status.storage()));
  if (status.has_recording()) {
    add_line(text, "recording", recording_line(status.recording()));
    add_line(text, "", status.recording().verdict());
    for (const v1::HostPart& part : status.recording().hosts()) add_line(text, "", part_line(part));
  }
  if (status.has_live()) add_line(text, "live", live_line(status.live(), status.now_ns()));
  if (status.has_reconstruction()) add_line(text, "volume", reconstruction_line(status.reconstruction()));
  for (const v1::Job& job : status.jobs()) add_line(text, "job", job_line(job));
  if (!status.faults().empty()) text += "faults\n";
  for (const v1::Fault& fault : status.faults()) text += fault_lines(fault);
  if (!status.hosts().empty()) text += "hosts\n";
  for (const v1::HostStatus& host : status.hosts()) text += "  " + host_line(host) + "\n";
  if (!status.cameras().empty()) text += "cameras\n";
  for (const v1::CameraStatus& camera : status.cameras()) text += camera_line(camera);
  return text;
}

std::string job_line(const v1::Job& job) {
  const std::string text = fmt::format("{} of {}: ", name_of(job.kind()), job.session());
  switch (job.state()) {
    case v1::Job::RUNNING:
      return text + fmt::format("{:.0f} % done", 100 * job.fraction()) +
             (job.silent_s() < kSilent ? "" : ", nothing new for " + seconds_in_words(job.silent_s()));
    case v1::Job::PAUSED:
      return text + "stands still while something is recorded";
    default:
      return text + "waits";
  }
}

std::string json_line(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string text;
  static_cast<void>(google::protobuf::util::MessageToJsonString(message, &text, options).ok());
  return text;
}

}  // namespace emberlock::cli
