// SPDX-License-Identifier: Apache-2.0
#include "session/media/frame_file.h"

#include <array>
#include <cerrno>
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

class ImageFile final : public FrameFile {
 public:
  ImageFile(Image image, std::string where) : image_(std::move(image)), where_(std::move(where)) {}
  Result<Image> next() override {
    if (std::exchange(read_, true)) return Error{ErrorKind::out_of_data, "holds one image only", where_};
    return std::move(image_);
  }

 private:
  Image image_;
  std::string where_;
  bool read_ = false;
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

Result<Image> decode_image(std::string_view head, const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string content, read_file(path));
  return is_fits(head) ? decode_fits(content, path.string()) : decode_still_image(content, path.string());
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
  EMBERLOCK_ASSIGN_OR_RETURN(Image image, decode_image(head, path));
  return std::unique_ptr<FrameFile>(std::make_unique<ImageFile>(std::move(image), path.string()));
}

Result<Image> read_image(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string head, read_head(path));
  if (is_fits(head) || is_still_image(head)) return decode_image(head, path);
  return Error{ErrorKind::bad_input, "not an image (known are PGM, PPM, PNG, JPEG, TIFF and FITS)",
               path.string(), "Convert it, or name it where videos are taken"};
}

}  // namespace emberlock::session
