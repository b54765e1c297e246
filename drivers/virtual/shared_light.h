// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "base/unique_fd.h"
#include "drivers/strobe.h"
#include "drivers/virtual/strobe_timeline.h"

// A file through which the virtual strobe of one process lights the virtual cameras of others on the machine.
// Text:
//
//     emberlock-light 1 PPM                        the format's version, and the error of the strobe's rate
//     NS off|flashing|steady RATE PHASE WIDTH CODE     a setting: when it takes effect, Hz, s, s, and of each
//                                                      flash of the code 0 or 1; "-" without a code
//
// NS is on the wall clock, because monotonic clocks differ between time namespaces. Each process measures
// once, when it opens the file, how far its own clock is from that: a wall clock that is set later changes
// nothing, but one that is set between the opening of two processes keeps them apart.
namespace emberlock::drivers {

/// A setting of the shared strobe.
struct LightSetting {
  TimePoint at;  ///< wall clock
  StrobeSettings settings;
  friend bool operator==(const LightSetting&, const LightSetting&) = default;
};

/// Lines of the file, with their ends.
std::string first_light_line(PartsPerMillion rate_error);
std::string light_line(const LightSetting& setting);

/// The text of such a file, read while it grows.
class LightText {
 public:
  /// `where`: the file, for errors.
  explicit LightText(std::string where) : where_(std::move(where)) {}

  /// Takes the bytes that follow; returns the settings whose lines they complete. Error bad_input: not such a
  /// file, an unknown version, a number out of range, or instants that go backwards. Call it no more then.
  Result<std::vector<LightSetting>> take(std::string_view bytes);
  /// nullopt until the first line is whole.
  [[nodiscard]] std::optional<PartsPerMillion> rate_error() const { return rate_error_; }

 private:
  [[nodiscard]] Error refuse(std::string what, std::string remedy) const;
  [[nodiscard]] Result<PartsPerMillion> read_first(std::string_view line) const;
  [[nodiscard]] Result<LightSetting> read_setting(std::string_view line) const;

  std::string where_;
  std::string pending_;  // a line's beginning
  int line_ = 0;
  std::optional<PartsPerMillion> rate_error_;
  TimePoint last_;
};

/// The leader's end. Not thread-safe.
class LightWriter {
 public:
  /// Replaces the file. Errors: bad_input if there is something else than a file of this kind, io.
  static Result<std::unique_ptr<LightWriter>> create(std::filesystem::path file, PartsPerMillion rate_error,
                                                     std::shared_ptr<Clock> clock);
  /// Writes the setting, and returns when it takes effect on the rig's clock: late enough that the others
  /// know before they draw a frame that it lights. Error io.
  Result<TimePoint> announce(const StrobeSettings& settings);

 private:
  LightWriter(std::filesystem::path file, std::shared_ptr<Clock> clock);
  [[nodiscard]] Error failed(const char* what) const;
  Status write(const std::string& line);

  std::filesystem::path file_;
  std::shared_ptr<Clock> clock_;
  std::int64_t to_wall_ns_;
  UniqueFd fd_;
  std::int64_t size_ = 0;
};

/// A follower's end: keeps the timeline of a rig as the file says. While there is no file, or one that can't
/// be read, which it logs once, the timeline is dark. When a leader starts anew, so does the timeline.
/// Thread-safe.
class LightFollower {
 public:
  LightFollower(std::filesystem::path file, std::shared_ptr<Clock> clock,
                std::shared_ptr<StrobeTimeline> timeline);
  /// Applies what has been written since the last call.
  void look();

 private:
  [[nodiscard]] bool is_open_still() const;
  Status open();
  Status read_on();
  [[nodiscard]] Error failed(const char* what) const;

  std::filesystem::path file_;
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<StrobeTimeline> timeline_;
  std::mutex mutex_;
  UniqueFd fd_;
  std::int64_t to_wall_ns_ = 0;
  std::int64_t read_ = 0;
  LightText text_{""};
  bool refused_ = false;  // the file that is open
  std::string told_;      // the last error
};

}  // namespace emberlock::drivers
