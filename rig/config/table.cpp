// SPDX-License-Identifier: Apache-2.0
#include "rig/config/keys.h"
#include "smear_sync/align/align.h"

// Every key of the configuration but the rig's.
namespace emberlock::rig::config {
namespace {

std::string print_tolerance(const smear::Tolerance& tolerance) {
  if (const auto* rows = std::get_if<Rows>(&tolerance.amount))
    return fmt::format("{:.12g}rows", rows->value());
  return fmt::format("{:.12g}ms", in_milliseconds(std::get<Seconds>(tolerance.amount)));
}

Section<DaemonConfig> make_alignment_section() {
  using C = DaemonConfig;
  using AtStart = AlignmentConfig::AtStart;
  const auto parse = [](const std::string& given) -> std::optional<smear::Tolerance> {
    const auto tolerance = smear::parse_tolerance(given);
    return tolerance ? std::optional(*tolerance) : std::nullopt;
  };
  return {
      "alignment",
      "How the shutters are brought together, and what that may cost.",
      {choice<C>("at_start", EMBERLOCK_AT(alignment.at_start),
                 {{"nothing", AtStart::nothing}, {"align", AtStart::align}},
                 "Whether the daemon begins to align by itself once the cameras film."),
       spelled<C>("tolerance", EMBERLOCK_AT(alignment.run.align.tolerance),
                  "a number with its unit: \"100rows\", \"5.4ms\", \"500us\"", parse, print_tolerance,
                  "How far a camera may lie from the common target, to either side."),
       choice<C>(
           "policy", EMBERLOCK_AT(alignment.run.align.policy),
           named<smear::AlignPolicy>({smear::AlignPolicy::fixed_reference, smear::AlignPolicy::densest,
                                      smear::AlignPolicy::timed, smear::AlignPolicy::trimmed},
                                     [](smear::AlignPolicy p) { return name(p); }),
           "Which cameras are reset, towards what: the paper's (one camera stays), the target that takes the "
           "fewest resets, resets timed to land on it, or frame rates trimmed towards it."),
       text<C>("reference", EMBERLOCK_AT(alignment.reference), "a camera's id",
               "The camera that stays, of policy \"fixed-reference\"; the first if absent.",
               "\"virtual-00\""),
       number<C>("max_minutes", EMBERLOCK_AT(alignment.run.align.limits->time), {0.01, 1e6, 60},
                 "A tolerance that would take longer is refused, with what could be met."),
       number<C>("max_resets", EMBERLOCK_AT(alignment.run.align.limits->resets), {1, 1000000},
                 "One that would take more resets is refused, likewise."),
       number<C>("probability", EMBERLOCK_AT(alignment.run.align.limits->probability), {0.01, 1},
                 "Probability with which the alignment must stay within these limits."),
       number<C>("max_rounds", EMBERLOCK_AT(alignment.run.align.max_rounds), {1, 1000000},
                 "Rounds of filming without all within tolerance, then it is given up."),
       number<C>("reset_s", EMBERLOCK_AT(alignment.run.align.reset_time), {0, 3600},
                 "An operator's way to the button, for what is foretold."),
       number<C>("delay_jitter_ms", EMBERLOCK_AT(alignment.run.align.delay_jitter), {0.001, 1000, kMilli},
                 "Standard deviation of one reset's delay, until it has been seen."),
       number<C>("flash_width_us", EMBERLOCK_AT(alignment.run.flash_width), {0.1, 10000, kMicro},
                 "How long the strobe's flashes are."),
       number<C>("frames_per_round", EMBERLOCK_AT(alignment.run.frames_per_round), {1, 1000},
                 "That each camera films for one decision."),
       choice<C>("row_time", EMBERLOCK_AT(alignment.run.measure_row_time),
                 {{"measured", true}, {"configured", false}},
                 "Whether a comb of flashes measures it first, or row_time_us of each camera holds."),
       number<C>("comb_rate_hz", EMBERLOCK_AT(alignment.run.comb_rate), {30, 333},
                 "Flashes a second of that comb; about ten a frame if absent.", "300"),
       number<C>("comb_frames", EMBERLOCK_AT(alignment.run.comb_frames), {1, 1000},
                 "Frames of it, of each camera."),
       number<C>("frame_deadline_s", EMBERLOCK_AT(alignment.run.frame_deadline), {0.1, 60},
                 "Longest wait for a frame, a reset's latency included."),
       number<C>("reset_lead_ms", EMBERLOCK_AT(alignment.run.reset_lead), {0, 10000, kMilli},
                 "Between ordering a reset and its earliest moment."),
       number<C>("seed", EMBERLOCK_AT(alignment.run.seed), {0, 1e9},
                 "Of the moments of resets that aren't timed."),
       text<C>("delays", EMBERLOCK_AT(alignment.delays), kPath,
               "Keeps what is known of the cameras' reset delays from run to run; nothing is kept if absent.",
               "\"delays.json\"")}};
}

Section<DaemonConfig> make_recording_section() {
  using C = DaemonConfig;
  using Transcode = RecordingConfig::Transcode;
  return {
      "recording",
      "Where recordings go, and how.",
      {text<C>("folder", EMBERLOCK_AT(recording.folder), kPath, "Each session gets a folder in it."),
       choice<C>("encoding", EMBERLOCK_AT(recording.writer.encoding),
                 {{"ffv1", session::Encoding::ffv1}, {"raw", session::Encoding::raw_nut}},
                 "Both are lossless: \"ffv1\" takes processor time, about 77 MB/s a thread, \"raw\" "
                 "twice the disk."),
       choice<C>("transcode", EMBERLOCK_AT(recording.transcode),
                 {{"never", Transcode::never}, {"when-idle", Transcode::when_idle}},
                 "Turns raw recordings into FFV1 while nothing is recorded, and verifies them."),
       number<C>("free_space_floor_mib", EMBERLOCK_AT(recording.writer.min_free_bytes), {0, 1e9, kMebi},
                 "Below so much free disk frames are refused, so that the disk never fills up."),
       number<C>("queue_s", EMBERLOCK_AT(recording.queue.queue_time), {0.05, 60},
                 "A camera's frame waits in memory no longer for its encoder; then new ones are lost, and "
                 "counted. A power cut loses the frames that still wait, and at most half a second more."),
       number<C>("queue_mib", EMBERLOCK_AT(recording.queue.queue_bytes), {1, 1e6, kMebi},
                 "Memory that one camera's waiting frames may take."),
       number<C>("frames_per_segment", EMBERLOCK_AT(recording.writer.frames_per_segment), {1, 1e9},
                 "Frames after which a file is closed and the next begun."),
       number<C>("segment_mib", EMBERLOCK_AT(recording.writer.bytes_per_segment), {1, 1e6, kMebi},
                 "Size at which a file is closed and the next begun.")}};
}

/// hold_out = [3, 7]
Key<DaemonConfig> hold_out() {
  Key<DaemonConfig> key{"hold_out",
                        "a list of whole numbers from 0 to 63",
                        "Views, counted from 0, that are kept for judging the result.",
                        "[3]",
                        {},
                        {}};
  key.read = [](const toml::node& node, DaemonConfig& config) {
    const toml::array* list = node.as_array();
    if (list == nullptr) return false;
    for (const toml::node& entry : *list) {
      const auto view = entry.is_integer() ? entry.value<int>() : std::nullopt;
      if (!view || *view < 0 || *view > 63) return false;
      config.reconstruction.hold_out.push_back(*view);
    }
    return true;
  };
  key.write = [](const DaemonConfig& config) {
    const auto& views = config.reconstruction.hold_out;
    return views.empty() ? std::string() : fmt::format("[{}]", fmt::join(views, ", "));
  };
  return key;
}

Section<DaemonConfig> make_reconstruction_section() {
  using C = DaemonConfig;
  return {"reconstruction",
          "Turns a finished recording into a volume, in a process of its own.",
          {text<C>("program", EMBERLOCK_AT(reconstruction.program), kPath,
                   "The `emberlock` to run; searched for in PATH unless it has a slash."),
           choice<C>("device", EMBERLOCK_AT(reconstruction.device),
                     {{"auto", "auto"}, {"cpu", "cpu"}, {"cuda", "cuda"}}, "What it computes on."),
           number<C>("budget_s", EMBERLOCK_AT(reconstruction.budget), {1, 86400},
                     "Be done within so long; by the reconstruction's own rules if absent.", "60"),
           number<C>(
               "voxels", EMBERLOCK_AT(reconstruction.voxels), {1, 1024},
               "Along the longest edge. If absent, the knee of time against error, measured on this machine.",
               "192"),
           hold_out(),
           number<C>("threads", EMBERLOCK_AT(reconstruction.threads), {0, 256}, "On the CPU; 0: one a core."),
           number<C>("silence_s", EMBERLOCK_AT(reconstruction.silence), {1, 86400},
                     "Without a word of progress for so long it hangs, and is ended."),
           number<C>("niceness", EMBERLOCK_AT(reconstruction.niceness), {0, 19},
                     "How far it gives way to cameras and recordings.")}};
}

Section<DaemonConfig> make_server_section() {
  using C = DaemonConfig;
  return {
      "server",
      "Who reaches the daemon, and how.",
      {text<C>("socket", EMBERLOCK_AT(server.socket), kPath,
               "Unix socket of the API (gRPC): who may enter its folder may use it."),
       text<C>("listen", EMBERLOCK_AT(server.listen), kAddress,
               "The API over TCP; needs tls_certificate, tls_key and token_file. Nowhere if empty.",
               "\"0.0.0.0:7141\""),
       text<C>(
           "http_listen", EMBERLOCK_AT(server.http_listen), kAddress,
           "The console and the JSON API: browsers are let in by the link that `emberlock console` prints, "
           "programs by the token. Beyond localhost over TLS: it needs tls_certificate, tls_key and "
           "token_file "
           "then. Nowhere if empty."),
       text<C>("tls_certificate", EMBERLOCK_AT(server.tls_certificate), kPath,
               "Of listen and http_listen. PEM, with its chain.", "\"server.crt\""),
       text<C>("tls_key", EMBERLOCK_AT(server.tls_key), kPath,
               "PEM; others may not read it, nor its group write to it.", "\"server.key\""),
       text<C>("tls_clients", EMBERLOCK_AT(server.tls_clients), kPath,
               "PEM of the authority that signs clients' certificates: with it each client that comes by TLS "
               "must have one, browsers too.",
               "\"clients.crt\""),
       text<C>("token_file", EMBERLOCK_AT(server.token_file), kPath,
               "A file that holds the token and nothing else. Clients show it, by HTTP on this machine too; "
               "others may not read it, nor its group write to it.",
               "\"token\""),
       text<C>("console", EMBERLOCK_AT(server.console), kPath,
               "The folder of the console's files; share/emberlock/console beside the program's folder if "
               "absent.",
               "\"console\""),
       number<C>(
           "viewers", EMBERLOCK_AT(server.viewers), {1, 1000},
           "Consoles that may watch at a time; when one more comes, one of whoever has most makes room."),
       number<C>("picture_width", EMBERLOCK_AT(server.picture_width), {32, 4096},
                 "Of live pictures, in pixels, at most."),
       number<C>("picture_rate_hz", EMBERLOCK_AT(server.picture_rate), {0.1, 60},
                 "Live pictures a second of each camera, at most."),
       number<C>("picture_quality", EMBERLOCK_AT(server.picture_quality), {1, 100}, "Of their JPEG."),
       number<C>("message_mib", EMBERLOCK_AT(server.message_bytes), {1, 64, kMebi},
                 "A client's request, at most.")}};
}

Section<DaemonConfig> make_log_section() {
  using C = DaemonConfig;
  using Format = LogConfig::Format;
  std::vector<std::pair<std::string_view, std::string>> levels;
  for (const char* level : {"trace", "debug", "info", "warn", "error", "off"})
    levels.emplace_back(level, level);
  return {"log",
          "What the daemon writes to the journal (stderr).",
          {choice<C>("level", EMBERLOCK_AT(log.level), levels,
                     "The least that is written; EMBERLOCK_LOG goes before it."),
           choice<C>("format", EMBERLOCK_AT(log.format), {{"text", Format::text}, {"json", Format::json}},
                     "For people, or one JSON object a line.")}};
}

}  // namespace

std::string in_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      (out += '\\') += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += fmt::format("\\u{:04X}", byte);
    } else {
      out += c;
    }
  }
  return out + '"';
}

const std::vector<Section<DaemonConfig>>& sections() {
  static const std::vector<Section<DaemonConfig>> all = [] {
    std::vector<Section<DaemonConfig>> list = rig_sections();
    list.push_back(make_alignment_section());
    list.push_back(make_recording_section());
    list.push_back(make_reconstruction_section());
    list.push_back(make_server_section());
    list.push_back(make_log_section());
    return list;
  }();
  return all;
}

}  // namespace emberlock::rig::config
