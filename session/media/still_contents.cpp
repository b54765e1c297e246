// SPDX-License-Identifier: Apache-2.0
#include "session/media/still_contents.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "session/media/pnm_header.h"

namespace emberlock::session {
namespace {

std::uint32_t byte_of(std::string_view s, std::size_t i) { return static_cast<unsigned char>(s[i]); }
std::uint32_t big_endian16(std::string_view s, std::size_t i) {
  return byte_of(s, i) << 8 | byte_of(s, i + 1);
}
std::uint32_t big_endian32(std::string_view s, std::size_t i) {
  return big_endian16(s, i) << 16 | big_endian16(s, i + 2);
}

/// The directories of a TIFF or BigTIFF, or of the TIFF structure within an EXIF or MPF block. Reads beyond
/// the end give 0.
class TiffReader {
 public:
  explicit TiffReader(std::string_view s)
      : s_(s), big_endian_(!s.empty() && s[0] == 'M'), large_(get16(2) == kBigTiff) {}

  [[nodiscard]] std::uint32_t get16(std::size_t i) const {
    if (i + 2 > s_.size()) return 0;
    return big_endian_ ? big_endian16(s_, i) : byte_of(s_, i + 1) << 8 | byte_of(s_, i);
  }
  [[nodiscard]] std::uint32_t get32(std::size_t i) const {
    return big_endian_ ? get16(i) << 16 | get16(i + 2) : get16(i + 2) << 16 | get16(i);
  }
  [[nodiscard]] std::size_t get64(std::size_t i) const {
    const std::size_t early = get32(i);
    const std::size_t late = get32(i + 4);
    return big_endian_ ? early << 32 | late : late << 32 | early;
  }
  /// Counts and offsets: 4 bytes, 8 in a BigTIFF.
  [[nodiscard]] std::size_t word_bytes() const { return large_ ? 8 : 4; }
  [[nodiscard]] std::size_t word(std::size_t i) const { return large_ ? get64(i) : get32(i); }
  /// Where the offset of the first directory stands.
  [[nodiscard]] std::size_t first_offset() const { return large_ ? 8 : 4; }
  [[nodiscard]] std::size_t first() const { return word(first_offset()); }
  [[nodiscard]] bool has_directory(std::size_t at) const {
    return at <= s_.size() && head_bytes() <= s_.size() - at &&
           entries(at) <= (s_.size() - at - head_bytes()) / entry_bytes();
  }
  [[nodiscard]] std::size_t directory_bytes(std::size_t directory) const {
    return head_bytes() + entry_bytes() * entries(directory);
  }
  /// Offset of a tag's entry in a directory.
  [[nodiscard]] std::optional<std::size_t> entry(std::size_t directory, std::uint32_t tag) const {
    const std::size_t end = directory + directory_bytes(directory);
    for (std::size_t at = directory + head_bytes(); at < end; at += entry_bytes())
      if (get16(at) == tag) return at;
    return {};
  }
  [[nodiscard]] std::size_t count_at(std::size_t entry) const { return word(entry + 4); }
  /// Offset of an entry's values of `bytes` each. If they don't fit into the entry, they stand elsewhere.
  [[nodiscard]] std::size_t values_at(std::size_t entry, std::size_t bytes) const {
    const std::size_t field = entry + 4 + word_bytes();
    return count_at(entry) <= word_bytes() / bytes ? field : word(field);
  }
  /// The first value of a tag.
  [[nodiscard]] std::uint32_t value(std::size_t directory, std::uint32_t tag, std::uint32_t otherwise) const {
    constexpr std::uint32_t kShort = 3;
    constexpr std::uint32_t kLong8 = 16;
    const auto at = entry(directory, tag);
    if (!at) return otherwise;
    const std::uint32_t type = get16(*at + 2);
    if (type == kShort) return get16(values_at(*at, 2));
    if (type != kLong8) return get32(values_at(*at, 4));
    return static_cast<std::uint32_t>(std::min<std::size_t>(get64(values_at(*at, 8)), UINT32_MAX));
  }
  [[nodiscard]] std::string_view text(std::size_t directory, std::uint32_t tag) const {
    const auto at = entry(directory, tag);
    const std::size_t begin = at ? values_at(*at, 1) : s_.size();
    return begin <= s_.size() ? s_.substr(begin, count_at(at.value_or(begin))) : std::string_view();
  }
  [[nodiscard]] std::size_t next(std::size_t directory) const {
    return word(directory + directory_bytes(directory));
  }
  [[nodiscard]] int orientation(std::size_t directory) const {
    const std::uint32_t value = this->value(directory, kOrientation, 1);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }

  static constexpr std::uint32_t kOrientation = 274;
  static constexpr std::uint32_t kBigTiff = 43;

 private:
  [[nodiscard]] std::size_t head_bytes() const { return large_ ? 8 : 2; }
  [[nodiscard]] std::size_t entry_bytes() const { return large_ ? 20 : 12; }
  [[nodiscard]] std::size_t entries(std::size_t directory) const {
    return large_ ? get64(directory) : get16(directory);
  }
  std::string_view s_;
  bool big_endian_;
  bool large_;
};

int exif_orientation(std::string_view tiff) {
  if (!is_tiff(tiff)) return 1;
  const TiffReader reader(tiff);
  return reader.has_directory(reader.first()) ? reader.orientation(reader.first()) : 1;
}

/// The grey value of a PNG's chunk tRNS, as a decoded sample.
std::uint32_t grey_key(std::string_view s, std::size_t chunk) {
  const std::uint32_t depth = byte_of(s, 24);
  const std::uint32_t value = big_endian16(s, chunk + 8);
  return depth < 8 ? value * 255 / ((1U << depth) - 1) : value;
}

/// Walks the chunks of a PNG to its end.
Result<StillContents> examine_png(std::string_view s, const std::string& where) {
  if (s.size() < 33) return truncated_picture(where, "PNG");
  const std::uint32_t colours =
      byte_of(s, 25);  // 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGB and alpha
  StillContents found;
  StillContents::Picture picture{0, s.size(), big_endian32(s, 16), big_endian32(s, 20)};
  picture.is_grey = colours == 4;
  if (colours == 4 || colours == 6) picture.transparency = Transparency::straight;
  for (std::size_t at = 8; at + 12 <= s.size();) {
    const std::string_view chunk = s.substr(at + 4, 4);
    const std::size_t length = big_endian32(s, at);
    if (chunk == "IEND") {
      found.pictures = {picture};
      return found;
    }
    if (length > s.size() - at - 12) break;
    if (chunk == "tRNS" && length >= 2 && colours == 0) {
      picture.transparency = Transparency::grey_key;
      picture.key = grey_key(s, at);
    } else if (chunk == "tRNS" && colours <= 3) {
      picture.transparency = Transparency::straight;
    }
    if (chunk == "eXIf") found.orientation = exif_orientation(s.substr(at + 8, length));
    if (chunk == "acTL" && length >= 4 && big_endian32(s, at + 8) > 1) {
      return Error{ErrorKind::bad_input,
                   fmt::format("the PNG is animated: it holds {} pictures", big_endian32(s, at + 8)), where,
                   "Make a video or single pictures of it"};
    }
    at += 12 + length;
  }
  return truncated_picture(where, "PNG");
}

struct Jpeg {
  std::int64_t width = 0;
  std::int64_t height = 0;
  int orientation = 1;
  bool indexed = false;  ///< an index (MPF) lists what follows: previews and gain maps of the first picture,
  std::vector<std::size_t> views;  ///< or the begins of further pictures
  std::size_t end = 0;             ///< behind the end marker
};

/// The begins of the pictures that an MPF index (CIPA DC-007) lists as further views: of a stereo pair, a
/// panorama or another multi-view set. `block` is its TIFF structure, which begins at byte `base`.
std::vector<std::size_t> views_of(std::string_view block, std::size_t base) {
  constexpr std::uint32_t kPictures = 0xb002;
  constexpr std::uint32_t kMultiView = 2;  // the class in a picture's type
  constexpr std::size_t kEntry = 16;       // bytes: attributes, size, offset, two dependent pictures
  const TiffReader index(block);
  std::vector<std::size_t> views;
  if (!is_tiff(block) || !index.has_directory(index.first())) return views;
  const auto list = index.entry(index.first(), kPictures);
  if (!list) return views;
  const std::size_t from = index.values_at(*list, 1);
  for (std::size_t i = 1; i < index.count_at(*list) / kEntry && from + (i + 1) * kEntry <= block.size();
       ++i) {
    const std::size_t at = from + i * kEntry;
    if ((index.get32(at) >> 16 & 0xff) == kMultiView) views.push_back(base + index.get32(at + 8));
  }
  return views;
}

/// The next marker behind a scan's coded data, in which 0xff is followed by 0 or a restart marker.
std::size_t end_of_scan(std::string_view s, std::size_t at) {
  for (; (at = s.find('\xff', at)) != std::string_view::npos && at + 1 < s.size(); ++at) {
    const std::uint32_t next = byte_of(s, at + 1);
    if (next != 0 && next != 0xff && (next < 0xd0 || next > 0xd7)) return at;
  }
  return s.size();
}

/// Walks the markers of a JPEG to its end.
Result<Jpeg> walk_jpeg(std::string_view s, const std::string& where) {
  Jpeg jpeg;
  bool scanned = false;
  for (std::size_t at = 2; at + 2 <= s.size();) {
    if (byte_of(s, at) != 0xff) return damaged_picture(where, "JPEG", "a marker is missing");
    const std::uint32_t marker = byte_of(s, at + 1);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    if (marker == 0xd9 && scanned) {
      jpeg.end = at + 2;
      return jpeg;
    }
    if (at + 4 > s.size() || marker == 0xd8) break;  // the next picture begins within this one
    const std::size_t length = big_endian16(s, at + 2);
    const std::string_view segment = s.substr(at + 4, std::max<std::size_t>(length, 2) - 2);
    const bool frame_header =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame_header && segment.size() >= 5) {
      jpeg.width = big_endian16(segment, 3);
      jpeg.height = big_endian16(segment, 1);
    }
    if (marker == 0xe1 && segment.starts_with(std::string_view("Exif\0\0", 6)))
      jpeg.orientation = exif_orientation(segment.substr(6));
    if (marker == 0xe2 && segment.starts_with(std::string_view("MPF\0", 4))) {
      jpeg.indexed = true;
      jpeg.views = views_of(segment.substr(4), at + 8);
    }
    at += 2 + length;
    if (marker != 0xda) continue;
    if (jpeg.width == 0) return damaged_picture(where, "JPEG", "no size before the first scan");
    scanned = true;
    at = end_of_scan(s, at);
  }
  return truncated_picture(where, "JPEG");
}

Result<StillContents> examine_jpegs(std::string_view s, const std::string& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Jpeg first, walk_jpeg(s, where));
  StillContents found{{{0, first.end, first.width, first.height}}, first.orientation};
  for (const std::size_t begin : first.views) {
    if (begin >= s.size()) return truncated_picture(where, "MPO");
    if (begin < found.pictures.back().end) return damaged_picture(where, "MPO", "its pictures overlap");
    EMBERLOCK_ASSIGN_OR_RETURN(const Jpeg view, walk_jpeg(s.substr(begin), where));
    found.pictures.push_back({begin, begin + view.end, view.width, view.height});
  }
  if (first.indexed) return found;
  for (;;) {
    const std::size_t begin = s.find_first_not_of('\0', found.pictures.back().end);  // cameras pad buffers
    if (begin == std::string_view::npos || !is_jpeg(s.substr(begin))) return found;
    const Result<Jpeg> next = walk_jpeg(s.substr(begin), where);
    if (!next) {  // the damage is reported when the picture is read
      found.pictures.push_back({begin, s.size(), first.width, first.height});
      return found;
    }
    found.pictures.push_back({begin, begin + next->end, next->width, next->height});
  }
}

/// The number of pictures that ImageJ's description states; beyond 4 GB it writes one directory for all.
std::int64_t imagej_pictures(std::string_view description) {
  constexpr std::string_view kImages = "\nimages=";
  const std::size_t at = description.find(kImages);
  std::int64_t pictures = 1;
  if (!description.starts_with("ImageJ=") || at == std::string_view::npos) return pictures;
  const char* const begin = description.data() + at + kImages.size();
  std::from_chars(begin, description.data() + description.size(), pictures);
  return pictures;
}

/// The meaning of the sample after a TIFF's colours (tag ExtraSamples).
Transparency transparency_of(const TiffReader& tiff, std::size_t page) {
  constexpr std::uint32_t kBits = 258;
  constexpr std::uint32_t kSamples = 277;
  constexpr std::uint32_t kExtraSamples = 338;
  if (tiff.value(page, kSamples, 1) != 4) return Transparency::none;
  const std::uint32_t extra = tiff.value(page, kExtraSamples, 0);
  if (extra != 1 && extra != 2) return Transparency::unnamed;
  // The decoder multiplies samples of 8 bits.
  return extra == 1 || tiff.value(page, kBits, 8) <= 8 ? Transparency::premultiplied : Transparency::straight;
}

Result<StillContents> examine_tiff(std::string_view s, const std::string& where) {
  constexpr std::uint32_t kSubfileType = 254;
  constexpr std::uint32_t kWidth = 256;
  constexpr std::uint32_t kHeight = 257;
  constexpr std::uint32_t kReducedOrMask = 1 | 4;
  constexpr std::uint32_t kDescription = 270;
  constexpr std::uint32_t kSamples = 277;
  const TiffReader tiff(s);
  StillContents found;
  std::set<std::size_t> seen;
  std::size_t at = tiff.first();
  if (s.size() < 8 || !tiff.has_directory(at)) return truncated_picture(where, "TIFF");
  const auto take = [&](std::size_t page) {
    found.pictures.push_back({page, s.size(), tiff.value(page, kWidth, 0), tiff.value(page, kHeight, 0),
                              transparency_of(tiff, page)});
  };
  const std::size_t first = at;
  std::size_t directories = 0;  // bytes
  for (; at != 0 && seen.insert(at).second; at = tiff.next(at)) {
    if (!tiff.has_directory(at)) return truncated_picture(where, "TIFF");
    directories += tiff.directory_bytes(at);
    if (directories > s.size()) return damaged_picture(where, "TIFF", "its directories overlap");
    if (tiff.value(at, kSamples, 1) == 2)
      return Error{ErrorKind::bad_input, "the TIFF has grey and a second sample, which isn't read", where,
                   "Convert it to PNG"};
    if ((tiff.value(at, kSubfileType, 0) & kReducedOrMask) == 0) take(at);
  }
  if (found.pictures.empty()) take(first);
  const std::size_t page = found.pictures.front().begin;
  found.orientation = tiff.orientation(page);
  const std::int64_t stated = imagej_pictures(tiff.text(page, kDescription));
  if (stated > 1 && found.pictures.size() == 1) {
    return Error{ErrorKind::bad_input,
                 fmt::format("the TIFF is a stack of {} pictures by ImageJ, with one directory", stated),
                 where, "Save it as an image sequence"};
  }
  return found;
}

Result<StillContents> examine_pnms(std::string_view s) {
  StillContents found;
  std::size_t begin = 0;
  do {
    const std::size_t end = begin + pnm_size(s.substr(begin)).value_or(s.size() - begin);
    found.pictures.push_back({begin, std::min(end, s.size())});
    begin = found.pictures.back().end;
    while (begin < s.size() && std::isspace(static_cast<unsigned char>(s[begin])) != 0) ++begin;
  } while (is_pnm(s.substr(begin)));
  return found;
}

}  // namespace

Error truncated_picture(const std::string& where, std::string_view kind) {
  return {ErrorKind::bad_input, "the " + std::string(kind) + " is truncated", where,
          "Copy or record it again"};
}
Error damaged_picture(const std::string& where, std::string_view kind, std::string_view reason) {
  return {ErrorKind::bad_input, "the " + std::string(kind) + " is damaged: " + std::string(reason), where,
          "Copy or record it again"};
}

bool is_pnm(std::string_view content) {
  return content.size() > 2 && content[0] == 'P' && content[1] >= '1' && content[1] <= '6' &&
         (std::isspace(static_cast<unsigned char>(content[2])) != 0 || content[2] == '#');
}
bool is_png(std::string_view content) { return content.starts_with("\x89PNG\r\n\x1a\n"); }
bool is_jpeg(std::string_view content) { return content.starts_with("\xff\xd8\xff"); }
bool is_tiff(std::string_view content) {
  // The last two are BigTIFF, with offsets of 8 bytes.
  constexpr std::array<std::string_view, 4> kMagic = {
      {{"II*\0", 4}, {"MM\0*", 4}, {"II+\0\b\0\0\0", 8}, {"MM\0+\0\b\0\0", 8}}};
  return std::any_of(kMagic.begin(), kMagic.end(), [&](auto magic) { return content.starts_with(magic); });
}

Result<StillContents> examine_still(std::string_view content, const std::string& where) {
  if (is_png(content)) return examine_png(content, where);
  if (is_jpeg(content)) return examine_jpegs(content, where);
  if (is_tiff(content)) return examine_tiff(content, where);
  return examine_pnms(content);
}

Status check_jpeg(std::string_view content, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(walk_jpeg(content, where));
  return {};
}

void select_tiff_page(std::string& content, const StillContents::Picture& page) {
  const bool big = content[0] == 'M';
  const auto put = [&](std::size_t at, std::size_t bytes, std::size_t value) {
    for (std::size_t i = 0; i < bytes; ++i)
      content[at + i] = static_cast<char>(value >> 8 * (big ? bytes - 1 - i : i) & 0xff);
  };
  const TiffReader tiff(content);
  put(tiff.first_offset(), tiff.word_bytes(), page.begin);
  // OpenCV turns TIFFs even where it is asked for the stored rows.
  if (const auto entry = tiff.entry(page.begin, TiffReader::kOrientation))
    put(tiff.values_at(*entry, 2), 2, 1);
}

}  // namespace emberlock::session
