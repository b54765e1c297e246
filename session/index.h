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

// <camera id>/index.bin: a header of 16 bytes, then one record of 68 bytes per frame; all numbers
// little-endian.
//   header: "EMBRIDX\0", u32 version = 1, u32 record size = 68
//   record: u64 frame id, i64 device ns, i64 system ns, i64 monotonic ns, u64 pixel hash, u64 file offset,
//           u32 segment, u32 frame in segment, u32 milliseconds in segment, u32 status, u32 CRC-32 of the 64
//           bytes before
// Each record has its own CRC: a torn or damaged record is skipped, the others stay valid.

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

/// Decodes kIndexRecordBytes bytes; nullopt where the checksum is wrong.
std::optional<IndexRecord> decode_record(std::span<const char> bytes);

/// Whether `b` may follow `a` in an index: the segment number never falls; within a segment, frame and time
/// rise.
bool follows(const IndexRecord& a, const IndexRecord& b);

/// The content of an index file.
std::string encode_index(const std::vector<IndexRecord>& records);

struct ParsedIndex {
  std::vector<IndexRecord> records;  ///< the good ones, in order
  std::uint64_t bad_records = 0;     ///< wrong checksum, or contradicts an earlier record
  std::size_t torn_bytes = 0;        ///< an incomplete record at the end
  [[nodiscard]] bool whole() const { return bad_records == 0 && torn_bytes == 0; }
};

/// Accepts any bytes except a foreign header (bad_input). An index that ends within its header counts as
/// empty and torn. `where` names the file in errors.
Result<ParsedIndex> parse_index(std::string_view bytes, const std::string& where);

/// The index's 64-bit hash of an image's packed bytes: four lanes of 8-byte little-endian words, lane =
/// mix64(lane ^ word), the last word zero-padded, then lanes and length are mixed together.
std::uint64_t pixel_hash(std::span<const std::byte> bytes);

}  // namespace emberlock::session
