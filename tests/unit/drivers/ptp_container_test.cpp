// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/ptp/container.h"

namespace emberlock::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> out;
  for (const int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

TEST(PtpContainer, ACommandLiesInMemoryAsTheStandardDrawsIt) {
  const PtpMessage open{PtpType::command, 0x1002, 0x01020304, {1}};
  EXPECT_EQ(encode(open), bytes({16, 0, 0, 0, 1, 0, 0x02, 0x10, 4, 3, 2, 1, 1, 0, 0, 0}));
  EXPECT_EQ(parse_ptp_message(encode(open)).value(), open);
}

TEST(PtpContainer, EveryTruncationOfAMessageIsRefused) {
  const auto whole = encode(PtpMessage{PtpType::response, 0x2001, 7, {1, 2, 3}});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_ptp_message(std::span(whole).first(size)).ok()) << size;
  }
}

TEST(PtpContainer, MoreBytesOrParametersThanThereMayBeAreRefused) {
  auto longer = encode(PtpMessage{PtpType::response, 0x2001, 7, {1}});
  longer.push_back(std::byte{0});
  EXPECT_FALSE(parse_ptp_message(longer).ok());
  EXPECT_FALSE(parse_ptp_message(encode(PtpMessage{PtpType::response, 0x2001, 7, {1, 2, 3, 4, 5, 6}})).ok());
}

TEST(PtpContainer, TypesAndLengthsThatDoNotExistAreRefused) {
  auto header = encode(PtpHeader{12, PtpType::response, 0x2001, 7});
  header[4] = std::byte{5};
  EXPECT_THAT(parse_ptp_header(header).error().what, HasSubstr("type 5"));
  EXPECT_THAT(parse_ptp_header(encode(PtpHeader{11, PtpType::response, 0x2001, 7})).error().what,
              HasSubstr("11 bytes"));
  EXPECT_FALSE(parse_ptp_message(encode(PtpHeader{12, PtpType::data, 0x1001, 7})).ok());
}

TEST(PtpText, Utf16BecomesUtf8UpToItsNul) {
  // "Aé€" and a clef, which takes a surrogate pair; then NUL and what a device left behind it.
  const auto data = bytes({7, 0x41, 0, 0xe9, 0, 0xac, 0x20, 0x34, 0xd8, 0x1e, 0xdd, 0, 0, 0x42, 0, 0x99});
  PtpReader in(data);
  EXPECT_EQ(in.text(), "A\xc3\xa9\xe2\x82\xac\xf0\x9d\x84\x9e");
  EXPECT_EQ(in.u8(), 0x99);
  EXPECT_TRUE(in.check("text").ok());
}

TEST(PtpText, HalvesOfSurrogatePairsAreReplaced) {
  const auto data = bytes({3, 0x34, 0xd8, 0x1e, 0xdd, 0x34, 0xd8});
  EXPECT_EQ(PtpReader(data).text(), "\xf0\x9d\x84\x9e\xef\xbf\xbd");
  const auto low_first = bytes({1, 0x1e, 0xdd});
  EXPECT_EQ(PtpReader(low_first).text(), "\xef\xbf\xbd");
}

TEST(PtpReader, ACountThatTheBytesCannotHoldTakesNoMemoryAndIsAnError) {
  const auto data = bytes({0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0});
  PtpReader in(data);
  EXPECT_LE(in.u32_array().size(), 1u);
  EXPECT_FALSE(in.check("list").ok());
  EXPECT_FALSE(parse_ptp_u32_array(data).ok());
}

TEST(PtpReader, WhatLiesBehindTheEndReadsAsZeroAndIsToldOnce) {
  const auto data = bytes({1, 2, 3});
  PtpReader in(data);
  EXPECT_EQ(in.u16(), 0x0201);
  EXPECT_EQ(in.u32(), 0u);
  EXPECT_EQ(in.u8(), 0u);
  EXPECT_THAT(in.check("device info").error().what, HasSubstr("device info"));
}

TEST(PtpObjectInfo, AnInfoOfTheStandardsLayoutIsRead) {
  auto data = bytes({1, 0, 1, 0, 0x0a, 0x30, 0, 0, 0x40, 0x42, 0x0f, 0});
  data.resize(data.size() + 2 + 6 * 4);
  for (const int v : {9, 0, 0, 0}) data.push_back(static_cast<std::byte>(v));
  data.resize(data.size() + 10);
  for (const int v : {3, int{'M'}, 0, int{'1'}, 0, 0, 0, 0}) data.push_back(static_cast<std::byte>(v));
  const auto info = parse_ptp_object_info(data);
  ASSERT_TRUE(info.ok()) << info.error().message();
  EXPECT_EQ(info->storage, 0x00010001u);
  EXPECT_EQ(info->format, 0x300a);
  EXPECT_EQ(info->bytes, 1'000'000u);
  EXPECT_EQ(info->parent, 9u);
  EXPECT_EQ(info->name, "M1");
  data.pop_back();
  EXPECT_FALSE(parse_ptp_object_info(data).ok());
}

TEST(PtpWords, CodesAreToldInWordsAndNumbers) {
  EXPECT_EQ(ptp_response_words(0x2019), "device busy (0x2019)");
  EXPECT_THAT(ptp_response_words(0xa001), HasSubstr("0xa001"));
  EXPECT_EQ(ptp_operation_name(0x1009), "GetObject");
  EXPECT_EQ(ptp_operation_name(0x9010), "operation 0x9010");
}

}  // namespace
}  // namespace emberlock::drivers
