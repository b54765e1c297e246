// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/daemon_folders.h"
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

// emberlockd's configuration file (TOML). Each key is defined in a table (table*.cpp) with its unit, range
// and description; reading, errors, the commented file and the manual page use these tables. Defaults are in
// the structs here. Where another header already has the options, the key sets them directly.
namespace emberlock::rig {

enum class CameraSource { virtual_, v4l2, aravis, ptp, replay, remote };

/// [[rig.camera]]: one camera, or several of the same kind.
struct CameraConfig {
  CameraSource source = CameraSource::virtual_;
  /// Real camera: its id as listed by `emberlock devices`, never empty. Another host's: its id there, never
  /// empty. Recorded camera: its id in the
  /// session; empty: all cameras of the session. Virtual cameras: the id, or the prefix of the ids if `count`
  /// > 1.
  std::string id;
  std::string host{};  ///< of a remote camera: HOST:PORT of the emberlockd that lends it
  int count = 1;       ///< virtual cameras only
  drivers::CameraRequest
      request{};  ///< virtual cameras use size, format, frame rate and exposure; replayed ones nothing
  std::optional<SensorKind> sensor{};       ///< default: by the driver; ccd for virtual cameras
  std::optional<ShutterReset> reset{};      ///< default: by the driver
  std::optional<int> rows{}, shifts{};      ///< see CcdTiming; default: the picture's height for both
  std::optional<SecondsPerRow> row_time{};  ///< if it isn't measured
  smear::ReadDirection direction = smear::ReadDirection::top_first;
};

/// [rig.virtual]: common to all virtual cameras and their strobe.
struct VirtualConfig {
  enum class Time {
    real,  ///< at the speed of real cameras; required if the rig also has real cameras
    fast,  ///< the rig's clock runs as fast as pictures are drawn
  };
  enum class Scene { dark_room, lit_room, flame };
  Time time = Time::real;
  Scene scene = Scene::dark_room;
  std::filesystem::path light;  ///< shared by several daemons (drivers/virtual/shared_light.h); empty: none
  drivers::VirtualRigDraw
      draw{};  ///< except cameras, sensors, layout and rate, which are in the cameras' sections
};

enum class StrobeSource {
  none,
  virtual_,
  serial,
  replay,
  manual,  ///< set by hand on its dial
};

/// [rig.strobe]
struct StrobeConfig {
  StrobeSource source = StrobeSource::none;
  std::string id;     ///< id of a serial port as listed by `emberlock devices`, never empty
  StrobeDial dial{};  ///< of a manual strobe
  drivers::SerialStrobeRequest request{};
};

struct RigConfig {
  std::string name = "rig";
  /// A transforms.json with the cameras' poses, lenses and the box; each frame is named by its camera's id
  /// ("VIRTUAL-00.png"). Empty: recordings contain no calibration.
  std::filesystem::path calibration;
  std::vector<CameraConfig> cameras;
  VirtualConfig virtual_rig{};
  std::filesystem::path replay_session;  ///< [rig.replay]: the session of replayed cameras and strobe
  StrobeConfig strobe{};
};

struct AlignmentConfig {
  enum class AtStart { nothing, align };
  AtStart at_start = AtStart::nothing;
  bool stagger = false;                         ///< each camera at its own instant (rig/align/stagger.h)
  std::optional<smear::Tolerance> tolerance{};  ///< default: as the flame needs it
  smear::FlameMotion flame{};
  /// Except timing, delays and the reference, which come from the rig's cameras, and the tolerance.
  AlignRunOptions run = [] {
    AlignRunOptions options;
    options.align.policy = smear::AlignPolicy::timed;
    options.align.limits = smear::AlignLimits{};
    options.align.shortest_take = Seconds(10);
    options.hold = kUntilStopped;
    return options;
  }();
  std::string reference;         ///< for policy fixed-reference: a camera's id; empty: the first camera
  std::filesystem::path delays;  ///< file for learnt reset delays, kept between runs; empty: none
};

struct RecordingConfig {
  enum class Transcode { never, when_idle };
  std::filesystem::path folder;  ///< of all sessions; empty: fill_in() names one
  session::WriterOptions writer{};
  session::AsyncWriterOptions queue{};
  Transcode transcode = Transcode::when_idle;  ///< conversion of uncompressed recordings to FFV1, verified
};

struct ReconstructionConfig {
  std::filesystem::path program;  ///< searched in PATH unless it contains a slash; empty: fill_in() names it
  std::string device = "auto";    ///< auto, cpu or cuda
  std::optional<Seconds> budget{};  ///< default: the reconstruction's own rules
  std::optional<int> voxels{};      ///< along the longest edge; default: the reconstruction's own rules
  std::vector<int> hold_out{};      ///< views held out to assess the result, counted from 0
  int threads = 0;                  ///< 0: all cores
  Seconds silence{600};             ///< a reconstruction without progress for this long is killed
  int niceness = 10;
};

struct ServerConfig {
  std::filesystem::path socket;  ///< gRPC; empty: fill_in() names one
  std::string listen;  ///< gRPC over TLS, "host:port"; empty: disabled. Requires certificate, key and token
  std::string http_listen = "127.0.0.1:7140";  ///< console and JSON API; empty: disabled. For addresses other
                                               ///< than localhost, the same requirements as `listen`
  std::filesystem::path tls_certificate, tls_key;  ///< PEM
  std::filesystem::path
      tls_clients;  ///< PEM of the authority that signs clients' certificates; empty: not required
  std::filesystem::path token_file;  ///< contains only the token
  std::filesystem::path console;     ///< folder of the console's files; empty: fill_in() names it
  int viewers = 64;                  ///< maximum number of WebSockets; a further one replaces one of them
  int picture_width = 480;           ///< maximum, in pixels
  Hertz picture_rate{12};            ///< maximum per camera
  int picture_quality = 75;          ///< JPEG quality, 1..100
  std::uint64_t message_bytes = std::uint64_t{4} << 20;  ///< maximum size of a client's request
};

/// [hosts]: cameras of several hosts as one rig. All of them show certificates to each other, so one identity
/// serves for lending and for leading.
struct HostsConfig {
  std::string listen;  ///< where this host's cameras are lent, "host:port"; empty: they aren't
  std::filesystem::path certificate, key;  ///< PEM, of this host
  std::filesystem::path authority;         ///< PEM, of who signs all hosts' certificates
  /// How long a recording for another host goes on when nothing is heard from that one.
  Seconds alone{600};
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
  HostsConfig hosts{};
  LogConfig log{};
};

/// The configuration in a text, and all its problems; each problem's `where` is "file:line:column". Use the
/// config only if there are no problems.
struct ConfigReading {
  DaemonConfig config;
  std::vector<Error> problems;
};
/// `file` is the path of the text: problems name it, and relative paths start from its folder. Doesn't access
/// the disk.
ConfigReading read_config(std::string_view toml, const std::filesystem::path& file);

/// The same, with the first problem as the error.
Result<DaemonConfig> parse_config(std::string_view toml, const std::filesystem::path& file);
/// Names what the file leaves to the machine: socket and recordings in `folders`, and beside `program`
/// (PREFIX/bin/x or PREFIX/sbin/x) the console's files and the `emberlock` of reconstructions, which is
/// searched for in PATH if it isn't there.
void fill_in(DaemonConfig& config, const DaemonFolders& folders, const std::filesystem::path& program);
/// Reads the file, parses it and fills it in for this process.
Result<DaemonConfig> load_config(const std::filesystem::path& file);

/// A configuration file with every key, its description, unit, range and default, commented out except for a
/// simulated rig: a template.
std::string commented_config();
/// The configuration as TOML, with every key that has a value.
std::string print_config(const DaemonConfig& config);

}  // namespace emberlock::rig
