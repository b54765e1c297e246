#include <cstdio>

#include "daemon/config/keys.h"
#include "smear_sync/align/align.h"

// Every key of the configuration.
namespace emberlock::config {
namespace {

// NOLINTBEGIN(bugprone-macro-parentheses): a member can't stand in parentheses.
#define EMBERLOCK_AT(member) \
  [](auto& c) -> auto& { return c.member; }
// NOLINTEND(bugprone-macro-parentheses)

constexpr double kMilli = 1e-3;
constexpr double kMicro = 1e-6;
constexpr double kMebi = 1 << 20;

const char* const kPath = "a path";
const char* const kAddress = "HOST:PORT, or empty";

std::optional<ImageSize> parse_size(const std::string& text) {
  ImageSize size;
  int used = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%n", &size.width, &size.height, &used) != 2 ||
      used != static_cast<int>(text.size()) || size.width < 1 || size.height < 1 || size.width > 16384 ||
      size.height > 16384) {
    return std::nullopt;
  }
  return size;
}
std::string print_size(ImageSize size) { return fmt::format("{}x{}", size.width, size.height); }

std::string print_tolerance(const Tolerance& tolerance) {
  if (const auto* rows = std::get_if<Rows>(&tolerance.amount))
    return fmt::format("{:.12g}rows", rows->value());
  return fmt::format("{:.12g}ms", in_milliseconds(std::get<Seconds>(tolerance.amount)));
}

/// From names and values as another header pairs them.
template <class M, class Names>
std::vector<std::pair<std::string_view, M>> named(std::initializer_list<M> values,
                                                  const Names& name_of_value) {
  std::vector<std::pair<std::string_view, M>> names;
  for (const M value : values) names.emplace_back(name_of_value(value), value);
  return names;
}

const std::vector<std::pair<std::string_view, CameraSource>> kSources{{"virtual", CameraSource::virtual_},
                                                                      {"v4l2", CameraSource::v4l2},
                                                                      {"aravis", CameraSource::aravis},
                                                                      {"ptp", CameraSource::ptp},
                                                                      {"replay", CameraSource::replay}};

/// The key, for cameras of these drivers alone.
Key<CameraConfig> of(std::vector<CameraSource> sources, Key<CameraConfig> key) {
  for (const auto& [word, source] : kSources) {
    if (std::find(sources.begin(), sources.end(), source) == sources.end()) continue;
    key.applies_words += (key.applies_words.empty() ? "of driver " : " or ") + in_quotes(word);
  }
  key.applies = [sources = std::move(sources)](const CameraConfig& camera) {
    return std::find(sources.begin(), sources.end(), camera.source) != sources.end();
  };
  return key;
}

/// controls = { Gain = "3" }: by the device's own names.
Key<CameraConfig> controls(std::string sentence) {
  Key<CameraConfig> key{
      "controls", "a table of texts, numbers, true and false", std::move(sentence), "{ Gain = 3 }", {}, {}};
  key.read = [](const toml::node& node, CameraConfig& camera) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return false;
    for (const auto& [name, value] : *table) {
      std::string text;
      if (const auto spelled_out = value.value<std::string>()) {
        text = *spelled_out;
      } else if (value.is_boolean()) {
        text = *value.value<bool>() ? "1" : "0";
      } else if (value.is_integer()) {
        text = fmt::format("{}", *value.value<std::int64_t>());
      } else if (value.is_floating_point()) {
        text = fmt::format("{}", *value.value<double>());
      } else {
        return false;
      }
      camera.request.controls[std::string(name.str())] = std::move(text);
    }
    return true;
  };
  key.write = [](const CameraConfig& camera) {
    std::string text;
    for (const auto& [name, value] : camera.request.controls)
      text += (text.empty() ? "{ " : ", ") + in_quotes(name) + " = " + in_quotes(value);
    return text.empty() ? text : text + " }";
  };
  return key;
}

Section<CameraConfig> make_camera_section() {
  using C = CameraConfig;
  using enum CameraSource;
  const std::vector<CameraSource> real{v4l2, aravis, ptp};
  const std::vector<CameraSource> filming{virtual_, v4l2, aravis, ptp};
  return {
      "rig.camera",
      "One block a camera, of any driver, as often as needed. `emberlock devices` lists what is plugged in.",
      {
          choice<C>(
              "driver", EMBERLOCK_AT(source), kSources,
              "How the camera is reached. \"virtual\" is simulated, \"v4l2\" is what Linux drives itself, "
              "\"aravis\" is GigE Vision and USB3 Vision, \"ptp\" is a Canon with CHDK, \"replay\" is a "
              "recorded "
              "camera. Must be said."),
          text<C>("id", EMBERLOCK_AT(id), "letters, digits, space and . _ : -",
                  "The camera, as `emberlock devices` names it. Of \"replay\" as in its session, all of the "
                  "session if "
                  "absent; of \"virtual\" a name, or with count > 1 what the names begin with, \"virtual\" "
                  "if absent.",
                  "\"virtual\""),
          of({virtual_}, number<C>("count", EMBERLOCK_AT(count), {1, 64}, "So many cameras alike.")),
          of(filming,
             spelled<C>("size", EMBERLOCK_AT(request.size), "WIDTHxHEIGHT, sides from 1 to 16384", parse_size,
                        print_size, "Of the pictures; the largest if absent, of \"virtual\" 1280x720.",
                        "\"1280x720\"")),
          of(filming,
             number<C>("rate_hz", EMBERLOCK_AT(request.frame_rate), {0.01, 10000},
                       "Frames a second; the fastest if absent, of \"virtual\" 23.976. All cameras of a rig "
                       "film at one rate.",
                       "23.976")),
          of(filming,
             choice<C>("format", EMBERLOCK_AT(request.format),
                       named<PixelFormat>({PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                           PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16},
                                          [](PixelFormat f) { return name(f); }),
                       "Of the pixels; what keeps most if absent, of \"virtual\" gray8.", "\"gray8\"")),
          of(filming, number<C>("exposure_ms", EMBERLOCK_AT(request.exposure), {0.001, 60000, kMilli},
                                "As the camera is set if absent, of \"virtual\" as the scene has it.", "4")),
          of(real,
             controls(
                 "Set before it films, by the camera's own names (`emberlock devices probe` tries them).")),
          of(filming,
             choice<C>(
                 "sensor", EMBERLOCK_AT(sensor),
                 {{"ccd", SensorKind::ccd},
                  {"rolling", SensorKind::rolling_shutter},
                  {"global", SensorKind::global_shutter}},
                 "What a flash leaves in its pictures: an interline CCD's dot, a rolling shutter's band, "
                 "or nothing but the frame. As the driver says if absent, of \"virtual\" ccd.",
                 "\"ccd\"")),
          of(filming,
             choice<C>("reset", EMBERLOCK_AT(reset),
                       {{"none", ShutterReset::none},
                        {"by-hand", ShutterReset::by_hand},
                        {"on-command", ShutterReset::on_command}},
                       "How its shutter phase is drawn anew: not at all, by an operator who presses the "
                       "button, or by the driver. As the driver says if absent.",
                       "\"by-hand\"")),
          number<C>("rows", EMBERLOCK_AT(rows), {1, 16384},
                    "Visible rows of its chip, from the data sheet; the picture's height if absent.", "720"),
          number<C>(
              "shifts", EMBERLOCK_AT(shifts), {1, 65536},
              "Row shifts of a read phase, hidden rows too, from the data sheet; as many as rows if absent.",
              "740"),
          number<C>("row_time_us", EMBERLOCK_AT(row_time), {0.1, 10000, kMicro},
                    "Time to shift one row, used where it isn't measured; 54 if absent.", "54"),
          choice<C>("direction", EMBERLOCK_AT(direction),
                    {{"top-first", ReadDirection::top_first}, {"bottom-first", ReadDirection::bottom_first}},
                    "Which displayed row leaves the chip first. The wrong one reverses every correction."),
      }};
}

std::vector<Section<DaemonConfig>> make_rig_sections() {
  using C = DaemonConfig;
  using Time = VirtualConfig::Time;
  using Scene = VirtualConfig::Scene;
  using Models = VirtualRigDraw::Models;
  return {
      {"rig",
       "What is filmed with. Cameras of all drivers mix freely in one rig.",
       {text<C>("name", EMBERLOCK_AT(rig.name), "text", "What the console calls it."),
        text<C>("calibration", EMBERLOCK_AT(rig.calibration), kPath,
                "A transforms.json with poses, lenses and the box; the frame CAMERA-ID.png is that camera's. "
                "Recordings "
                "carry it, and can be reconstructed. None if absent.",
                "\"transforms.json\"")}},
      {"rig.virtual",
       "What virtual cameras and their strobe share.",
       {choice<C>(
            "time", EMBERLOCK_AT(rig.virtual_rig.time), {{"real", Time::real}, {"fast", Time::fast}},
            "\"fast\" lets the rig's clock run as fast as pictures are drawn; not beside real devices."),
        choice<C>("scene", EMBERLOCK_AT(rig.virtual_rig.scene),
                  {{"dark-room", Scene::dark_room}, {"lit-room", Scene::lit_room}, {"flame", Scene::flame}},
                  "What they see beside the strobe. Shutters without smear see flashes in a lit room alone."),
        number<C>("seed", EMBERLOCK_AT(rig.virtual_rig.draw.seed), {0, 1e9},
                  "Of everything that is drawn by chance."),
        choice<C>("models", EMBERLOCK_AT(rig.virtual_rig.draw.models),
                  {{"same", Models::same}, {"mixed", Models::mixed}},
                  "Whether the cameras are of one model, or differ in direction and shifts."),
        number<C>("crystal_spread_ppm", EMBERLOCK_AT(rig.virtual_rig.draw.crystal_spread), {0, 1000},
                  "Each camera's clock is off by up to this."),
        number<C>("reset_latency_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_latency), {0, 10000, kMilli},
                  "From a reset to the new phase, mean over cameras."),
        number<C>("reset_jitter_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_jitter), {0, 1000, kMilli},
                  "RMS of that, of resets on command.")}},
      {"rig.replay",
       "A recorded session, for cameras and a strobe of driver \"replay\".",
       {text<C>("session", EMBERLOCK_AT(rig.replay_session), kPath, "The session's folder.", "\"session\"")}},
      {"rig.strobe",
       "The strobe, or the pulse generator that triggers it.",
       {choice<C>("driver", EMBERLOCK_AT(rig.strobe.source),
                  {{"none", StrobeSource::none},
                   {"virtual", StrobeSource::virtual_},
                   {"serial", StrobeSource::serial},
                   {"replay", StrobeSource::replay}},
                  "How it is reached. Without one nothing can be aligned."),
        text<C>("id", EMBERLOCK_AT(rig.strobe.id), "text",
                "Of the serial port, as `emberlock devices` names it.", "\"ttyUSB0\""),
        choice<C>(
            "dialect", EMBERLOCK_AT(rig.strobe.request.dialect),
            named<StrobeDialect>({StrobeDialect::emberlock, StrobeDialect::scpi, StrobeDialect::siglent_bswv,
                                  StrobeDialect::gardasoft_rt, StrobeDialect::schott_cv_ls},
                                 [](StrobeDialect d) { return name_of(d); }),
            "Its language on the serial line; `emberlock devices probe ID` finds it out."),
        number<C>("baud", EMBERLOCK_AT(rig.strobe.request.baud), {300, 4000000},
                  "The dialect's own if absent.", "115200"),
        number<C>("channel", EMBERLOCK_AT(rig.strobe.request.options.channel), {1, 8},
                  "Of a device with several outputs."),
        number<C>("brightness_percent", EMBERLOCK_AT(rig.strobe.request.options.brightness), {0.1, 100},
                  "Of controllers that set it (Gardasoft)."),
        choice<C>(
            "scpi_phase", EMBERLOCK_AT(rig.strobe.request.options.phase),
            {{"start", ScpiPhase::start}, {"delay", ScpiPhase::delay}},
            "What a generator means by PHASe: the angle where a period starts, or a delay (Agilent 81100)."),
        number<C>("watchdog_s", EMBERLOCK_AT(rig.strobe.request.options.watchdog), {0, 600},
                  "Our own controller goes dark when told nothing for so long; 0: never, else 0.1 at least."),
        number<C>("patience_s", EMBERLOCK_AT(rig.strobe.request.patience), {0.1, 60},
                  "For its first answer: opening the port may have reset it.")}},
  };
}

Section<DaemonConfig> make_alignment_section() {
  using C = DaemonConfig;
  using AtStart = AlignmentConfig::AtStart;
  const auto parse = [](const std::string& given) -> std::optional<Tolerance> {
    const auto tolerance = parse_tolerance(given);
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
           named<AlignPolicy>(
               {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed, AlignPolicy::trimmed},
               [](AlignPolicy p) { return name(p); }),
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
                 "With which these limits must suffice."),
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
  return {"recording",
          "Where recordings go, and how.",
          {text<C>("folder", EMBERLOCK_AT(recording.folder), kPath, "Each session gets a folder in it."),
           choice<C>("encoding", EMBERLOCK_AT(recording.writer.encoding),
                     {{"ffv1", Encoding::ffv1}, {"raw", Encoding::raw_nut}},
                     "Both are lossless: \"ffv1\" takes processor time, about 77 MB/s a thread, \"raw\" "
                     "twice the disk."),
           choice<C>("transcode", EMBERLOCK_AT(recording.transcode),
                     {{"never", Transcode::never}, {"when-idle", Transcode::when_idle}},
                     "Turns raw recordings into FFV1 while nothing is recorded, and verifies them."),
           number<C>("free_space_floor_mib", EMBERLOCK_AT(recording.writer.min_free_bytes), {0, 1e9, kMebi},
                     "Below so much free disk frames are refused, so that the disk never fills up."),
           number<C>("queue_frames", EMBERLOCK_AT(recording.queue.queue_frames), {1, 4096},
                     "That a camera may keep waiting in memory for encoder and disk."),
           number<C>("frames_per_segment", EMBERLOCK_AT(recording.writer.frames_per_segment), {1, 1e9},
                     "A file is closed after so many,"),
           number<C>("segment_mib", EMBERLOCK_AT(recording.writer.bytes_per_segment), {1, 1e6, kMebi},
                     "or once it has grown to this.")}};
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
           number<C>("voxels", EMBERLOCK_AT(reconstruction.voxels), {1, 1024},
                     "Along the longest edge; two for three pixels if absent, at most 256.", "192"),
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
           "The console and the JSON API; beyond localhost over TLS: it needs tls_certificate, tls_key and "
           "token_file then. Nowhere if empty."),
       text<C>("tls_certificate", EMBERLOCK_AT(server.tls_certificate), kPath,
               "Of listen and http_listen. PEM, with its chain.", "\"server.crt\""),
       text<C>("tls_key", EMBERLOCK_AT(server.tls_key), kPath, "PEM; nobody else may read it.",
               "\"server.key\""),
       text<C>("tls_clients", EMBERLOCK_AT(server.tls_clients), kPath,
               "PEM of the authority that signs clients' certificates: with it each client that comes by TLS "
               "must have one, browsers too.",
               "\"clients.crt\""),
       text<C>("token_file", EMBERLOCK_AT(server.token_file), kPath,
               "Its first line is the token that clients show; nobody else may read it.", "\"token\""),
       text<C>("console", EMBERLOCK_AT(server.console), kPath,
               "The folder of the console's files; share/emberlock/console beside the program's folder if "
               "absent.",
               "\"console\""),
       number<C>("viewers", EMBERLOCK_AT(server.viewers), {1, 1000}, "Consoles that may watch at a time."),
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

#undef EMBERLOCK_AT

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

const Section<CameraConfig>& camera_section() {
  static const Section<CameraConfig> section = make_camera_section();
  return section;
}

const std::vector<Section<DaemonConfig>>& sections() {
  static const std::vector<Section<DaemonConfig>> all = [] {
    std::vector<Section<DaemonConfig>> list = make_rig_sections();
    list.push_back(make_alignment_section());
    list.push_back(make_recording_section());
    list.push_back(make_reconstruction_section());
    list.push_back(make_server_section());
    list.push_back(make_log_section());
    return list;
  }();
  return all;
}

}  // namespace emberlock::config
