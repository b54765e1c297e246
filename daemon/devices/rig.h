#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/frame.h"
#include "base/result.h"
#include "daemon/align/run.h"
#include "daemon/config/config.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "emberlock/v1/session.pb.h"
#include "emberlock/v1/status.pb.h"
#include "session/writer.h"
#include "smear_sync/ccd_timing.h"

namespace emberlock {

/// Sees every frame, on its camera's thread: it must return at once.
using CameraTap = std::function<void(const CameraInfo&, const Frame&)>;

/// How cameras get on with the clock.
enum class Pace {
  by_itself,   ///< they film in real time, each on a thread of its own
  when_asked,  ///< a clock that passes only while somebody waits for a frame: simulations and replays, one
               ///< thread, the same each time
};

/// A camera of the rig, and what is known of it beside what it says itself.
struct RigCamera {
  std::shared_ptr<Camera> camera;
  std::string driver;
  CcdTiming timing;  ///< a data sheet's: n, K, d
  std::optional<v1::Calibration> calibration = {};
};

struct RigParts {
  std::vector<RigCamera> cameras;
  std::shared_ptr<Strobe> strobe;  ///< null: none
  std::shared_ptr<Clock> clock;
  Pace pace = Pace::by_itself;
  std::optional<v1::Box> box = {};      ///< the flame's
  std::function<void(bool)> burn = {};  ///< of simulations: lights the flame, and puts it out
};

/// The configured cameras and strobe, opened, in the order of the configuration. What a camera says of itself
/// stands back behind what the configuration says of it.
class Rig {
 public:
  /// Errors: bad_input (what can't be opened as it is configured), and the devices'.
  static Result<std::unique_ptr<Rig>> open(const RigConfig& config, CameraTap tap = {});
  /// Of parts: cameras that film by themselves are put on threads here.
  explicit Rig(RigParts parts, const CameraTap& tap = {});

  [[nodiscard]] const AlignRig& devices() const { return devices_; }
  [[nodiscard]] Clock& clock() const { return *parts_.clock; }
  [[nodiscard]] bool films_by_itself() const { return parts_.pace == Pace::by_itself; }
  [[nodiscard]] std::vector<std::string> camera_ids() const;
  [[nodiscard]] const std::string& driver(std::size_t camera) const { return parts_.cameras[camera].driver; }
  [[nodiscard]] std::vector<v1::CameraStatus::State> camera_states() const;
  [[nodiscard]] std::vector<CcdTiming> timing() const;
  /// Of a recording: cameras with their calibrations, and the box.
  void describe(v1::Manifest& manifest) const;
  /// What a recording of all cameras writes at most.
  [[nodiscard]] double bytes_per_second(Encoding encoding) const;
  /// Of simulations: the flame burns while something is recorded.
  void burn(bool lit) const {
    if (parts_.burn) parts_.burn(lit);
  }

 private:
  RigParts parts_;
  AlignRig devices_;
};

}  // namespace emberlock
