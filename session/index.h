// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/frame.h"
#include "base/result.h"

namespace emberlock::session {

// <camera id>/index.bin: a header of 16 bytes, then one record of 68 bytes a frame; all numbers
// little-endian.
//   header: "EMBRIDX\0", u32 version = 1, u32 record size = 68
//   record: u64 frame id, i64 device ns, i64 system ns, i64 monotonic ns, u64 pixel hash, u64 file offset,
//           u32 segment, u32 frame in segment, u32 milliseconds in segment, u32 status, u32 CRC-32 of the 64
//           bytes before
// The CRC makes each record stand for itself: a torn or flipped one is left out, the others stay good.

struct IndexRecord {
  FrameStamp stamp;
  std::uint64_t pixel_hash = 0;
  std::uint64_t file_offset =
      0;  ///< length of the segment as first written when the frame was handed over; a hint
  std::uint32_t segment = 0;
  std::uint32_t frame_in_segment = 0;
  std::uint32_t segment_ms =
      0;  ///< the frame's time stamp in the segment's container; rises within a segment
  friend bool operator==(const IndexRecord&, const IndexRecord&) = default;
};

inline constexpr std::size_t kIndexHeaderBytes = 16;
inline constexpr std::size_t kIndexRecordBytes = 68;
inline constexpr std::size_t kMaxIndexBytes = std::size_t{4} << 30;  ///< 63 million frames

std::string encode_index_header();
std::array<char, kIndexRecordBytes> encode(const IndexRecord& record);

/// The record that these kIndexRecordBytes bytes hold; none where their checksum is wrong.
std::optional<IndexRecord> decode_record(std::span<const char> bytes);

/// Whether `b` may stand behind `a` in an index: segments rise, and within one, frames and times do.
bool follows(const IndexRecord& a, const IndexRecord& b);

/// A whole file of them.
std::string encode_index(const std::vector<IndexRecord>& records);

struct ParsedIndex {
  std::vector<IndexRecord> records;  ///< the good ones, in order
  std::uint64_t bad_records = 0;     ///< checksum wrong, or contradicts an earlier record
  std::size_t torn_bytes = 0;        ///< a started record at the end
  [[nodiscard]] bool whole() const { return bad_records == 0 && torn_bytes == 0; }
};

/// Any bytes are accepted but a foreign header (bad_input). `where` names the file in errors. An index cut
/// within its header is an empty one, torn.
Result<ParsedIndex> parse_index(std::string_view bytes, const std::string& where);

/// 64-bit hash of an image's packed bytes, as the index keeps it: four lanes of 8-byte little-endian words,
/// lane = mix64(lane ^ word), the last word zero-padded, then the lanes and the length mixed together.
std::uint64_t pixel_hash(std::span<const std::byte> bytes);

}  // namespace emberlock::session
