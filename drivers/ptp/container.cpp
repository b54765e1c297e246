// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/container.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

Error malformed(std::string what) {
  return {ErrorKind::device, std::move(what), {}, "unplug the device and plug it in again"};
}

template <class Integer>
void append(std::vector<std::byte>& to, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) to.push_back(static_cast<std::byte>(value >> (8 * i)));
}

void append_utf8(std::string& to, std::uint32_t c) {
  const auto put = [&to](std::uint32_t byte) { to.push_back(static_cast<char>(byte)); };
  const auto rest = [&](int shift) { put(0x80 | (c >> shift & 0x3f)); };
  if (c < 0x80) {
    put(c);
  } else if (c < 0x800) {
    put(0xc0 | c >> 6), rest(0);
  } else if (c < 0x10000) {
    put(0xe0 | c >> 12), rest(6), rest(0);
  } else {
    put(0xf0 | c >> 18), rest(12), rest(6), rest(0);
  }
}

bool is_high_surrogate(std::uint32_t c) { return c >= 0xd800 && c < 0xdc00; }
bool is_low_surrogate(std::uint32_t c) { return c >= 0xdc00 && c < 0xe000; }

std::string utf8(const std::vector<std::uint16_t>& units) {
  constexpr std::uint32_t kReplacement = 0xfffd;
  std::string text;
  for (std::size_t i = 0; i < units.size() && units[i] != 0; ++i) {
    std::uint32_t c = units[i];
    if (is_high_surrogate(c) && i + 1 < units.size() && is_low_surrogate(units[i + 1])) {
      c = 0x10000 + ((c - 0xd800) << 10) + (units[++i] - 0xdc00u);
    } else if (is_high_surrogate(c) || is_low_surrogate(c)) {
      c = kReplacement;
    }
    append_utf8(text, c);
  }
  return text;
}

using CodeName = std::pair<std::uint16_t, std::string_view>;

// ISO 15740, table 19.
constexpr std::array kResponses{
    CodeName{0x2001, "ok"},
    CodeName{0x2002, "general error"},
    CodeName{0x2003, "session not open"},
    CodeName{0x2004, "invalid transaction id"},
    CodeName{0x2005, "operation not supported"},
    CodeName{0x2006, "parameter not supported"},
    CodeName{0x2007, "incomplete transfer"},
    CodeName{0x2008, "invalid storage id"},
    CodeName{0x2009, "invalid object handle"},
    CodeName{0x200a, "device property not supported"},
    CodeName{0x200b, "invalid object format"},
    CodeName{0x200c, "card full"},
    CodeName{0x200d, "object write-protected"},
    CodeName{0x200e, "card read-only"},
    CodeName{0x200f, "access denied"},
    CodeName{0x2010, "no thumbnail present"},
    CodeName{0x2011, "self-test failed"},
    CodeName{0x2012, "partial deletion"},
    CodeName{0x2013, "card not available"},
    CodeName{0x2014, "no specification by format"},
    CodeName{0x2015, "no valid object info"},
    CodeName{0x2016, "invalid code format"},
    CodeName{0x2017, "unknown vendor code"},
    CodeName{0x2018, "capture already terminated"},
    CodeName{0x2019, "device busy"},
    CodeName{0x201a, "invalid parent object"},
    CodeName{0x201b, "invalid device property format"},
    CodeName{0x201c, "invalid device property value"},
    CodeName{0x201d, "invalid parameter"},
    CodeName{0x201e, "session already open"},
    CodeName{0x201f, "transaction cancelled"},
    CodeName{0x2020, "destination can't be chosen"},
};

constexpr std::array kOperations{
    CodeName{0x1001, "GetDeviceInfo"},
    CodeName{0x1002, "OpenSession"},
    CodeName{0x1003, "CloseSession"},
    CodeName{0x1004, "GetStorageIDs"},
    CodeName{0x1007, "GetObjectHandles"},
    CodeName{0x1008, "GetObjectInfo"},
    CodeName{0x1009, "GetObject"},
    CodeName{0x101b, "GetPartialObject"},
    CodeName{0x9999, "CHDK"},
};

template <std::size_t N>
std::optional<std::string_view> find_name(const std::array<CodeName, N>& names, std::uint16_t code) {
  const auto found =
      std::find_if(names.begin(), names.end(), [code](const CodeName& n) { return n.first == code; });
  return found == names.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

Result<PtpHeader> parse_ptp_header(std::span<const std::byte> bytes) {
  if (bytes.size() < kPtpHeaderBytes) {
    return malformed(fmt::format("it sent a container of {} bytes, too few for its header", bytes.size()));
  }
  PtpReader in(bytes);
  PtpHeader header;
  header.length = in.u32();
  const std::uint16_t type = in.u16();
  header.type = static_cast<PtpType>(type);
  header.code = in.u16();
  header.transaction = in.u32();
  if (type < 1 || type > 4)
    return malformed(fmt::format("it sent a container of type {}, there is none", type));
  if (header.length < kPtpHeaderBytes) {
    return malformed(fmt::format("it sent a container that says to be {} bytes long", header.length));
  }
  return header;
}

Result<PtpMessage> parse_ptp_message(std::span<const std::byte> bytes) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpHeader header, parse_ptp_header(bytes));
  if (header.type == PtpType::data) return malformed("it sent data where a message was due");
  if (header.length != bytes.size()) {
    return malformed(
        fmt::format("it sent {} bytes that say to be a container of {}", bytes.size(), header.length));
  }
  const std::size_t params = bytes.size() - kPtpHeaderBytes;
  if (params % 4 != 0 || params / 4 > kPtpMostParams) {
    return malformed(fmt::format("it sent a message with {} bytes of parameters", params));
  }
  PtpMessage message{header.type, header.code, header.transaction};
  PtpReader in(bytes.subspan(kPtpHeaderBytes));
  for (std::size_t i = 0; i < params / 4; ++i) message.params.push_back(in.u32());
  return message;
}

std::vector<std::byte> encode(const PtpHeader& header) {
  std::vector<std::byte> bytes;
  append(bytes, header.length);
  append(bytes, static_cast<std::uint16_t>(header.type));
  append(bytes, header.code);
  append(bytes, header.transaction);
  return bytes;
}

std::vector<std::byte> encode(const PtpMessage& message) {
  const auto length = static_cast<std::uint32_t>(kPtpHeaderBytes + 4 * message.params.size());
  std::vector<std::byte> bytes = encode(PtpHeader{length, message.type, message.code, message.transaction});
  for (const std::uint32_t param : message.params) append(bytes, param);
  return bytes;
}

std::uint64_t PtpReader::little_endian(std::size_t size) {
  if (left() < size) {
    at_ = bytes_.size();
    overrun_ = true;
    return 0;
  }
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
  at_ += size;
  return value;
}

void PtpReader::skip(std::size_t bytes) {
  overrun_ = overrun_ || bytes > left();
  at_ += std::min(bytes, left());
}

std::string PtpReader::text() {
  std::vector<std::uint16_t> units(u8());
  for (std::uint16_t& unit : units) unit = u16();
  return utf8(units);
}

std::vector<std::uint16_t> PtpReader::u16_array() {
  // The count is checked against the remaining bytes before memory is allocated.
  const std::size_t count = u32();
  std::vector<std::uint16_t> values(std::min(count, left() / 2));
  for (std::uint16_t& value : values) value = u16();
  if (values.size() < count) skip(left() + 1);
  return values;
}

std::vector<std::uint32_t> PtpReader::u32_array() {
  const std::size_t count = u32();
  std::vector<std::uint32_t> values(std::min(count, left() / 4));
  for (std::uint32_t& value : values) value = u32();
  if (values.size() < count) skip(left() + 1);
  return values;
}

Status PtpReader::check(const std::string& what) const {
  if (!overrun_) return {};
  return malformed(fmt::format("its {} of {} bytes ends too soon", what, bytes_.size()));
}

bool PtpDeviceInfo::has(std::uint16_t operation) const {
  return std::find(operations.begin(), operations.end(), operation) != operations.end();
}

Result<PtpDeviceInfo> parse_ptp_device_info(std::span<const std::byte> bytes) {
  PtpReader in(bytes);
  PtpDeviceInfo info;
  in.u16();  // version of the standard
  info.vendor_extension = in.u32();
  in.u16();   // version of the extension
  in.text();  // its description
  in.u16();   // functional mode
  info.operations = in.u16_array();
  in.u16_array();  // events
  in.u16_array();  // properties
  in.u16_array();  // formats of captures
  in.u16_array();  // formats of objects
  info.manufacturer = in.text();
  info.model = in.text();
  info.version = in.text();
  info.serial = in.text();
  EMBERLOCK_RETURN_IF_ERROR(in.check("device info"));
  return info;
}

Result<PtpObjectInfo> parse_ptp_object_info(std::span<const std::byte> bytes) {
  PtpReader in(bytes);
  PtpObjectInfo info;
  info.storage = in.u32();
  info.format = in.u16();
  in.u16();  // protection
  info.bytes = in.u32();
  in.skip(2 + 6 * 4);  // thumbnail, size and depth of the picture
  info.parent = in.u32();
  in.skip(2 + 4 + 4);  // association, number in a sequence
  info.name = in.text();
  info.captured = in.text();
  EMBERLOCK_RETURN_IF_ERROR(in.check("object info"));
  return info;
}

Result<std::vector<std::uint32_t>> parse_ptp_u32_array(std::span<const std::byte> bytes) {
  PtpReader in(bytes);
  auto values = in.u32_array();
  EMBERLOCK_RETURN_IF_ERROR(in.check("list"));
  return values;
}

std::string ptp_response_words(std::uint16_t code) {
  return fmt::format("{} ({:#06x})", find_name(kResponses, code).value_or("a response of its maker's own"),
                     code);
}

std::string ptp_operation_name(std::uint16_t code) {
  const auto name = find_name(kOperations, code);
  return name ? std::string(*name) : fmt::format("operation {:#06x}", code);
}

}  // namespace emberlock::drivers
