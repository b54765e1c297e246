// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/ptp/session.h"

// CHDK, the firmware add-on of Canon's compact cameras, over PTP. It has one operation, 0x9999, whose first
// parameter is the command (CHDK, core/ptp.h). Other makers use 0x9999 for other purposes, so send it only to
// devices with Canon's USB vendor id.
namespace emberlock::drivers {

inline constexpr std::uint16_t kCanonUsbVendor = 0x04a9;
inline constexpr std::uint16_t kChdkOperation = 0x9999;

struct ChdkVersion {
  std::uint32_t major = 0;
  std::uint32_t minor = 0;
};

enum class ChdkMessageType : std::uint8_t { none = 0, error = 1, returned = 2, user = 3 };

/// A value that a script sent: nil, a boolean, a number, or text (tables are sent as text).
using ChdkValue = std::variant<std::monostate, bool, std::int32_t, std::string>;

struct ChdkMessage {
  ChdkMessageType type = ChdkMessageType::none;
  std::uint32_t script = 0;  ///< the sending script
  ChdkValue value = {};      ///< for an error, its text
};

/// Parses an answer to ReadScriptMsg. Error: its lengths or types are inconsistent.
Result<ChdkMessage> parse_chdk_message(const PtpAnswer& answer);

struct ChdkScriptStatus {
  bool running = false;
  bool message_waits = false;
};

enum class ChdkMode { play, record };
/// The values of get_movie_status().
enum class ChdkMovie : std::int32_t { stopped = 0, paused = 1, recording = 4, saving = 5 };

/// CHDK's commands, on a session that must outlive this object. Errors: those of the session; `device` with
/// the script's error text when a script fails.
class Chdk {
 public:
  explicit Chdk(PtpSession& session) : session_(&session) {}

  Result<ChdkVersion> version();
  /// Starts a Lua script and ends a running one. Returns its number. Error: it doesn't compile.
  Result<std::uint32_t> start_script(std::string_view lua);
  Result<ChdkScriptStatus> script_status();
  Result<ChdkMessage> read_message();
  /// Sends a text to the running script. Error bad_input: an empty text, which would hang the camera; device:
  /// no script accepts it.
  Status write_message(std::string_view text);
  /// Runs a script to its end and returns its results. Error timed_out: the script is still running.
  Result<std::vector<ChdkValue>> run(std::string_view lua, Seconds deadline = kPtpDeadline);

  /// Requests a picture of the live view; session.finish() returns the data for parse_live_view().
  Status ask_for_live_view();

  Result<ChdkMode> mode();
  /// Starts a change of mode, which takes a second or more; mode() tells when it is done.
  Status change_mode(ChdkMode to);
  Result<ChdkMovie> movie();
  /// Presses the button that starts or stops a movie; movie() tells the state.
  Status press_movie_button();

 private:
  Result<PtpAnswer> ask(std::uint32_t command, std::uint32_t parameter = 0,
                        std::span<const std::byte> data = {});
  [[nodiscard]] Error silent(std::string_view about) const;
  Result<std::string> error_of(std::uint32_t script);

  PtpSession* session_;
};

}  // namespace emberlock::drivers
