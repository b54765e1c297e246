// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

// The byte formats of PTP: ISO 15740 and, for its transport over USB, PIMA 15740:2000 annex D. Everything is
// little-endian. Parsing accepts any bytes and returns a value, or an error that says which rule they break.
// Errors are of kind `device`, because a device sent the bytes.
namespace emberlock::drivers {

enum class PtpType : std::uint16_t { command = 1, data = 2, response = 3, event = 4 };

inline constexpr std::size_t kPtpHeaderBytes = 12;
inline constexpr std::size_t kPtpMostParams = 5;
/// The header's length when the sender doesn't know it. Sessions refuse such data, because a loss couldn't be
/// told from the end.
inline constexpr std::uint32_t kPtpLengthUnknown = 0xffffffff;

/// The header of every container.
struct PtpHeader {
  std::uint32_t length = 0;  ///< of the container in bytes, header included
  PtpType type = PtpType::command;
  std::uint16_t code = 0;  ///< of the operation, response or event
  std::uint32_t transaction = 0;
  friend bool operator==(const PtpHeader&, const PtpHeader&) = default;
};

/// A container without data: command, response or event.
struct PtpMessage {
  PtpType type = PtpType::command;
  std::uint16_t code = 0;
  std::uint32_t transaction = 0;
  std::vector<std::uint32_t> params = {};  ///< at most kPtpMostParams
  friend bool operator==(const PtpMessage&, const PtpMessage&) = default;
};

/// Parses the first kPtpHeaderBytes of `bytes`. Error: too few bytes, a length below the header's, an unknown
/// type.
Result<PtpHeader> parse_ptp_header(std::span<const std::byte> bytes);
/// Parses all of `bytes`. Error: also when the length differs, or a parameter is incomplete.
Result<PtpMessage> parse_ptp_message(std::span<const std::byte> bytes);

std::vector<std::byte> encode(const PtpHeader& header);
std::vector<std::byte> encode(const PtpMessage& message);

/// Reads a dataset from front to back. Reading beyond the end yields zeros or empty texts, and `check`
/// reports it.
class PtpReader {
 public:
  explicit PtpReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(little_endian(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(little_endian(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(little_endian(4)); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  void skip(std::size_t bytes);
  /// A PTP string: a count of 16-bit units including the closing NUL, then UTF-16. Returned as UTF-8 up to
  /// the first NUL. Unpaired surrogates become U+FFFD.
  std::string text();
  std::vector<std::uint16_t> u16_array();
  std::vector<std::uint32_t> u32_array();

  /// Error: `what` was shorter than what was read.
  [[nodiscard]] Status check(const std::string& what) const;

 private:
  std::uint64_t little_endian(std::size_t size);
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool overrun_ = false;
};

/// A device's DeviceInfo dataset (ISO 15740, 5.5.1), without the parts that aren't used here.
struct PtpDeviceInfo {
  std::uint32_t vendor_extension = 0;  ///< 0x0b is Canon
  std::vector<std::uint16_t> operations;
  std::string manufacturer;
  std::string model;
  std::string version;
  std::string serial;  ///< may be empty

  [[nodiscard]] bool has(std::uint16_t operation) const;
};
Result<PtpDeviceInfo> parse_ptp_device_info(std::span<const std::byte> bytes);

/// The ObjectInfo dataset of a file or folder on the card (ISO 15740, 5.5.2), likewise.
struct PtpObjectInfo {
  std::uint32_t storage = 0;
  std::uint16_t format = 0;  ///< 0x3001: folder, 0x300a: AVI, 0x300d: QuickTime
  std::uint32_t bytes = 0;   ///< 0xffffffff: 4 GiB or more
  std::uint32_t parent = 0;
  std::string name;
  std::string captured;  ///< as the camera reports it: "20261121T225747"
};
Result<PtpObjectInfo> parse_ptp_object_info(std::span<const std::byte> bytes);

/// Parses a dataset that is one list of numbers: storage ids, object handles.
Result<std::vector<std::uint32_t>> parse_ptp_u32_array(std::span<const std::byte> bytes);

/// A response code as text and number: "device busy (0x2019)".
std::string ptp_response_words(std::uint16_t code);
/// An operation's name: "GetDeviceInfo".
std::string ptp_operation_name(std::uint16_t code);

}  // namespace emberlock::drivers
