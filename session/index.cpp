// SPDX-License-Identifier: Apache-2.0
#include "session/index.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include <zlib.h>

#include "base/random.h"

namespace emberlock::session {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the index is little-endian, fields are copied as they are");

constexpr std::uint32_t kVersion = 1;
constexpr std::string_view kMagic("EMBRIDX\0", 8);

class Packer {
 public:
  explicit Packer(char* at) : at_(at) {}
  template <class T>
  Packer& put(T value) {
    std::memcpy(at_, &value, sizeof(T));
    at_ += sizeof(T);
    return *this;
  }

 private:
  char* at_;
};

class Unpacker {
 public:
  explicit Unpacker(const char* at) : at_(at) {}
  template <class T>
  T get() {
    T value;
    std::memcpy(&value, at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }

 private:
  const char* at_;
};

/// CRC-32 of IEEE 802.3.
std::uint32_t checksum(std::span<const char> bytes) {
  return static_cast<std::uint32_t>(
      ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

bool decode(std::span<const char> bytes, IndexRecord& r) {
  Unpacker in(bytes.data());
  r.stamp.frame_id = in.get<std::uint64_t>();
  r.stamp.device_time.ns = in.get<std::int64_t>();
  r.stamp.system_time.ns = in.get<std::int64_t>();
  r.stamp.monotonic_time.ns = in.get<std::int64_t>();
  r.pixel_hash = in.get<std::uint64_t>();
  r.file_offset = in.get<std::uint64_t>();
  r.segment = in.get<std::uint32_t>();
  r.frame_in_segment = in.get<std::uint32_t>();
  r.segment_ms = in.get<std::uint32_t>();
  const auto status = in.get<std::uint32_t>();
  r.stamp.status = static_cast<FrameStatus>(status);
  const bool status_known = status <= static_cast<std::uint32_t>(FrameStatus::damaged);
  return status_known && in.get<std::uint32_t>() == checksum(bytes.first(kIndexRecordBytes - 4));
}

}  // namespace

std::optional<IndexRecord> decode_record(std::span<const char> bytes) {
  IndexRecord record;
  if (bytes.size() != kIndexRecordBytes || !decode(bytes, record)) return std::nullopt;
  return record;
}

bool follows(const IndexRecord& a, const IndexRecord& b) {
  if (a.segment != b.segment) return b.segment > a.segment;
  return b.frame_in_segment > a.frame_in_segment && b.segment_ms > a.segment_ms;
}

std::string encode_index_header() {
  std::string header(kIndexHeaderBytes, '\0');
  std::copy(kMagic.begin(), kMagic.end(), header.begin());
  Packer(header.data() + kMagic.size()).put(kVersion).put(static_cast<std::uint32_t>(kIndexRecordBytes));
  return header;
}

std::array<char, kIndexRecordBytes> encode(const IndexRecord& r) {
  std::array<char, kIndexRecordBytes> bytes{};
  Packer out(bytes.data());
  out.put(r.stamp.frame_id)
      .put(r.stamp.device_time.ns)
      .put(r.stamp.system_time.ns)
      .put(r.stamp.monotonic_time.ns);
  out.put(r.pixel_hash).put(r.file_offset).put(r.segment).put(r.frame_in_segment).put(r.segment_ms);
  out.put(static_cast<std::uint32_t>(r.stamp.status));
  out.put(checksum(std::span<const char>(bytes).first(kIndexRecordBytes - 4)));
  return bytes;
}

std::string encode_index(const std::vector<IndexRecord>& records) {
  std::string bytes = encode_index_header();
  bytes.reserve(bytes.size() + records.size() * kIndexRecordBytes);
  for (const IndexRecord& record : records) {
    const auto encoded = encode(record);
    bytes.append(encoded.data(), encoded.size());
  }
  return bytes;
}

Result<ParsedIndex> parse_index(std::string_view bytes, const std::string& where) {
  ParsedIndex index;
  const std::string header = encode_index_header();
  if (bytes.substr(0, header.size()) != std::string_view(header).substr(0, bytes.size())) {
    return Error{ErrorKind::bad_input, "not an index of version " + std::to_string(kVersion), where,
                 "Check that the folder is a session of this version of Emberlock"};
  }
  if (bytes.size() < header.size()) {
    index.torn_bytes = std::max<std::size_t>(bytes.size(), 1);
    return index;
  }
  bytes.remove_prefix(header.size());
  index.records.reserve(bytes.size() / kIndexRecordBytes);
  for (; bytes.size() >= kIndexRecordBytes; bytes.remove_prefix(kIndexRecordBytes)) {
    IndexRecord record;
    const bool good = decode(std::span<const char>(bytes.data(), kIndexRecordBytes), record) &&
                      (index.records.empty() || follows(index.records.back(), record));
    if (good) index.records.push_back(record);
    if (!good) ++index.bad_records;
  }
  index.torn_bytes = bytes.size();
  return index;
}

std::uint64_t pixel_hash(std::span<const std::byte> bytes) {
  std::array<std::uint64_t, 4> lanes{1, 2, 3, 4};
  std::size_t at = 0;
  for (; at + 32 <= bytes.size(); at += 32) {
    std::array<std::uint64_t, 4> words{};
    std::memcpy(words.data(), bytes.data() + at, sizeof(words));
    for (std::size_t i = 0; i < lanes.size(); ++i) lanes[i] = mix64(lanes[i] ^ words[i]);
  }
  for (std::size_t i = 0; at < bytes.size(); ++i, at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    lanes[i] = mix64(lanes[i] ^ word);
  }
  std::uint64_t hash = bytes.size();
  for (const std::uint64_t lane : lanes) hash = mix64(hash ^ lane);
  return hash;
}

}  // namespace emberlock::session
