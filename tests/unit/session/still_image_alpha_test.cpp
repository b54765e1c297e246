// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "session/media/frame_decoders.h"

namespace emberlock::session {
namespace {

constexpr int kWidth = 7;
constexpr int kHeight = 5;

void put(std::string& to, std::uint64_t value, int bytes, bool big = true) {
  for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> 8 * (big ? bytes - 1 - i : i) & 255);
}

std::uint32_t crc(const std::string& bytes) {  // ISO 3309, as PNG's annex D
  std::uint32_t c = 0xffffffff;
  for (const char byte : bytes) {
    c ^= static_cast<unsigned char>(byte);
    for (int k = 0; k < 8; ++k) c = (c & 1) != 0 ? 0xedb88320 ^ c >> 1 : c >> 1;
  }
  return ~c;
}

std::string chunk(const std::string& type, const std::string& data) {
  std::string out;
  put(out, data.size(), 4);
  out += type + data;
  put(out, crc(type + data), 4);
  return out;
}

/// A PNG whose rows are stored without compression.
std::string png(int depth, int colour_type, const std::vector<std::string>& rows,
                const std::string& more = "") {
  std::string raw;
  for (const std::string& row : rows) raw += '\0' + row;
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const char byte : raw) b = (b + (a = (a + static_cast<unsigned char>(byte)) % 65521)) % 65521;
  std::string deflated = "\x78\x01\x01";
  put(deflated, raw.size(), 2, false);
  put(deflated, ~raw.size() & 0xffff, 2, false);
  deflated += raw;
  put(deflated, b << 16 | a, 4);
  std::string head;
  put(head, kWidth, 4);
  put(head, kHeight, 4);
  put(head, static_cast<unsigned>(depth), 1);
  put(head, static_cast<unsigned>(colour_type), 1);
  put(head, 0, 3);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", head) + more + chunk("IDAT", deflated) + chunk("IEND", "");
}

/// An uncompressed TIFF of one strip; `extra` is the meaning of a sample after the colours, -1 without a tag.
std::string tiff(int depth, int samples, int extra, bool big, const std::string& strip) {
  struct Tag {
    int tag, type, count;
    std::uint64_t value;
  };
  std::vector<Tag> tags = {{256, 3, 1, kWidth},
                           {257, 3, 1, kHeight},
                           {258, 3, 1, static_cast<unsigned>(depth)},
                           {259, 3, 1, 1},
                           {262, 3, 1, samples > 2 ? 2U : 1U},
                           {273, 4, 1, 512},
                           {277, 3, 1, static_cast<unsigned>(samples)},
                           {278, 3, 1, kHeight},
                           {279, 4, 1, strip.size()}};
  if (samples > 2) tags[2] = {258, 3, samples, 400};
  if (extra >= 0) tags.push_back({338, 3, 1, static_cast<unsigned>(extra)});
  std::string out = big ? std::string("MM\0*", 4) : std::string("II*\0", 4);
  put(out, 8, 4, big);
  put(out, tags.size(), 2, big);
  for (const Tag& t : tags) {
    put(out, static_cast<unsigned>(t.tag), 2, big);
    put(out, static_cast<unsigned>(t.type), 2, big);
    put(out, static_cast<unsigned>(t.count), 4, big);
    if (t.type == 3 && t.count == 1) {
      put(out, t.value, 2, big);
      put(out, 0, 2, big);
    } else {
      put(out, t.value, 4, big);
    }
  }
  put(out, 0, 4, big);
  out.resize(400);
  for (int i = 0; i < samples; ++i) put(out, static_cast<unsigned>(depth), 2, big);
  out.resize(512);
  return out + strip;
}

/// Sample `c` of the picture that all files hold; 3 is the alpha, which is 0 and opaque here and there.
std::uint32_t sample_of(int x, int y, int c, std::uint32_t white) {
  const auto mixed = static_cast<std::uint32_t>(x * 7919 + y * 104729 + c * 1299709 + 17);
  if (c == 3 && x == 1) return 0;
  if (c == 3 && x == 2) return white;
  return (mixed * 2654435761U >> 8) % (white + 1);
}

/// Rows of the first samples of the picture, and of its alpha.
std::vector<std::string> rows_of(int depth, int colours, bool alpha, bool big = true) {
  const std::uint32_t white = depth == 8 ? 255 : 65535;
  std::vector<std::string> rows(kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < colours + (alpha ? 1 : 0); ++c)
        put(rows[static_cast<std::size_t>(y)], sample_of(x, y, c < colours ? c : 3, white), depth / 8, big);
  return rows;
}

std::string joined(const std::vector<std::string>& rows) {
  std::string all;
  for (const std::string& row : rows) all += row;
  return all;
}

/// What straight alpha shows over black.
int over_black(int x, int y, int c, int depth, bool multiply = true) {
  const std::uint64_t white = depth == 8 ? 255 : 65535;
  const auto value = [&](int sample) {
    return std::uint64_t{sample_of(x, y, sample, static_cast<std::uint32_t>(white))};
  };
  return static_cast<int>(multiply ? (value(c) * value(3) + white / 2) / white : value(c));
}

/// Whether each pixel is expected(x, y, c), to within `tolerance`.
template <class Expected>
void expect_pixels(const Result<Image>& image, PixelFormat format, const Expected& expected,
                   const std::string& what, int tolerance = 0) {
  ASSERT_TRUE(image.ok()) << what << ": " << image.error().message();
  ASSERT_EQ(image->layout().format, format) << what;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < channels(format); ++c)
        ASSERT_NEAR(image->view().sample(x, y, c), expected(x, y, c), tolerance)
            << what << " at " << x << ", " << y << ", " << c;
}

PixelFormat format_of(int depth, int colours) {
  if (colours == 1) return depth == 8 ? PixelFormat::gray8 : PixelFormat::gray16;
  return depth == 8 ? PixelFormat::rgb8 : PixelFormat::rgb16;
}

TEST(StillImageAlpha, StraightAlphaIsColourTimesAlphaOverBlack) {
  for (const int depth : {8, 16})
    for (const int colours : {1, 3}) {
      const std::string what = std::to_string(depth) + " bits, colours " + std::to_string(colours);
      const std::string file = png(depth, colours == 1 ? 4 : 6, rows_of(depth, colours, true));
      expect_pixels(
          decode_still_image(file, "a"), format_of(depth, colours),
          [&](int x, int y, int c) { return over_black(x, y, c, depth); }, "PNG of " + what);
      expect_pixels(
          decode_still_image(file, "a", Alpha::dropped), format_of(depth, colours),
          [&](int x, int y, int c) { return over_black(x, y, c, depth, false); }, "dropped, PNG of " + what);
      expect_pixels(
          decode_still_image(png(depth, colours == 1 ? 0 : 2, rows_of(depth, colours, false)), "a"),
          format_of(depth, colours), [&](int x, int y, int c) { return over_black(x, y, c, depth, false); },
          "without alpha, PNG of " + what);
    }
}

TEST(StillImageAlpha, ATiffsExtraSampleStatesWhetherColoursAreMultiplied) {
  for (const int depth : {8, 16})
    for (const bool big : {false, true})
      for (const int extra : {1, 2}) {
        const std::string strip = joined(rows_of(depth, 3, true, big));
        expect_pixels(
            decode_still_image(tiff(depth, 4, extra, big, strip), "a"), format_of(depth, 3),
            [&](int x, int y, int c) { return over_black(x, y, c, depth, extra == 2); },
            "TIFF of " + std::to_string(depth) + " bits, ExtraSamples " + std::to_string(extra),
            depth == 8 && extra == 2 ? 1 : 0);  // libtiff rounds
      }
}

TEST(StillImageAlpha, ASampleWithoutStatedMeaningIsRefusedUnlessItIsOpaque) {
  for (const int depth : {8, 16})
    for (const int extra : {-1, 0}) {
      std::string strip = joined(rows_of(depth, 3, true));
      const auto refused = decode_still_image(tiff(depth, 4, extra, true, strip), "a");
      ASSERT_FALSE(refused.ok());
      EXPECT_THAT(refused.error().message(), testing::HasSubstr("ExtraSamples"));
      const auto bytes = static_cast<std::size_t>(depth / 8);
      for (std::size_t p = 0; p < kWidth * kHeight; ++p)
        for (std::size_t i = 0; i < bytes; ++i) strip[(4 * p + 3) * bytes + i] = '\xff';
      expect_pixels(
          decode_still_image(tiff(depth, 4, extra, true, strip), "a"), format_of(depth, 3),
          [&](int x, int y, int c) { return over_black(x, y, c, depth, false); }, "an opaque TIFF");
      EXPECT_FALSE(
          decode_still_image(tiff(depth, 2, extra, true, joined(rows_of(depth, 1, true))), "a").ok());
    }
}

TEST(StillImageAlpha, ATransparentColourIsBlack) {
  for (const int depth : {8, 16}) {
    const std::uint32_t white = depth == 8 ? 255 : 65535;
    for (const int colours : {1, 3}) {
      std::string key;
      for (int c = 0; c < colours; ++c) put(key, sample_of(3, 2, c, white), 2);
      expect_pixels(
          decode_still_image(
              png(depth, colours == 1 ? 0 : 2, rows_of(depth, colours, false), chunk("tRNS", key)), "a"),
          format_of(depth, colours),
          [&](int x, int y, int c) {
            bool is_key = true;
            for (int i = 0; i < colours; ++i)
              is_key = is_key && sample_of(x, y, i, white) == sample_of(3, 2, i, white);
            return is_key ? 0 : over_black(x, y, c, depth, false);
          },
          "a key of " + std::to_string(colours) + " colours, " + std::to_string(depth) + " bits");
    }
  }
}

TEST(StillImageAlpha, APalettesAlphaIsItsEntries) {
  std::string palette;
  std::string alpha;
  for (int i = 0; i < kWidth; ++i) {
    for (int c = 0; c < 3; ++c) put(palette, sample_of(i, 0, c, 255), 1);
    put(alpha, sample_of(i, 0, 3, 255), 1);
  }
  std::string row;
  for (int x = 0; x < kWidth; ++x) row += static_cast<char>(x);
  expect_pixels(
      decode_still_image(
          png(8, 3, std::vector<std::string>(kHeight, row), chunk("PLTE", palette) + chunk("tRNS", alpha)),
          "a"),
      PixelFormat::rgb8, [](int x, int, int c) { return over_black(x, 0, c, 8); }, "a palette");
}

}  // namespace
}  // namespace emberlock::session
