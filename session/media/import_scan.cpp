// SPDX-License-Identifier: Apache-2.0
#include "session/media/import_scan.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <regex>
#include <set>
#include <system_error>
#include <tuple>

#include "session/media/frame_file.h"
#include "session/name.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

enum class FileKind { video, picture, other };

/// The extension in lower case, with its point.
std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

FileKind kind_of(const fs::path& path) {
  constexpr std::array<std::string_view, 11> kPictures{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".pgm",
                                                       ".ppm", ".pnm", ".fits", ".fit", ".fts"};
  constexpr std::array<std::string_view, 17> kOthers{"",     ".txt", ".md",   ".csv",  ".json", ".xml",
                                                     ".thm", ".lrv", ".html", ".pdf",  ".log",  ".yaml",
                                                     ".yml", ".wav", ".mp3",  ".toml", ".cr2"};
  const std::string ending = ending_of(path);
  const auto among = [&](const auto& list) {
    return std::find(list.begin(), list.end(), ending) != list.end();
  };
  if (among(kPictures)) return FileKind::picture;
  return among(kOthers) ? FileKind::other : FileKind::video;
}

std::size_t digits_from(std::string_view text, std::size_t at) {
  std::size_t end = at;
  while (end < text.size() && is_digit(text[end])) ++end;
  return end - at;
}

std::optional<std::int64_t> last_number(const std::string& stem) {
  constexpr std::size_t kMostDigits = 15;
  std::size_t end = stem.size();
  while (end > 0 && !is_digit(stem[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && is_digit(stem[begin - 1]) && end - begin < kMostDigits) --begin;
  if (begin == end) return {};
  return std::stoll(stem.substr(begin, end - begin));
}

/// Whether a TIFF holds several pictures.
bool is_stack(const fs::path& file) {
  if (const std::string ending = ending_of(file); ending != ".tif" && ending != ".tiff") return false;
  const auto opened = FrameFile::open(file);
  return opened.ok() && (*opened)->pictures() > 1;
}

/// A recording's chapters follow one another; in natural order those of all recordings would alternate.
void sort_chapters(std::vector<fs::path>& files) {
  const auto is_chapter = [](const fs::path& file) { return gopro_chapter(file).has_value(); };
  if (!std::all_of(files.begin(), files.end(), is_chapter)) return;
  std::stable_sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const auto one = gopro_chapter(a);
    const auto other = gopro_chapter(b);
    return std::tie(one->recording, one->chapter) < std::tie(other->recording, other->chapter);
  });
}

bool hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

/// All files below a folder, at any depth: camera cards store films in folders like DCIM/100CANON.
Result<std::vector<fs::path>> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec)) {
    if (hidden(at->path())) {
      if (at->is_directory(ec)) at.disable_recursion_pending();
    } else if (at->is_regular_file(ec)) {
      files.push_back(at->path());
    }
  }
  if (ec) return Error{ErrorKind::io, "cannot list the folder: " + ec.message(), folder.string()};
  std::sort(files.begin(), files.end(),
            [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
  return files;
}

class Scan {
 public:
  Scan(fs::path folder, const FolderScanOptions& options) : folder_(std::move(folder)), options_(options) {}

  void take_file(const fs::path& file) {
    if (left_out(file)) return;
    CameraFiles camera{file.stem().string(), relative(file), CameraFiles::Kind::video, {file}, {}};
    if (is_stack(file)) {
      camera.kind = CameraFiles::Kind::pictures;
      camera.numbers = {0};
    } else if (kind_of(file) != FileKind::video) {
      return pass_over(file);
    }
    found_.cameras.push_back(std::move(camera));
  }

  Status take_subfolder(const fs::path& folder) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<fs::path> files, files_below(folder));
    CameraFiles videos{folder.filename().string(), relative(folder), CameraFiles::Kind::video, {}, {}};
    CameraFiles pictures = videos;
    pictures.kind = CameraFiles::Kind::pictures;
    for (const fs::path& file : files) {
      if (left_out(file)) continue;
      const FileKind kind = kind_of(file);
      if (kind == FileKind::other) pass_over(file);
      if (kind == FileKind::video) videos.files.push_back(file);
      if (kind == FileKind::picture) pictures.files.push_back(file);
    }
    if (!videos.files.empty()) {
      sort_chapters(videos.files);
      for (const fs::path& picture : pictures.files) pass_over(picture);
      found_.cameras.push_back(std::move(videos));
    } else if (!pictures.files.empty()) {
      EMBERLOCK_RETURN_IF_ERROR(number(pictures));
      found_.cameras.push_back(std::move(pictures));
    }
    return {};
  }

  Result<FolderScan> finish() {
    EMBERLOCK_RETURN_IF_ERROR(rename());
    std::sort(found_.cameras.begin(), found_.cameras.end(),
              [](const CameraFiles& a, const CameraFiles& b) { return natural_less(a.id, b.id); });
    if (found_.cameras.empty()) {
      return Error{ErrorKind::bad_input, "holds no video files and no folders of pictures", folder_.string(),
                   "Put a video file for each camera into it, or a folder for each"};
    }
    return std::move(found_);
  }

 private:
  [[nodiscard]] std::string relative(const fs::path& path) const {
    return path.lexically_relative(folder_).generic_string();
  }
  void pass_over(const fs::path& file) { found_.passed_over.push_back(relative(file)); }
  [[nodiscard]] bool left_out(const fs::path& file) const {
    std::error_code ec;
    return std::any_of(options_.without.begin(), options_.without.end(),
                       [&](const fs::path& other) { return fs::equivalent(file, other, ec); });
  }

  Status number(CameraFiles& pictures) const {
    std::map<std::int64_t, fs::path> by_number;
    for (const fs::path& file : pictures.files) {
      auto number = last_number(file.stem().string());
      if (!number && pictures.files.size() == 1 && is_stack(file)) number = 0;
      if (!number) {
        return Error{ErrorKind::bad_input, "the picture's name has no number", file.string(),
                     "Number the pictures by their instants, alike for all cameras"};
      }
      if (const auto [there, added] = by_number.emplace(*number, file); !added) {
        return Error{ErrorKind::bad_input, "has the same number as " + there->second.filename().string(),
                     file.string(), "Leave one of them out"};
      }
    }
    pictures.files.clear();
    for (const auto& [number, file] : by_number) {
      pictures.numbers.push_back(number);
      pictures.files.push_back(file);
    }
    return {};
  }

  Status rename() {
    std::map<std::string, std::string> wanted = options_.ids;
    std::set<std::string> ids;
    for (CameraFiles& camera : found_.cameras) {
      if (const auto other = wanted.find(camera.name); other != wanted.end()) {
        camera.id = other->second;
        wanted.erase(other);
      }
      if (!is_folder_name(camera.id)) {
        return Error{ErrorKind::bad_input, "'" + camera.id + "' can't be a camera's id",
                     (folder_ / camera.name).string(),
                     "Give it one of letters, digits, space and . _ : -, with --camera ID=" + camera.name};
      }
      if (!ids.insert(camera.id).second) {
        return Error{ErrorKind::bad_input, "two cameras would be called '" + camera.id + "'",
                     (folder_ / camera.name).string(), "Tell them apart with --camera ID=" + camera.name};
      }
    }
    if (wanted.empty()) return {};
    return Error{ErrorKind::bad_input, "the folder holds no film of this name",
                 (folder_ / wanted.begin()->first).string(), "Name a video file or subfolder of it"};
  }

  fs::path folder_;
  const FolderScanOptions& options_;
  FolderScan found_;
};

}  // namespace

std::optional<GoProChapter> gopro_chapter(const fs::path& file) {
  static const std::regex kName("G(?:OPR|[HXP]([0-9A-Z]{2}))([0-9]{4})", std::regex::icase);
  std::smatch parts;
  const std::string stem = file.stem().string();
  if (!std::regex_match(stem, parts, kName)) return {};
  return GoProChapter{parts[2], parts[1]};
}

bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      while (i + 1 < a.size() && a[i] == '0' && is_digit(a[i + 1])) ++i;
      while (j + 1 < b.size() && b[j] == '0' && is_digit(b[j + 1])) ++j;
      const std::size_t m = digits_from(a, i);
      const std::size_t n = digits_from(b, j);
      if (m != n) return m < n;
      if (const int order = a.substr(i, m).compare(b.substr(j, n)); order != 0) return order < 0;
      i += m;
      j += n;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

Result<FolderScan> scan_folder(const fs::path& folder, const FolderScanOptions& options) {
  std::error_code ec;
  if (!fs::is_directory(folder, ec)) {
    return Error{ErrorKind::bad_input, "isn't a folder", folder.string(),
                 "Name the folder that holds the cameras' films"};
  }
  Scan scan(folder, options);
  for (fs::directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec)) {
    if (hidden(at->path())) continue;
    if (at->is_directory(ec)) EMBERLOCK_RETURN_IF_ERROR(scan.take_subfolder(at->path()));
    if (at->is_regular_file(ec)) scan.take_file(at->path());
  }
  if (ec) return Error{ErrorKind::io, "cannot list the folder: " + ec.message(), folder.string()};
  return scan.finish();
}

}  // namespace emberlock::session
