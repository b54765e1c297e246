// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/metrics.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <sys/resource.h>
#include <unistd.h>

namespace emberlock::daemon {
namespace {

/// Labels as written between braces: camera="CAM 1",fate="delivered".
using Labels = std::vector<std::pair<std::string_view, std::string>>;

std::string escaped(std::string_view value) {
  std::string text;
  for (const char c : value) {
    if (c == '\\' || c == '"') text += '\\';
    if (c == '\n')
      text += "\\n";
    else
      text += c;
  }
  return text;
}

/// Metric families in the order of their first sample, each with its help text once.
class Exposition {
 public:
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
  }
  template <class Number>
  void sample(Number value, const Labels& labels = {}) {
    text_ += name_;
    if (!labels.empty()) {
      text_ += '{';
      for (const auto& [label, text] : labels)
        text_ += fmt::format("{}{}=\"{}\"", text_.back() == '{' ? "" : ",", label, escaped(text));
      text_ += '}';
    }
    text_ += ' ' + written(value) + '\n';
  }
  template <class Number>
  void single(std::string_view name, std::string_view type, std::string_view help, Number value) {
    family(name, type, help);
    sample(value);
  }
  /// One sample for each value of an enumeration; 1 for the current one.
  template <class Enum>
  void states(Enum current, const Labels& labels = {}) {
    const google::protobuf::EnumDescriptor* all = google::protobuf::GetEnumDescriptor<Enum>();
    for (int i = 0; i < all->value_count(); ++i) {
      if (all->value(i)->number() == 0) continue;
      Labels with_state = labels;
      with_state.emplace_back("state", lower(all->value(i)->name()));
      sample(all->value(i)->number() == current ? 1 : 0, with_state);
    }
  }
  static std::string lower(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
  }
  std::string take() { return std::move(text_); }

 private:
  template <class Number>
  static std::string written(Number value) {
    if constexpr (std::is_floating_point_v<Number>) {
      if (std::isnan(value)) return "NaN";
      if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
    }
    return fmt::format("{}", value);
  }

  std::string name_;
  std::string text_;
};

/// One sample for each field of a message of counters, under the field's name.
void sample_fields(Exposition& out, const google::protobuf::Message& counts, std::string_view label,
                   const Labels& labels = {}) {
  const google::protobuf::Descriptor* type = counts.GetDescriptor();
  for (int i = 0; i < type->field_count(); ++i) {
    Labels with_field = labels;
    with_field.emplace_back(label, type->field(i)->name());
    out.sample(counts.GetReflection()->GetUInt64(counts, type->field(i)), with_field);
  }
}

void show_daemon(Exposition& out, const v1::DaemonStatus& status) {
  out.family("emberlock_build_info", "gauge", "1; the version is a label.");
  out.sample(1, {{"version", status.version()}});
  out.family("emberlock_phase", "gauge", "1 for what the rig is doing.");
  out.states(status.phase());
  out.family("emberlock_light", "gauge", "1 for the light that the daemon shows.");
  out.states(status.light());
  std::map<int, int> faults;
  for (const v1::Fault& fault : status.faults()) {
    if (!fault.over()) ++faults[fault.kind()];
  }
  out.family("emberlock_faults", "gauge", "Faults that last, by kind.");
  for (int kind = v1::Fault::KIND_UNSPECIFIED + 1; kind <= v1::Fault::Kind_MAX; ++kind)
    out.sample(faults[kind], {{"kind", Exposition::lower(v1::Fault::Kind_Name(kind))}});
  const v1::AlignmentStatus& alignment = status.alignment();
  out.single("emberlock_alignment_round", "gauge", "Rounds of the alignment that runs or ran last.",
             alignment.round());
  out.single("emberlock_alignment_tolerance_seconds", "gauge", "What is asked of every pair of cameras.",
             alignment.tolerance_s());
  if (alignment.has_worst_pair_s())
    out.single("emberlock_alignment_worst_pair_seconds", "gauge", "Between the first and the last camera.",
               alignment.worst_pair_s());
  if (alignment.has_time_left_s())
    out.single("emberlock_alignment_time_left_seconds", "gauge",
               "Until the first camera may leave tolerance.", alignment.time_left_s());
}

void show_cameras(Exposition& out, const v1::DaemonStatus& status) {
  const auto each = [&](std::string_view name, std::string_view type, std::string_view help, auto show) {
    out.family(name, type, help);
    for (const v1::CameraStatus& camera : status.cameras()) show(camera, Labels{{"camera", camera.id()}});
  };
  using Camera = v1::CameraStatus;
  each("emberlock_camera_state", "gauge", "1 for the camera's state.",
       [&](const Camera& c, const Labels& labels) { out.states(c.state(), labels); });
  each("emberlock_camera_frames_total", "counter", "Frames since it was opened, by fate.",
       [&](const Camera& c, const Labels& labels) { sample_fields(out, c.counts(), "fate", labels); });
  each("emberlock_camera_frame_rate_hertz", "gauge", "Measured over the last seconds; 0 if not known.",
       [&](const Camera& c, const Labels& labels) { out.sample(c.measured_rate_hz(), labels); });
  each("emberlock_camera_error_seconds", "gauge", "To the target; positive when it reads earlier.",
       [&](const Camera& c, const Labels& labels) {
         if (c.has_error_s()) out.sample(c.error_s(), labels);
       });
  each("emberlock_camera_sigma_rows", "gauge", "Standard deviation of the error.",
       [&](const Camera& c, const Labels& labels) {
         if (c.has_sigma_rows()) out.sample(c.sigma_rows(), labels);
       });
  each("emberlock_camera_drift_ppm", "gauge", "Of its rate against the target.",
       [&](const Camera& c, const Labels& labels) {
         if (c.has_drift_ppm()) out.sample(c.drift_ppm(), labels);
       });
  each("emberlock_camera_time_left_seconds", "gauge", "In tolerance, as it drifts now.",
       [&](const Camera& c, const Labels& labels) {
         if (c.has_time_left_s()) out.sample(c.time_left_s(), labels);
       });
  each("emberlock_camera_resets_total", "counter", "Resets of its shutter.",
       [&](const Camera& c, const Labels& labels) { out.sample(c.resets(), labels); });
}

void show_recording(Exposition& out, const v1::DaemonStatus& status) {
  const v1::RecordingStatus& recording = status.recording();
  out.family("emberlock_recording_state", "gauge", "1 for the state of the recording that runs or ran last.");
  out.states(recording.state());
  out.single("emberlock_recording_frames", "gauge", "Recorded, of all cameras: on the disk and synced.",
             recording.frames());
  const v1::FrameProgress& progress = recording.progress();
  out.family(
      "emberlock_recording_progress_frames", "gauge",
      "How far frames have come: arrived = queued + written + what queue and disk lost; safe are those of "
      "the written that are synced.");
  out.sample(static_cast<double>(progress.arrived()), {{"stage", "arrived"}});
  out.sample(static_cast<double>(progress.queued()), {{"stage", "queued"}});
  out.sample(static_cast<double>(progress.written()), {{"stage", "written"}});
  out.sample(static_cast<double>(progress.safe()), {{"stage", "safe"}});
  out.single("emberlock_recording_at_risk_seconds", "gauge",
             "Since the oldest frame that isn't safe arrived: what a power cut takes.", progress.at_risk_s());
  out.single("emberlock_recording_bytes", "gauge", "Written.", recording.bytes());
  out.single("emberlock_recording_bytes_per_second", "gauge", "Written now.", recording.bytes_per_s());
  out.single("emberlock_recording_queue_fill_ratio", "gauge", "Of the fullest queue.",
             recording.queue_fill());
  out.family("emberlock_recording_counts", "gauge", "What became of the recording's frames.");
  sample_fields(out, recording.lost(), "fate");
  const v1::StorageStatus& storage = status.storage();
  out.single("emberlock_storage_free_bytes", "gauge", "Of the disk that is recorded to.",
             storage.free_bytes());
  out.single("emberlock_storage_floor_bytes", "gauge", "Below it frames are refused.", storage.floor_bytes());
  out.single("emberlock_storage_time_left_seconds", "gauge", "Of recording, above the floor.",
             storage.minutes_left() * 60);
}

void show_reconstruction(Exposition& out, const v1::DaemonStatus& status) {
  const v1::ReconstructionStatus& reconstruction = status.reconstruction();
  out.family("emberlock_reconstruction_state", "gauge", "1 for the state of the one that runs or ran last.");
  out.states(reconstruction.state());
  out.single("emberlock_reconstruction_iterations", "gauge", "Done.", reconstruction.iterations_size());
  out.single("emberlock_reconstruction_done_ratio", "gauge", "How far it is.", reconstruction.fraction());
}

void show_clients(Exposition& out, const ClientCounts& clients) {
  out.family("emberlock_watchers", "gauge", "Who watches: consoles, and streams over gRPC.");
  out.sample(clients.viewers, {{"by", "console"}});
  out.sample(clients.other_watchers, {{"by", "grpc"}});
  out.family("emberlock_refused_total", "counter", "Requests that were turned away, by what was wrong.");
  for (const auto& [way, counts] : clients.refused) {
    for (std::size_t i = 0; i < counts.size(); ++i)
      out.sample(counts[i], {{"by", way}, {"reason", std::string(name_of(static_cast<Refusal>(i)))}});
  }
}

void show_process(Exposition& out, const ProcessUsage& process) {
  out.single("process_cpu_seconds_total", "counter", "Processor time, of user and system.", process.cpu_s);
  out.single("process_resident_memory_bytes", "gauge", "Memory that it holds.", process.resident_bytes);
  out.single("process_open_fds", "gauge", "Open file descriptors.", process.open_files);
  out.single("process_start_time_seconds", "gauge", "Since 1970-01-01 UTC.", process.start_s);
}

double start_time(const std::vector<std::string>& stat_fields) {
  constexpr std::size_t kStartField = 19;  // of /proc/self/stat, counted from the state field
  if (stat_fields.size() <= kStartField) return 0;
  std::ifstream stat("/proc/stat");
  for (std::string word; stat >> word;) {
    double boot_s = 0;
    if (word == "btime" && stat >> boot_s)
      return boot_s + std::stod(stat_fields[kStartField]) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  return 0;
}

/// Of a host that leads.
void show_hosts(Exposition& out, const v1::DaemonStatus& status) {
  if (status.hosts().empty()) return;
  out.family("emberlock_host_connected", "gauge", "1 where the other host answers.");
  for (const v1::HostStatus& host : status.hosts())
    out.sample(host.connected() ? 1 : 0, {{"host", host.host()}});
  out.family("emberlock_host_round_trip_seconds", "gauge", "Of a question, lately.");
  for (const v1::HostStatus& host : status.hosts()) out.sample(host.round_trip_s(), {{"host", host.host()}});
  out.family("emberlock_host_parts_wanting", "gauge", "Parts of recordings that aren't known to be whole.");
  for (const v1::HostStatus& host : status.hosts()) out.sample(host.parts_wanting(), {{"host", host.host()}});
}

}  // namespace

ProcessUsage process_usage() {
  ProcessUsage usage;
  rusage times{};
  ::getrusage(RUSAGE_SELF, &times);
  for (const timeval& part : {times.ru_utime, times.ru_stime})
    usage.cpu_s += static_cast<double>(part.tv_sec) + static_cast<double>(part.tv_usec) * 1e-6;
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  usage.resident_bytes = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  std::error_code error;
  for (auto file = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && file != std::filesystem::directory_iterator(); file.increment(error))
    ++usage.open_files;
  std::string line;
  std::ifstream stat("/proc/self/stat");
  std::getline(stat, line);
  // The program's name is in parentheses and may contain any characters.
  std::istringstream rest(line.substr(std::min(line.rfind(')') + 2, line.size())));
  std::vector<std::string> fields;
  for (std::string field; rest >> field;) fields.push_back(field);
  usage.start_s = start_time(fields);
  return usage;
}

std::string metrics_text(const v1::DaemonStatus& status, const ProcessUsage& process,
                         const ClientCounts& clients) {
  Exposition out;
  show_daemon(out, status);
  show_cameras(out, status);
  show_recording(out, status);
  show_hosts(out, status);
  show_reconstruction(out, status);
  show_clients(out, clients);
  show_process(out, process);
  return out.take();
}

}  // namespace emberlock::daemon
