// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

// What travels over PTP, as bytes: ISO 15740 and, for how it is wrapped on USB, PIMA 15740:2000 annex D.
// Everything is little-endian. Whatever the bytes, parsing gives a value or the error that says where they
// break the rules; errors are of kind `device`, as it is a device that sent them.
namespace emberlock::drivers {

enum class PtpType : std::uint16_t { command = 1, data = 2, response = 3, event = 4 };

inline constexpr std::size_t kPtpHeaderBytes = 12;
inline constexpr std::size_t kPtpMostParams = 5;
/// A header's length when the sender doesn't know it. Sessions refuse such data: nothing would tell its end
/// from a loss.
inline constexpr std::uint32_t kPtpLengthUnknown = 0xffffffff;

/// What every container begins with.
struct PtpHeader {
  std::uint32_t length = 0;  ///< of the container, header included, in bytes
  PtpType type = PtpType::command;
  std::uint16_t code = 0;  ///< operation, response or event
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

/// Of the first kPtpHeaderBytes of `bytes`. Error: too few, a length below the header's, no such type.
Result<PtpHeader> parse_ptp_header(std::span<const std::byte> bytes);
/// Of all of `bytes`. Error: also when the length isn't theirs, or the parameters aren't whole.
Result<PtpMessage> parse_ptp_message(std::span<const std::byte> bytes);

std::vector<std::byte> encode(const PtpHeader& header);
std::vector<std::byte> encode(const PtpMessage& message);

/// Reads a dataset front to back. What lies beyond its end reads as zero or empty, and `check` tells.
class PtpReader {
 public:
  explicit PtpReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(little_endian(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(little_endian(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(little_endian(4)); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  void skip(std::size_t bytes);
  /// A count of 16-bit units, its closing NUL included, and UTF-16; given as UTF-8 up to the first NUL.
  /// Halves of surrogate pairs become U+FFFD.
  std::string text();
  std::vector<std::uint16_t> u16_array();
  std::vector<std::uint32_t> u32_array();

  /// Error: something was read beyond the end of `what`.
  [[nodiscard]] Status check(const std::string& what) const;

 private:
  std::uint64_t little_endian(std::size_t size);
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool overrun_ = false;
};

/// What a device says of itself (ISO 15740, 5.5.1), without what nothing here asks for.
struct PtpDeviceInfo {
  std::uint32_t vendor_extension = 0;  ///< 0x0b is Canon's
  std::vector<std::uint16_t> operations;
  std::string manufacturer;
  std::string model;
  std::string version;
  std::string serial;  ///< may be empty

  [[nodiscard]] bool has(std::uint16_t operation) const;
};
Result<PtpDeviceInfo> parse_ptp_device_info(std::span<const std::byte> bytes);

/// A file or folder on the card (ISO 15740, 5.5.2), likewise.
struct PtpObjectInfo {
  std::uint32_t storage = 0;
  std::uint16_t format = 0;  ///< 0x3001 is a folder, 0x300a AVI, 0x300d QuickTime
  std::uint32_t bytes = 0;   ///< 0xffffffff: 4 GiB or more
  std::uint32_t parent = 0;
  std::string name;
  std::string captured;  ///< as the camera says it: "20261121T225747"
};
Result<PtpObjectInfo> parse_ptp_object_info(std::span<const std::byte> bytes);

/// A dataset that is one list of numbers: storages, object handles.
Result<std::vector<std::uint32_t>> parse_ptp_u32_array(std::span<const std::byte> bytes);

/// What a response code means, in words and as its number: "device busy (0x2019)".
std::string ptp_response_words(std::uint16_t code);
/// An operation by name: "GetDeviceInfo".
std::string ptp_operation_name(std::uint16_t code);

}  // namespace emberlock::drivers
