// SPDX-License-Identifier: Apache-2.0
#include "session/index.h"

#include <array>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::session {
namespace {

IndexRecord record(std::uint32_t i) {
  IndexRecord r;
  r.stamp = {i + 100,
             {-5},
             {std::numeric_limits<std::int64_t>::min() + i},
             {std::numeric_limits<std::int64_t>::max() - i},
             i % 2 == 0 ? FrameStatus::complete : FrameStatus::damaged};
  r.pixel_hash = 0x0123456789abcdefULL * (i + 1);
  r.file_offset = std::uint64_t{1} << 40;
  r.segment = i / 3;
  r.frame_in_segment = i % 3;
  r.segment_ms = (i % 3) * 42;
  return r;
}

std::string index_of(std::uint32_t count) {
  std::string bytes = encode_index_header();
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto encoded = encode(record(i));
    bytes.append(encoded.data(), encoded.size());
  }
  return bytes;
}

TEST(Index, IsTheSameBytesOnEveryMachine) {
  const auto bytes = encode(record(1));
  EXPECT_EQ(static_cast<unsigned char>(bytes[0]), 101);   // frame id, little-endian
  EXPECT_EQ(static_cast<unsigned char>(bytes[8]), 0xfb);  // -5
  EXPECT_EQ(encode_index_header(), std::string("EMBRIDX\0\1\0\0\0\x44\0\0\0", 16));
}

TEST(Index, TornAtEveryByteKeepsTheRecordsBefore) {
  const std::string whole = index_of(7);
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    const auto parsed = parse_index(std::string_view(whole).substr(0, cut), "index.bin");
    ASSERT_TRUE(parsed) << cut;
    const std::size_t body = cut < kIndexHeaderBytes ? 0 : cut - kIndexHeaderBytes;
    ASSERT_EQ(parsed->records.size(), body / kIndexRecordBytes) << cut;
    for (std::uint32_t i = 0; i < parsed->records.size(); ++i) ASSERT_EQ(parsed->records[i], record(i));
    EXPECT_EQ(parsed->whole(), cut >= kIndexHeaderBytes && body % kIndexRecordBytes == 0) << cut;
  }
}

TEST(Index, AFlippedBitCostsItsOwnRecordAlone) {
  const std::string whole = index_of(5);
  for (std::size_t byte = kIndexHeaderBytes; byte < whole.size(); ++byte) {
    std::string bytes = whole;
    bytes[byte] = static_cast<char>(bytes[byte] ^ (1 << (byte % 8)));
    const auto parsed = parse_index(bytes, "index.bin");
    ASSERT_TRUE(parsed);
    ASSERT_EQ(parsed->bad_records, 1U) << byte;
    ASSERT_EQ(parsed->records.size(), 4U);
    const auto hurt = static_cast<std::uint32_t>((byte - kIndexHeaderBytes) / kIndexRecordBytes);
    for (const IndexRecord& r : parsed->records) ASSERT_NE(r.stamp.frame_id, record(hurt).stamp.frame_id);
  }
}

TEST(Index, OfAnotherKindOrVersionIsRefusedByName) {
  std::string bytes = index_of(1);
  bytes[8] = 2;
  for (const std::string& foreign : {bytes, std::string("PK\3\4 a zip file"), std::string("x")}) {
    const auto parsed = parse_index(foreign, "cam0/index.bin");
    ASSERT_FALSE(parsed);
    EXPECT_EQ(parsed.error().kind, ErrorKind::bad_input);
    EXPECT_NE(parsed.error().message().find("cam0/index.bin"), std::string::npos);
  }
}

TEST(Index, RecordsOutOfOrderAreLeftOut) {
  std::string bytes = encode_index_header();
  for (const std::uint32_t i : {4U, 1U, 5U}) {
    const auto encoded = encode(record(i));
    bytes.append(encoded.data(), encoded.size());
  }
  const auto parsed = parse_index(bytes, "index.bin");
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->bad_records, 1U);
  EXPECT_EQ(parsed->records.size(), 2U);
}

TEST(PixelHash, TellsLengthsAndPlacesApart) {
  const std::vector<std::byte> zeros(100);
  EXPECT_NE(pixel_hash(std::span(zeros).first(99)), pixel_hash(zeros));
  for (std::size_t i = 0; i < zeros.size(); ++i) {
    std::vector<std::byte> one = zeros;
    one[i] = std::byte{1};
    EXPECT_NE(pixel_hash(one), pixel_hash(zeros)) << i;
    std::vector<std::byte> next = zeros;
    next[(i + 1) % zeros.size()] = std::byte{1};
    EXPECT_NE(pixel_hash(one), pixel_hash(next)) << i;
  }
}

// The figure comes from the definition in index.h, carried out in Python's whole numbers.
TEST(PixelHash, NeverChangesItsValue) {
  std::array<std::byte, 45> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i);
  EXPECT_EQ(pixel_hash(bytes), 17782164387431613812ULL) << "old recordings would all read as damaged";
}

}  // namespace
}  // namespace emberlock::session
