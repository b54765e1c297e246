// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cstring>

#include <fmt/format.h>

#include "recon/calibrate/calibration_fields.h"
#include "recon/calibrate/colmap_model.h"
#include "recon/calibrate/rig_formats.h"

// The layout is that of COLMAP's documentation ("Output Format", binary) and of its scripts/python/
// read_write_model.py: little-endian, without padding.
namespace emberlock::recon {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kBytesOfPoint = 24;  // x, y and the number of the 3D point

/// Reads a file's bytes from the front. Once they end, everything is 0 and ended() is true.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  template <class T>
  T next() {
    T value{};
    if (const std::string_view taken = take(sizeof(T)); !taken.empty())
      std::memcpy(&value, taken.data(), sizeof(T));
    return value;
  }
  std::string next_text() {
    const std::size_t end = bytes_.find('\0');
    ended_ = ended_ || end == std::string_view::npos;
    return ended_ ? std::string() : std::string(take(end + 1).substr(0, end));
  }
  void skip_points(std::uint64_t count) {
    if (count > bytes_.size() / kBytesOfPoint) {
      ended_ = true;
    } else {
      bytes_.remove_prefix(static_cast<std::size_t>(count) * kBytesOfPoint);
    }
  }

 private:
  std::string_view take(std::size_t count) {
    ended_ = ended_ || bytes_.size() < count;
    if (ended_) return {};
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  std::string_view bytes_;
  bool ended_ = false;
};

Error bad_binary(std::string where, std::string what) {
  return {ErrorKind::bad_input, std::move(what), std::move(where),
          "Export the model again, or write text with `colmap model_converter --output_type TXT`"};
}

Result<ColmapCamera> next_camera(ByteReader& reader, const std::string& where) {
  ColmapCamera camera{where, std::to_string(reader.next<std::uint32_t>()), {}, {}};
  const auto number = reader.next<std::int32_t>();
  for (int side = 0; side < 2; ++side)
    camera.numbers.push_back(static_cast<double>(reader.next<std::uint64_t>()));
  if (number < 0 || static_cast<std::size_t>(number) >= kColmapLenses.size())
    return bad_binary(where, fmt::format("the camera model {} isn't known", number));
  const ColmapLens& lens = kColmapLenses[static_cast<std::size_t>(number)];
  camera.model = lens.name;
  for (std::size_t i = 0; i < lens.parameters; ++i) camera.numbers.push_back(reader.next<double>());
  return camera;
}

ColmapImage next_image(ByteReader& reader, const std::string& where) {
  ColmapImage image;
  image.where = fmt::format("{}, image {}", where, reader.next<std::uint32_t>());
  for (double& number : image.pose) number = reader.next<double>();
  image.camera = std::to_string(reader.next<std::uint32_t>());
  image.name = reader.next_text();
  reader.skip_points(reader.next<std::uint64_t>());
  return image;
}

Status check_end(const ByteReader& reader, const std::string& where) {
  if (reader.ended()) return bad_binary(where, "ends too early");
  if (!reader.empty()) return bad_binary(where, "is longer than its number of entries");
  return {};
}

}  // namespace

Result<v1::Rig> parse_colmap_binary(std::string_view cameras, std::string_view images,
                                    const std::string& where, ImportNotes* notes) {
  ColmapModel model;
  ByteReader lenses(cameras);
  const std::string cameras_file = where + "/cameras.bin";
  const auto lens_count = lenses.next<std::uint64_t>();
  for (std::uint64_t i = 0; i < lens_count && !lenses.ended(); ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(ColmapCamera camera,
                               next_camera(lenses, fmt::format("{}, camera {}", cameras_file, i + 1)));
    model.cameras.push_back(std::move(camera));
  }
  EMBERLOCK_RETURN_IF_ERROR(check_end(lenses, cameras_file));
  ByteReader views(images);
  const std::string images_file = where + "/images.bin";
  const auto view_count = views.next<std::uint64_t>();
  for (std::uint64_t i = 0; i < view_count && !views.ended(); ++i)
    model.images.push_back(next_image(views, images_file));
  EMBERLOCK_RETURN_IF_ERROR(check_end(views, images_file));
  return rig_of_colmap(model, images_file, notes);
}

}  // namespace emberlock::recon
