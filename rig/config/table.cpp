// SPDX-License-Identifier: Apache-2.0
#include "rig/config/keys.h"
#include "smear_sync/align/align.h"

// All keys of the configuration except the rig's.
namespace emberlock::rig::config {
namespace {

std::string print_tolerance(const smear::Tolerance& tolerance) {
  if (const auto* rows = std::get_if<Rows>(&tolerance.amount))
    return fmt::format("{:.12g}rows", rows->value());
  return fmt::format("{:.12g}ms", in_milliseconds(std::get<Seconds>(tolerance.amount)));
}

/// instants = "staggered"
Key<DaemonConfig> instants() {
  using C = DaemonConfig;
  return choice<C>(
      "instants", EMBERLOCK_AT(alignment.stagger), {{"common", false}, {"staggered", true}},
      "\"common\": all cameras film at one instant. \"staggered\": each at its own, spread evenly "
      "over the frame period, the cameras in the order in which they stand around the flame.");
}

Section<DaemonConfig> make_alignment_section() {
  using C = DaemonConfig;
  const auto parse = [](const std::string& given) -> std::optional<smear::Tolerance> {
    const auto tolerance = smear::parse_tolerance(given);
    return tolerance ? std::optional(*tolerance) : std::nullopt;
  };
  return {
      "alignment",
      "How the shutters are aligned, and how long that may take.",
      {choice<C>("at_start", EMBERLOCK_AT(alignment.at_start),
                 {{"nothing", AlignmentConfig::AtStart::nothing}, {"align", AlignmentConfig::AtStart::align}},
                 "Whether the daemon begins to align by itself once the cameras film."),
       instants(),
       number<C>("flame_speed_m_s", EMBERLOCK_AT(alignment.flame.speed), {0.001, 10000},
                 "Speed of what moves fastest in the flame, in metres per second."),
       number<C>("detail_mm", EMBERLOCK_AT(alignment.flame.detail), {0.001, 10000, kMilli},
                 "Size of the smallest detail that shall be resolved: a few voxels."),
       spelled<C>("tolerance", EMBERLOCK_AT(alignment.tolerance),
                  "a number with its unit: \"0.5ms\", \"500us\", \"10rows\"", parse, print_tolerance,
                  "Largest allowed distance of a camera from the common target, to either side. If absent: "
                  "the time in which the flame moves by a quarter of that detail.",
                  "\"0.5ms\""),
       number<C>("shortest_take_s", EMBERLOCK_AT(alignment.run.align.shortest_take), {0, 3600},
                 "Lock is called good when it surely holds for so long, as far as measured drifts and resets "
                 "can make it; it is renewed before less is left."),
       choice<C>(
           "policy", EMBERLOCK_AT(alignment.run.align.policy),
           named<smear::AlignPolicy>({smear::AlignPolicy::fixed_reference, smear::AlignPolicy::densest,
                                      smear::AlignPolicy::timed, smear::AlignPolicy::trimmed},
                                     [](smear::AlignPolicy p) { return name(p); }),
           "Which cameras are reset, towards what: the paper's (one camera stays), the target that takes the "
           "fewest resets, resets timed to land on it, or frame rates trimmed towards it."),
       text<C>("reference", EMBERLOCK_AT(alignment.reference), "a camera's id",
               "Policy \"fixed-reference\" only: the camera that is never reset; the first if absent.",
               "\"virtual-00\""),
       number<C>("max_minutes", EMBERLOCK_AT(alignment.run.align.limits->time), {0.01, 1e6, 60},
                 "A tolerance that would take longer is refused; the refusal names one that can be met."),
       number<C>("max_resets", EMBERLOCK_AT(alignment.run.align.limits->resets), {1, 1000000},
                 "A tolerance that would take more resets is refused likewise."),
       number<C>("probability", EMBERLOCK_AT(alignment.run.align.limits->probability), {0.01, 1},
                 "Probability with which the alignment must stay within these limits."),
       number<C>("max_rounds", EMBERLOCK_AT(alignment.run.align.max_rounds), {1, 1000000},
                 "The alignment is given up when not all cameras are within tolerance after so many rounds."),
       number<C>("reset_s", EMBERLOCK_AT(alignment.run.align.reset_time), {0, 3600},
                 "Time that an operator needs for one reset by hand; the forecast uses it."),
       number<C>("delay_jitter_ms", EMBERLOCK_AT(alignment.run.align.delay_jitter), {0.001, 1000, kMilli},
                 "Assumed standard deviation of a reset's delay, until resets have been measured."),
       number<C>("flash_width_us", EMBERLOCK_AT(alignment.run.flash_width), {0.1, 10000, kMicro},
                 "Duration of one flash of the strobe."),
       number<C>("frames_per_round", EMBERLOCK_AT(alignment.run.frames_per_round), {1, 1000},
                 "Frames that each camera films in one round."),
       choice<C>("row_time", EMBERLOCK_AT(alignment.run.measure_row_time),
                 {{"measured", true}, {"configured", false}},
                 "\"measured\": a comb of flashes measures each camera's row time first. \"configured\": "
                 "row_time_us of each camera is used."),
       number<C>("comb_rate_hz", EMBERLOCK_AT(alignment.run.comb_rate), {30, 333},
                 "Flashes per second of the comb; about ten per frame if absent.", "300"),
       number<C>("comb_frames", EMBERLOCK_AT(alignment.run.comb_frames), {1, 1000},
                 "Frames of the comb that each camera films."),
       number<C>("frame_deadline_s", EMBERLOCK_AT(alignment.run.frame_deadline), {0.1, 60},
                 "Longest wait for a frame; it includes the latency of a reset."),
       number<C>("reset_lead_ms", EMBERLOCK_AT(alignment.run.reset_lead), {0, 10000, kMilli},
                 "Shortest time between the order of a reset and the reset."),
       number<C>("seed", EMBERLOCK_AT(alignment.run.seed), {0, 1e9},
                 "Seed of the random moments of resets that aren't timed."),
       text<C>(
           "delays", EMBERLOCK_AT(alignment.delays), kPath,
           "File that keeps the measured reset delays of the cameras for the next run; not kept if absent.",
           "\"delays.json\"")}};
}

Section<DaemonConfig> make_recording_section() {
  using C = DaemonConfig;
  using Transcode = RecordingConfig::Transcode;
  return {
      "recording",
      "Where and how recordings are written.",
      {text<C>("folder", EMBERLOCK_AT(recording.folder), kPath,
               "Each session gets a folder in it. If absent: /var/lib/emberlock/sessions for root and the "
               "service, emberlock/sessions in $XDG_DATA_HOME (~/.local/share) for other users.",
               "\"/var/lib/emberlock/sessions\""),
       choice<C>("encoding", EMBERLOCK_AT(recording.writer.encoding),
                 {{"ffv1", session::Encoding::ffv1}, {"raw", session::Encoding::raw_nut}},
                 "Both are lossless. \"ffv1\" takes processor time (one thread encodes about 77 MB/s), "
                 "\"raw\" takes twice the disk space."),
       choice<C>(
           "transcode", EMBERLOCK_AT(recording.transcode),
           {{"never", Transcode::never}, {"when-idle", Transcode::when_idle}},
           "\"when-idle\" converts raw recordings to FFV1 and verifies them while nothing is recorded."),
       number<C>("free_space_floor_mib", EMBERLOCK_AT(recording.writer.min_free_bytes), {0, 1e9, kMebi},
                 "When less disk space is free, frames are refused, so that the disk never fills up."),
       number<C>("queue_s", EMBERLOCK_AT(recording.queue.queue_time), {0.05, 60},
                 "Longest time that frames wait in memory for the encoder; beyond it new frames are dropped "
                 "and counted. A power cut loses the waiting frames and at most half a second more."),
       number<C>("queue_mib", EMBERLOCK_AT(recording.queue.queue_bytes), {1, 1e6, kMebi},
                 "Most memory for the waiting frames of one camera."),
       number<C>("frames_per_segment", EMBERLOCK_AT(recording.writer.frames_per_segment), {1, 1e9},
                 "Frames per file; then the next file is begun."),
       number<C>("segment_mib", EMBERLOCK_AT(recording.writer.bytes_per_segment), {1, 1e6, kMebi},
                 "Size of a file; then the next file is begun.")}};
}

/// hold_out = [3, 7]
Key<DaemonConfig> hold_out() {
  Key<DaemonConfig> key{
      "hold_out",
      "a list of whole numbers from 0 to 63",
      "Views, counted from 0, that the reconstruction doesn't use; the result is scored on them.",
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
          "Turns a finished recording into a volume, in a separate process.",
          {text<C>("program", EMBERLOCK_AT(reconstruction.program), kPath,
                   "The `emberlock` to run; searched for in PATH unless it has a slash. If absent: the one "
                   "beside emberlockd, else the one in PATH.",
                   "\"emberlock\""),
           choice<C>("device", EMBERLOCK_AT(reconstruction.device),
                     {{"auto", "auto"}, {"cpu", "cpu"}, {"cuda", "cuda"}}, "What it computes on."),
           number<C>("budget_s", EMBERLOCK_AT(reconstruction.budget), {1, 86400},
                     "Time limit of a reconstruction; if absent, it stops by its own rules.", "60"),
           number<C>("voxels", EMBERLOCK_AT(reconstruction.voxels), {1, 1024},
                     "Voxels along the longest edge. If absent, the knee of time against error, measured on "
                     "this machine.",
                     "192"),
           hold_out(),
           number<C>("threads", EMBERLOCK_AT(reconstruction.threads), {0, 256},
                     "Threads on the CPU; 0: one per core."),
           number<C>("silence_s", EMBERLOCK_AT(reconstruction.silence), {1, 86400},
                     "A reconstruction that reports no progress for so long is ended as hung."),
           number<C>("niceness", EMBERLOCK_AT(reconstruction.niceness), {0, 19},
                     "Unix niceness of the process, so that cameras and recordings go first.")}};
}

Section<DaemonConfig> make_server_section() {
  using C = DaemonConfig;
  return {
      "server",
      "Who may reach the daemon, and how.",
      {text<C>(
           "socket", EMBERLOCK_AT(server.socket), kPath,
           "Unix socket of the API (gRPC). Every user who may enter its folder may use the API. If absent: "
           "/run/emberlock/emberlockd.sock for root and the service, emberlock/emberlockd.sock in "
           "$XDG_RUNTIME_DIR for other users. `emberlock` looks there too.",
           "\"/run/emberlock/emberlockd.sock\""),
       text<C>("listen", EMBERLOCK_AT(server.listen), kAddress,
               "Address of the API over TCP; needs tls_certificate, tls_key and token_file. Off if empty.",
               "\"0.0.0.0:7141\""),
       text<C>("http_listen", EMBERLOCK_AT(server.http_listen), kAddress,
               "Address of the console and the JSON API. Browsers sign in with the link that `emberlock "
               "console` prints, programs with the token. An address other than localhost needs "
               "tls_certificate, tls_key and token_file. Off if empty."),
       text<C>("tls_certificate", EMBERLOCK_AT(server.tls_certificate), kPath,
               "Certificate of listen and http_listen: PEM, with its chain.", "\"server.crt\""),
       text<C>("tls_key", EMBERLOCK_AT(server.tls_key), kPath,
               "Private key of tls_certificate: PEM. Other users must not be able to read it, its group must "
               "not be able to write to it.",
               "\"server.key\""),
       text<C>("tls_clients", EMBERLOCK_AT(server.tls_clients), kPath,
               "PEM of the authority that signs clients' certificates. If set, each TLS client must have a "
               "certificate, browsers too.",
               "\"clients.crt\""),
       text<C>(
           "token_file", EMBERLOCK_AT(server.token_file), kPath,
           "File that holds the token and nothing else. Clients send the token, by HTTP on this machine too. "
           "Other users must not be able to read the file, its group must not be able to write to it.",
           "\"token\""),
       text<C>(
           "console", EMBERLOCK_AT(server.console), kPath,
           "Folder of the console's files; share/emberlock/console beside the program's folder if absent.",
           "\"console\""),
       number<C>("viewers", EMBERLOCK_AT(server.viewers), {1, 1000},
                 "Most consoles that watch at a time. When one more comes, the client with most of them "
                 "loses one."),
       number<C>("picture_width", EMBERLOCK_AT(server.picture_width), {32, 4096},
                 "Largest width of live pictures, in pixels."),
       number<C>("picture_rate_hz", EMBERLOCK_AT(server.picture_rate), {0.1, 60},
                 "Most live pictures per second of each camera."),
       number<C>("picture_quality", EMBERLOCK_AT(server.picture_quality), {1, 100},
                 "JPEG quality of live pictures."),
       number<C>("message_mib", EMBERLOCK_AT(server.message_bytes), {1, 64, kMebi},
                 "Largest request of a client.")}};
}

Section<DaemonConfig> make_hosts_section() {
  using C = DaemonConfig;
  return {
      "hosts",
      "Cameras of several hosts as one rig: one emberlockd a host, one of which leads and has the others' "
      "cameras in its rig, by driver \"remote\". Hosts show each other certificates.",
      {text<C>("listen", EMBERLOCK_AT(hosts.listen), kAddress,
               "Address at which a leading host may borrow this one's cameras, all of them. Off if empty.",
               "\"0.0.0.0:7143\""),
       text<C>("certificate", EMBERLOCK_AT(hosts.certificate), kPath,
               "This host's certificate: PEM, with its chain. Its subjectAltName is the name or address "
               "by which the leading host calls it.",
               "\"host.crt\""),
       text<C>("key", EMBERLOCK_AT(hosts.key), kPath,
               "Private key of certificate: PEM. Other users must not be able to read it, its group must "
               "not be able to write to it.",
               "\"host.key\""),
       text<C>("authority", EMBERLOCK_AT(hosts.authority), kPath,
               "PEM of the authority that signs the hosts' certificates.", "\"hosts.crt\""),
       number<C>("alone_s", EMBERLOCK_AT(hosts.alone), {1, 86400},
                 "How long a recording that this host leads goes on at another one that hears nothing "
                 "from this one any more.")}};
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
                     "Lowest level that is written; EMBERLOCK_LOG overrides it."),
           choice<C>("format", EMBERLOCK_AT(log.format), {{"text", Format::text}, {"json", Format::json}},
                     "\"text\" for people, \"json\" for programs: one object per line.")}};
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
    list.push_back(make_hosts_section());
    list.push_back(make_log_section());
    return list;
  }();
  return all;
}

}  // namespace emberlock::rig::config
