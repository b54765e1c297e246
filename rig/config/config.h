// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/sensor_kind.h"
#include "base/strobe_dial.h"
#include "drivers/driver.h"
#include "drivers/strobe_serial/strobe_serial.h"
#include "drivers/virtual/options.h"
#include "rig/align/run.h"
#include "session/async_writer.h"
#include "session/writer.h"
#include "smear_sync/ccd_timing.h"

// What emberlockd is told by its configuration file (TOML). Each key stands in one table (table*.cpp), with
// its unit, range and words; reading, errors, the commented file and the manual page come from there, the
// defaults from the structs here. Where another header has the options already, the key sets them directly.
namespace emberlock::rig {

enum class CameraSource { virtual_, v4l2, aravis, ptp, replay };

/// [[rig.camera]]: one camera, or several alike.
struct CameraConfig {
  CameraSource source = CameraSource::virtual_;
  /// Of a real camera as `emberlock devices` names it, never empty; of a recorded one as its session names
  /// it, empty: all of the session; of virtual ones what their ids begin with (`count` > 1) or the id itself.
  std::string id;
  int count = 1;  ///< virtual alone
  drivers::CameraRequest
      request{};  ///< virtual cameras know size, format, frame rate and exposure; replayed ones nothing
  std::optional<SensorKind> sensor{};       ///< else the driver's word, of virtual ones ccd
  std::optional<ShutterReset> reset{};      ///< else the driver's word
  std::optional<int> rows{}, shifts{};      ///< as CcdTiming; else the picture's height, and as many shifts
  std::optional<SecondsPerRow> row_time{};  ///< where it isn't measured
  smear::ReadDirection direction = smear::ReadDirection::top_first;
};

/// [rig.virtual]: what all virtual cameras and their strobe share.
struct VirtualConfig {
  enum class Time {
    real,  ///< as real cameras film; the only one that mixes with them
    fast,  ///< the rig's clock runs as fast as pictures are drawn
  };
  enum class Scene { dark_room, lit_room, flame };
  Time time = Time::real;
  Scene scene = Scene::dark_room;
  drivers::VirtualRigDraw draw{};  ///< but for cameras, sensors, layout and rate: those are the cameras'
};

enum class StrobeSource {
  none,
  virtual_,
  serial,
  replay,
  manual,  ///< somebody sets it by its dial
};

/// [rig.strobe]
struct StrobeConfig {
  StrobeSource source = StrobeSource::none;
  std::string id;     ///< of a serial port as `emberlock devices` names it, never empty
  StrobeDial dial{};  ///< of a manual one
  drivers::SerialStrobeRequest request{};
};

struct RigConfig {
  std::string name = "rig";
  /// A transforms.json with the cameras' poses, lenses and the box, each frame named by its camera's id
  /// ("VIRTUAL-00.png"); empty: recordings carry no calibration.
  std::filesystem::path calibration;
  std::vector<CameraConfig> cameras;
  VirtualConfig virtual_rig{};
  std::filesystem::path replay_session;  ///< [rig.replay]: of cameras and strobe that are replayed
  StrobeConfig strobe{};
};

struct AlignmentConfig {
  enum class AtStart { nothing, align };
  AtStart at_start = AtStart::nothing;
  AlignRunOptions run = [] {
    AlignRunOptions options;
    options.align.limits = smear::AlignLimits{};
    options.hold = kUntilStopped;
    return options;
  }();                           ///< but for timing, delays and the reference, which the rig's cameras tell
  std::string reference;         ///< of policy fixed-reference: a camera's id; empty: the first
  std::filesystem::path delays;  ///< what is known of reset delays, kept between runs; empty: nowhere
};

struct RecordingConfig {
  enum class Transcode { never, when_idle };
  std::filesystem::path folder = "/var/lib/emberlock/sessions";
  session::WriterOptions writer{};
  session::AsyncWriterOptions queue{};
  Transcode transcode = Transcode::when_idle;  ///< of raw spools, to FFV1, verified
};

struct ReconstructionConfig {
  std::filesystem::path program = "emberlock";  ///< searched for in PATH unless it has a slash
  std::string device = "auto";                  ///< auto, cpu or cuda
  std::optional<Seconds> budget{};              ///< else by the reconstruction's own rules
  std::optional<int> voxels{};                  ///< along the longest edge; else likewise
  std::vector<int> hold_out{};                  ///< views kept for judging the result, counted from 0
  int threads = 0;                              ///< 0: every core
  Seconds silence{600};                         ///< without a word of progress: it hangs, and is ended
  int niceness = 10;
};

struct ServerConfig {
  std::filesystem::path socket = "/run/emberlock/emberlockd.sock";  ///< gRPC
  std::string listen;  ///< gRPC over TLS, "host:port"; empty: nowhere. Needs certificate, key and token
  std::string http_listen =
      "127.0.0.1:7140";  ///< console and JSON API; empty: nowhere. Beyond localhost as `listen`
  std::filesystem::path tls_certificate, tls_key;  ///< PEM
  std::filesystem::path
      tls_clients;  ///< PEM of the authority that signs clients' certificates; empty: none asked for
  std::filesystem::path token_file;  ///< holds the token and nothing else
  std::filesystem::path console;  ///< the console's files; empty: load_config finds them beside the program
  int viewers = 64;               ///< at most so many WebSockets; one more displaces one
  int picture_width = 480;        ///< pixels, at most
  Hertz picture_rate{12};         ///< of a camera, at most
  int picture_quality = 75;       ///< JPEG's, 1..100
  std::uint64_t message_bytes = std::uint64_t{4} << 20;  ///< a client's request, at most
};

struct LogConfig {
  enum class Format { text, json };
  std::string level = "info";
  Format format = Format::text;
};

struct DaemonConfig {
  RigConfig rig{};
  AlignmentConfig alignment{};
  RecordingConfig recording{};
  ReconstructionConfig reconstruction{};
  ServerConfig server{};
  LogConfig log{};
};

/// What a text says, and everything that is wrong with it: each problem's `where` is "file:line:column". The
/// config is usable only without problems.
struct ConfigReading {
  DaemonConfig config;
  std::vector<Error> problems;
};
/// `file` is the text's path: it is named in problems, and relative paths start from its folder. Touches no
/// disk.
ConfigReading read_config(std::string_view toml, const std::filesystem::path& file);

/// The same; the error is the first problem.
Result<DaemonConfig> parse_config(std::string_view toml, const std::filesystem::path& file);
/// Reads the file, too.
Result<DaemonConfig> load_config(const std::filesystem::path& file);

/// A configuration file with every key, its words, unit, range and default, commented out but for a simulated
/// rig: a file to begin with.
std::string commented_config();
/// The configuration as TOML, every key that has a value.
std::string print_config(const DaemonConfig& config);

}  // namespace emberlock::rig
