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

// CHDK, the firmware add-on of Canon's compact cameras, as spoken over PTP: one operation, 0x9999, whose
// first parameter says which command (CHDK, core/ptp.h). Other makers list 0x9999 too, for something else:
// nothing here may be asked of a device whose USB vendor isn't Canon.
namespace emberlock::drivers {

inline constexpr std::uint16_t kCanonUsbVendor = 0x04a9;
inline constexpr std::uint16_t kChdkOperation = 0x9999;

struct ChdkVersion {
  std::uint32_t major = 0;
  std::uint32_t minor = 0;
};

enum class ChdkMessageType : std::uint8_t { none = 0, error = 1, returned = 2, user = 3 };

/// What a script handed over: nil, a boolean, a number, or text (a table comes as text).
using ChdkValue = std::variant<std::monostate, bool, std::int32_t, std::string>;

struct ChdkMessage {
  ChdkMessageType type = ChdkMessageType::none;
  std::uint32_t script = 0;  ///< which one sent it
  ChdkValue value = {};      ///< of an error: its text
};

/// Of an answer to ReadScriptMsg. Error: it doesn't hold what it says.
Result<ChdkMessage> parse_chdk_message(const PtpAnswer& answer);

struct ChdkScriptStatus {
  bool running = false;
  bool message_waits = false;
};

enum class ChdkMode { play, record };
/// As get_movie_status() counts.
enum class ChdkMovie : std::int32_t { stopped = 0, paused = 1, recording = 4, saving = 5 };

/// The commands, on a session that outlives it. Errors are the session's; and `device` with a script's own
/// words when it fails.
class Chdk {
 public:
  explicit Chdk(PtpSession& session) : session_(&session) {}

  Result<ChdkVersion> version();
  /// Starts a script in Lua, ending one that runs; gives its number. Error: it doesn't compile.
  Result<std::uint32_t> start_script(std::string_view lua);
  Result<ChdkScriptStatus> script_status();
  Result<ChdkMessage> read_message();
  /// To the script that runs. Error bad_input: an empty text, which would hang the camera; device: no script
  /// takes it.
  Status write_message(std::string_view text);
  /// Runs a script to its end; gives what it returns. Error timed_out: it goes on running.
  Result<std::vector<ChdkValue>> run(std::string_view lua, Seconds deadline = kPtpDeadline);

  /// Asks for the live view; session.finish() gives what parse_live_view() takes.
  Status ask_for_live_view();

  Result<ChdkMode> mode();
  /// Begins a change of mode, which takes a second or more: mode() tells when it's done.
  Status change_mode(ChdkMode to);
  Result<ChdkMovie> movie();
  /// Presses the button that starts a movie, or ends it; movie() tells what it does.
  Status press_movie_button();

 private:
  Result<PtpAnswer> ask(std::uint32_t command, std::uint32_t parameter = 0,
                        std::span<const std::byte> data = {});
  [[nodiscard]] Error silent(std::string_view about) const;
  Result<std::string> error_of(std::uint32_t script);

  PtpSession* session_;
};

}  // namespace emberlock::drivers
