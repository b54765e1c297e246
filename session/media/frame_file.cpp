// SPDX-License-Identifier: Apache-2.0
#include "session/media/frame_file.h"

#include <array>
#include <cerrno>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/kind_of_file.h"
#include "base/unique_fd.h"
#include "session/layout.h"
#include "session/media/frame_decoders.h"

namespace emberlock::session {
namespace {

std::string turned_by(int orientation) {
  constexpr std::array<const char*, 9> kTurns{"",
                                              "",
                                              "mirrored",
                                              "turned by 180 degrees",
                                              "mirrored upside down",
                                              "mirrored and turned by 90",
                                              "turned by 90 degrees",
                                              "mirrored and turned by 270",
                                              "turned by 270 degrees"};
  return kTurns.at(static_cast<std::size_t>(orientation));
}

class StillFile final : public FrameFile {
 public:
  StillFile(std::string content, StillContents found, std::string where)
      : content_(std::move(content)), found_(std::move(found)), where_(std::move(where)) {}

  /// Decodes the first picture, so that opening fails where it is damaged.
  Status begin() {
    EMBERLOCK_ASSIGN_OR_RETURN(first_, decode());
    at_ = 0;
    if (pictures() == 1) content_ = {};
    return {};
  }
  Result<Image> next() override {
    if (at_ >= found_.pictures.size()) return ended();
    if (at_ > 0 || !first_) return decode();
    ++at_;
    Image image = std::move(*first_);
    first_.reset();
    return image;
  }
  Status skip(std::int64_t frames) override {
    if (frames > pictures() - static_cast<std::int64_t>(at_)) return ended();
    at_ += static_cast<std::size_t>(frames);
    return {};
  }
  [[nodiscard]] VideoClaims claims() const override {
    return pictures() > 1 ? VideoClaims{{}, pictures()} : VideoClaims{};
  }
  [[nodiscard]] std::int64_t pictures() const override {
    return static_cast<std::int64_t>(found_.pictures.size());
  }
  [[nodiscard]] std::vector<std::string> unapplied() const override {
    if (found_.orientation == 1) return {};
    return {"EXIF orientation " + std::to_string(found_.orientation) + " (" + turned_by(found_.orientation) +
            ") isn't applied"};
  }

 private:
  Result<Image> decode() {
    const std::string where = pictures() == 1 ? where_ : where_ + ", picture " + std::to_string(at_);
    ++at_;
    if (is_fits(content_)) return decode_fits(content_, where);
    return decode_picture(content_, found_.pictures[at_ - 1], where);
  }
  [[nodiscard]] Error ended() const { return {ErrorKind::out_of_data, "holds no more pictures", where_}; }

  std::string content_;
  StillContents found_;
  std::string where_;
  std::optional<Image> first_{};  ///< until it is returned
  std::size_t at_ = 0;
};

Result<std::string> read_head(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd fd, open_regular_file(path));
  std::array<char, 32> head{};
  const ssize_t n = ::read(fd.get(), head.data(), head.size());
  if (n < 0) {
    return Error{ErrorKind::io, "cannot read: " + std::generic_category().message(errno), path.string()};
  }
  if (n == 0)
    return Error{ErrorKind::bad_input, "the file is empty", path.string(), "Record or copy it again"};
  return std::string(head.data(), static_cast<std::size_t>(n));
}

Result<std::unique_ptr<FrameFile>> open_still(std::string_view head, const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string content, read_file(path));
  StillContents found{{{0, content.size()}}};
  if (!is_fits(head)) {
    EMBERLOCK_ASSIGN_OR_RETURN(found, examine_still(content, path.string()));
  }
  auto file = std::make_unique<StillFile>(std::move(content), std::move(found), path.string());
  EMBERLOCK_RETURN_IF_ERROR(file->begin());
  return std::unique_ptr<FrameFile>(std::move(file));
}

}  // namespace

Status check_image_size(std::int64_t width, std::int64_t height, const std::string& where) {
  if (width >= 1 && height >= 1 && width <= kMaxImageSide && height <= kMaxImageSide) return {};
  return Error{ErrorKind::bad_input,
               "an image of " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels is outside 1.." + std::to_string(kMaxImageSide) + " a side",
               where, "Crop it, or check that the file isn't damaged"};
}

Status FrameFile::seek(std::int64_t /*ticks*/) {
  return Error{ErrorKind::bad_input, "a picture has no other frames", "seek", "Name a video"};
}

Result<std::unique_ptr<FrameFile>> FrameFile::open(const std::filesystem::path& path, Colours colours) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string head, read_head(path));
  if (!is_fits(head) && !is_still_image(head)) return open_video(path, colours);
  return open_still(head, path);
}

Result<Image> read_image(const std::filesystem::path& path, std::vector<std::string>* unapplied) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string head, read_head(path));
  if (!is_fits(head) && !is_still_image(head)) {
    return Error{ErrorKind::bad_input, "not an image (known are PGM, PPM, PNG, JPEG, TIFF and FITS)",
                 path.string(), "Convert it, or name it where videos are taken"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::unique_ptr<FrameFile> file, open_still(head, path));
  if (file->pictures() > 1) {
    return Error{ErrorKind::bad_input,
                 "holds " + std::to_string(file->pictures()) + " pictures, where one is expected",
                 path.string(), "Split it into one file for each picture"};
  }
  if (unapplied != nullptr) *unapplied = file->unapplied();
  return file->next();
}

}  // namespace emberlock::session
