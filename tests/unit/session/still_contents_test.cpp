// SPDX-License-Identifier: Apache-2.0
// Files that hold several pictures, and what their fields state on the display.
#include "session/media/still_contents.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "session/media/clip.h"
#include "session/media/frame_file.h"
#include "session/media/video_scan.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::noise_image;
using test::put_bytes;
using test::TempFolder;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr ImageLayout kPage{{6, 4}, PixelFormat::gray8, 8};

/// Numbers in one of the two byte orders.
class Bytes {
 public:
  explicit Bytes(bool big) : big_(big) {}
  Bytes& put(std::size_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      text.push_back(static_cast<char>(value >> 8 * (big_ ? bytes - 1 - i : i) & 0xff));
    return *this;
  }
  std::string text;

 private:
  bool big_;
};

struct TiffKind {
  bool big = false;     ///< byte order
  bool large = false;   ///< BigTIFF, with offsets of 8 bytes
  int orientation = 0;  ///< 0: no such tag
  int subfile = 0;      ///< of all pages but the first
  std::string description{};
};

/// An uncompressed TIFF of these grey pictures.
std::string tiff_of(const std::vector<Image>& pages, const TiffKind& kind) {
  struct Entry {
    std::size_t type, count, value;
  };
  constexpr std::size_t kShort = 3;
  constexpr std::size_t kLong = 4;
  Bytes file(kind.big);
  file.text = kind.big ? "MM" : "II";
  const int word = kind.large ? 8 : 4;
  if (kind.large) {
    file.put(43, 2).put(8, 2).put(0, 2).put(16, 8);
  } else {
    file.put(42, 2).put(8, 4);
  }
  for (std::size_t page = 0; page < pages.size(); ++page) {
    const std::size_t size = pages[page].bytes().size();
    std::map<std::size_t, Entry> entries{
        {254, {kLong, 1, page == 0 ? 0 : static_cast<std::size_t>(kind.subfile)}},
        {256, {kShort, 1, 6}},
        {257, {kShort, 1, 4}},
        {258, {kShort, 1, 8}},
        {259, {kShort, 1, 1}},
        {262, {kShort, 1, 1}},
        {273, {kLong, 1, 0}},
        {279, {kLong, 1, size}}};
    if (kind.orientation != 0) entries[274] = {kShort, 1, static_cast<std::size_t>(kind.orientation)};
    if (!kind.description.empty()) entries[270] = {2, kind.description.size() + 1, 0};
    const std::size_t directory = kind.large ? 8 + 20 * entries.size() : 2 + 12 * entries.size();
    const std::size_t after = file.text.size() + directory + static_cast<std::size_t>(word);
    const std::size_t pixels = after + kind.description.size() + 1;
    entries[273].value = pixels;
    if (!kind.description.empty()) entries[270].value = after;
    file.put(entries.size(), kind.large ? 8 : 2);
    for (const auto& [tag, entry] : entries) {
      const int bytes = entry.type == kShort ? 2 : 4;
      file.put(tag, 2).put(entry.type, 2).put(entry.count, word).put(entry.value, bytes).put(0, word - bytes);
    }
    file.put(page + 1 < pages.size() ? pixels + size : 0, word);
    file.text += kind.description + '\0';
    file.text.append(reinterpret_cast<const char*>(pages[page].bytes().data()), size);
  }
  return file.text;
}

std::string page_pgm(const Image& image) {
  return "P5 6 4 255\n" +
         std::string(reinterpret_cast<const char*>(image.bytes().data()), image.bytes().size());
}

std::string encoded(const Image& image, const char* ending) {
  const cv::Mat mat(4, 6, CV_8U, const_cast<std::byte*>(image.view().data));
  std::vector<unsigned char> bytes;
  cv::imencode(ending, mat, bytes, {cv::IMWRITE_JPEG_QUALITY, 100});
  return {bytes.begin(), bytes.end()};
}

/// A JPEG with an EXIF block behind its start marker.
std::string with_exif(const std::string& jpeg, int orientation, bool big) {
  Bytes exif(big);
  exif.text = std::string("Exif\0\0", 6) + (big ? "MM" : "II");
  exif.put(42, 2).put(8, 4).put(1, 2).put(274, 2).put(3, 2).put(1, 4);
  exif.put(static_cast<std::size_t>(orientation), 2).put(0, 2).put(0, 4);
  Bytes segment(true);
  segment.text = jpeg.substr(0, 2) + "\xff\xe1";
  segment.put(exif.text.size() + 2, 2);
  return segment.text + exif.text + jpeg.substr(2);
}

/// JPEGs with an index (MPF), as stereo cameras write them; `type` is that of all but the first.
std::string mpo_of(const std::vector<Image>& images, std::uint32_t type = 0x020002) {
  constexpr std::size_t kHead = 2 + 4 + 4;  // before the index, by which it counts offsets
  std::vector<std::string> jpegs;
  for (const Image& image : images) jpegs.push_back(encoded(image, ".jpg"));
  Bytes index(true);
  index.text = "MM";
  index.put(42, 2)
      .put(8, 4)
      .put(1, 2)
      .put(0xb002, 2)
      .put(7, 2)
      .put(16 * jpegs.size(), 4)
      .put(26, 4)
      .put(0, 4);
  std::size_t at = kHead + 26 + 16 * jpegs.size() + jpegs[0].size() - 2;
  for (std::size_t i = 0; i < jpegs.size(); ++i) {
    index.put(i == 0 ? 0x030000 : type, 4).put(jpegs[i].size(), 4).put(i == 0 ? 0 : at - kHead, 4).put(0, 4);
    if (i > 0) at += jpegs[i].size();
  }
  Bytes file(true);
  file.text = jpegs[0].substr(0, 2) + "\xff\xe2";
  file.put(2 + 4 + index.text.size(), 2).text += std::string("MPF\0", 4) + index.text + jpegs[0].substr(2);
  for (std::size_t i = 1; i < jpegs.size(); ++i) file.text += jpegs[i];
  return file.text;
}

std::vector<Image> pictures(std::size_t count) {
  std::vector<Image> images;
  for (std::size_t i = 0; i < count; ++i) images.push_back(noise_image(kPage, i));
  return images;
}

TEST(StillContents, AFileOfSeveralPicturesGivesThemAll) {
  for (const std::size_t count : {1U, 2U, 3U, 12U}) {
    const std::vector<Image> images = pictures(count);
    std::string pnms;
    std::string jpegs;
    std::string padded;
    for (const Image& image : images) {
      pnms += page_pgm(image);
      jpegs += encoded(image, ".jpg");
      padded += encoded(image, ".jpg") + std::string(5, '\0');
    }
    for (const auto& [name, content] : std::vector<std::pair<std::string, std::string>>{
             {"a.pgm", pnms},
             {"little.tif", tiff_of(images, {})},
             {"big.tif", tiff_of(images, {.big = true})},
             {"turned.tif", tiff_of(images, {.orientation = 3})},
             {"large.tif", tiff_of(images, {.large = true})},
             {"both.tif", tiff_of(images, {.big = true, .large = true, .orientation = 3})},
             {"a.mpo", mpo_of(images)},
             {"a.mjpeg", jpegs},
             {"padded.mjpeg", padded}}) {
      SCOPED_TRACE(name + " of " + std::to_string(count));
      const TempFolder temp;
      put_bytes(temp / name, content);
      const auto file = FrameFile::open(temp / name);
      ASSERT_TRUE(file.ok()) << file.error().message();
      EXPECT_EQ((*file)->pictures(), static_cast<std::int64_t>(count));
      for (const Image& image : images) {
        const Result<Image> read = (*file)->next();
        ASSERT_TRUE(read.ok()) << read.error().message();
        if (!name.ends_with("jpeg") && !name.ends_with("mpo")) {
          EXPECT_EQ(*read, image);
        }
      }
      EXPECT_EQ((*file)->next().error().kind, ErrorKind::out_of_data);
      EXPECT_EQ(scan_video(temp / name)->frames(), static_cast<std::int64_t>(count));
      const Result<Image> only = read_image(temp / name);
      EXPECT_EQ(only.ok(), count == 1);
      if (count > 1) {
        EXPECT_THAT(only.error().message(), HasSubstr(std::to_string(count) + " pictures"));
      }
    }
  }
}

TEST(StillContents, PreviewsAndMasksAreNoFurtherPictures) {
  for (const int subfile : {1, 4, 5}) {
    const Result<StillContents> found = examine_still(tiff_of(pictures(3), {.subfile = subfile}), "a.tif");
    ASSERT_TRUE(found.ok()) << found.error().message();
    EXPECT_THAT(found->pictures, SizeIs(1)) << subfile;
  }
  EXPECT_THAT(examine_still(tiff_of(pictures(2), {.subfile = 2}), "a.tif")->pictures, SizeIs(2)) << "a page";
  for (const std::uint32_t type : {0x000000U, 0x010002U})  // a gain map, a preview
    EXPECT_THAT(examine_still(mpo_of(pictures(2), type), "a.jpg")->pictures, SizeIs(1)) << type;
  const std::string jpeg = encoded(pictures(1)[0], ".jpg");
  EXPECT_THAT(examine_still(jpeg + "a film follows", "a.jpg")->pictures, SizeIs(1))
      << "moving pictures of phones";
}

TEST(StillContents, RefusesPicturesThatItCannotRead) {
  const auto stack = tiff_of(pictures(1), {.description = "ImageJ=1.53\nimages=12\nframes=12\n"});
  EXPECT_THAT(examine_still(stack, "a.tif").error().message(), HasSubstr("12 pictures"));
  std::string png = encoded(pictures(1)[0], ".png");
  Bytes chunk(true);
  chunk.put(8, 4).text += "acTL";
  chunk.put(7, 4).put(0, 4).put(0, 4);
  png.insert(33, chunk.text);
  EXPECT_THAT(examine_still(png, "a.png").error().message(), HasSubstr("7 pictures"));
}

TEST(StillContents, AnOrientationIsReportedAndNotApplied) {
  const Image image = pictures(1)[0];
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const bool big : {false, true}) {
      for (const auto& [name, content] : std::vector<std::pair<std::string, std::string>>{
               {"a.tif", tiff_of({image}, {.big = big, .orientation = orientation})},
               {"a.jpg", with_exif(encoded(image, ".jpg"), orientation, big)}}) {
        SCOPED_TRACE(name + " of orientation " + std::to_string(orientation));
        const TempFolder temp;
        put_bytes(temp / name, content);
        std::vector<std::string> unapplied;
        const Result<Image> read = read_image(temp / name, &unapplied);
        ASSERT_TRUE(read.ok()) << read.error().message();
        EXPECT_EQ(read->layout().size, kPage.size);
        if (name == "a.tif") {
          EXPECT_EQ(*read, image);
        }
        if (orientation == 1) {
          EXPECT_THAT(unapplied, IsEmpty());
        } else {
          ASSERT_THAT(unapplied, SizeIs(1));
          EXPECT_THAT(unapplied[0], HasSubstr("EXIF orientation " + std::to_string(orientation)));
        }
      }
    }
  }
}

TEST(StillContents, APictureTurnedOtherwiseThanTheCamerasFirstIsRefused) {
  const TempFolder temp;
  const std::string jpeg = encoded(pictures(1)[0], ".jpg");
  for (const auto& [first, second] : {std::pair{1, 6}, {6, 1}, {3, 6}, {3, 3}, {1, 1}}) {
    put_bytes(temp / "0.jpg", with_exif(jpeg, first, true));
    put_bytes(temp / "1.jpg", with_exif(jpeg, second, true));
    const VideoScan scan = *scan_video(temp / "0.jpg");
    ClipReader reader({{temp / "0.jpg", scan, 0}, {temp / "1.jpg", scan, 1}}, Colours::keep);
    ASSERT_TRUE(reader.next().ok());
    const Result<Image> next = reader.next();
    EXPECT_EQ(next.ok(), first == second) << first << second;
    if (!next.ok()) {
      EXPECT_THAT(next.error().message(), HasSubstr("1.jpg"));
      EXPECT_THAT(next.error().message(), HasSubstr("EXIF orientation"));
    }
  }
}

}  // namespace
}  // namespace emberlock::session
