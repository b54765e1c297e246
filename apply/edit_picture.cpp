// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "base/random.h"
#include "recon/preprocess/radiance.h"
#include "session/index.h"
#include "session/media/frame_file.h"

namespace emberlock::apply {
namespace {

constexpr float kOpaque = 255;

Result<std::vector<float>> read_grey(const std::filesystem::path& file, ImageSize& size) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Image image, session::read_image(file));
  const recon::RadianceImage picture = recon::to_radiance(image.view());
  size = picture.size;
  std::vector<float> grey(picture.rgb.size() / 3);
  for (std::size_t p = 0; p < grey.size(); ++p) {
    const float* c = &picture.rgb[3 * p];
    grey[p] = 0.299F * c[0] + 0.587F * c[1] + 0.114F * c[2];
  }
  return grey;
}

/// Pixels [x0, x1) x [y0, y1) of a picture that lie around these points.
struct Around {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  Around(const std::vector<Eigen::Vector2d>& points, double margin, ImageSize size) {
    Eigen::Vector2d low = points.front();
    Eigen::Vector2d high = points.front();
    for (const Eigen::Vector2d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const auto within = [](double at, int most) {
      return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(most)));
    };
    x0 = within(std::floor(low.x() - margin), size.width);
    y0 = within(std::floor(low.y() - margin), size.height);
    x1 = within(std::ceil(high.x() + margin), size.width);
    y1 = within(std::ceil(high.y() + margin), size.height);
  }
  template <class Act>
  void each(const Act& act) const {
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) act(x, y);
  }
};

float* pixel_at(recon::RadianceImage& image, int x, int y) {
  return &image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                         static_cast<std::size_t>(x))];
}

/// An object's picture, seen from a view's.
class PlacedObject {
 public:
  PlacedObject(const ObjectEdit& edit, const ObjectPicture& picture)
      : edit_(edit),
        picture_(picture),
        object_from_view_(Eigen::Rotation2Dd(-edit.rotation * std::numbers::pi / 180).toRotationMatrix() /
                          edit.scale),
        middle_(0.5 * picture.size.width, 0.5 * picture.size.height),
        finer_(std::clamp(static_cast<int>(std::ceil(1 / edit.scale)), 1, 8)) {}

  [[nodiscard]] std::vector<Eigen::Vector2d> corners() const {
    std::vector<Eigen::Vector2d> corners;
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0})
        corners.emplace_back(edit_.position + object_from_view_.inverse() *
                                                  Eigen::Vector2d(sx * middle_.x(), sy * middle_.y()));
    return corners;
  }
  /// What a pixel of the view shows of it: the means over its parts.
  struct Shown {
    float grey = 0;
    float opacity = 0;
  };
  [[nodiscard]] Shown at(int x, int y) const {
    Shown sum;
    for (int j = 0; j < finer_; ++j)
      for (int i = 0; i < finer_; ++i) {
        const Eigen::Vector2d place(x + (i + 0.5) / finer_, y + (j + 0.5) / finer_);
        const Shown part = sample(object_from_view_ * (place - edit_.position) + middle_);
        sum.grey += part.opacity * part.grey;
        sum.opacity += part.opacity;
      }
    if (!(sum.opacity > 0)) return {};
    return {sum.grey / sum.opacity, sum.opacity / static_cast<float>(finer_ * finer_)};
  }

 private:
  /// Linear between the centres of its pixels; nothing outside of it.
  [[nodiscard]] Shown sample(const Eigen::Vector2d& at) const {
    const ImageSize size = picture_.size;
    if (!(at.x() >= 0 && at.x() < size.width && at.y() >= 0 && at.y() < size.height)) return {};
    const double u = std::clamp(at.x() - 0.5, 0.0, size.width - 1.0);
    const double v = std::clamp(at.y() - 0.5, 0.0, size.height - 1.0);
    const int i = std::min(static_cast<int>(u), std::max(0, size.width - 2));
    const int j = std::min(static_cast<int>(v), std::max(0, size.height - 2));
    const auto between = [&](const std::vector<float>& values) {
      const auto value = [&](int x, int y) {
        return static_cast<double>(values[static_cast<std::size_t>(std::min(y, size.height - 1)) *
                                              static_cast<std::size_t>(size.width) +
                                          static_cast<std::size_t>(std::min(x, size.width - 1))]);
      };
      const double a = u - i;
      const double b = v - j;
      return static_cast<float>((1 - b) * ((1 - a) * value(i, j) + a * value(i + 1, j)) +
                                b * ((1 - a) * value(i, j + 1) + a * value(i + 1, j + 1)));
    };
    return {between(picture_.grey), picture_.opacity.empty() ? 1.F : between(picture_.opacity)};
  }

  const ObjectEdit& edit_;
  const ObjectPicture& picture_;
  Eigen::Matrix2d object_from_view_;
  Eigen::Vector2d middle_;
  int finer_;  // parts of a pixel along each side
};

float combined(float flame, float green, Combine how) {
  if (how == Combine::max) return std::max(flame, green);
  return how == Combine::over ? green : flame + green;
}

void put_object(recon::RadianceImage& image, const ObjectEdit& edit, const ObjectPicture& picture) {
  const PlacedObject placed(edit, picture);
  Around(placed.corners(), 1, image.size).each([&](int x, int y) {
    const PlacedObject::Shown shown = placed.at(x, y);
    const float opacity = static_cast<float>(edit.opacity) * shown.opacity;
    if (!(opacity > 0)) return;
    const float green[3] = {0, static_cast<float>(edit.strength) * shown.grey, 0};
    float* c = pixel_at(image, x, y);
    for (int channel = 0; channel < 3; ++channel) {
      const float full = combined(c[channel], green[channel], edit.combine);
      c[channel] = opacity < 1 ? c[channel] + opacity * (full - c[channel]) : full;
    }
  });
}

double distance_to(const std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& place) {
  double least = (place - line.front()).squaredNorm();
  for (std::size_t n = 1; n < line.size(); ++n) {
    const Eigen::Vector2d along = line[n] - line[n - 1];
    const double length = along.squaredNorm();
    const double t = length > 0 ? std::clamp((place - line[n - 1]).dot(along) / length, 0.0, 1.0) : 0.0;
    least = std::min(least, (line[n - 1] + t * along - place).squaredNorm());
  }
  return std::sqrt(least);
}

/// 1 up to half of the radius, and then down to 0 smoothly.
double softness(double distance, double radius) {
  const double t = std::clamp(2 * (1 - distance / radius), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

void paint(recon::RadianceImage& image, const BrushEdit& brush) {
  Around(brush.points, brush.radius, image.size).each([&](int x, int y) {
    const auto much =
        static_cast<float>(softness(distance_to(brush.points, {x + 0.5, y + 0.5}), brush.radius));
    if (!(much > 0)) return;
    const float by = much * static_cast<float>(brush.strength);
    float* c = pixel_at(image, x, y);
    for (int channel = 0; channel < 3; ++channel) {
      if (brush.mode == BrushEdit::Mode::add) c[channel] += by;
      if (brush.mode == BrushEdit::Mode::subtract)
        c[channel] = std::min(c[channel], std::max(0.F, c[channel] - by));
      if (brush.mode == BrushEdit::Mode::erase) c[channel] *= 1 - much;
    }
  });
}

/// By how often a line to the right crosses the polygon (even-odd rule).
bool is_within(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& place) {
  bool inside = false;
  for (std::size_t a = 0, b = polygon.size() - 1; a < polygon.size(); b = a++) {
    const Eigen::Vector2d& p = polygon[a];
    const Eigen::Vector2d& q = polygon[b];
    if ((p.y() > place.y()) == (q.y() > place.y())) continue;
    if (place.x() < p.x() + (q.x() - p.x()) * (place.y() - p.y()) / (q.y() - p.y())) inside = !inside;
  }
  return inside;
}

void mask_out(recon::RadianceImage& image, const MaskEdit& mask) {
  for (int y = 0; y < image.size.height; ++y)
    for (int x = 0; x < image.size.width; ++x)
      if (is_within(mask.polygon, {x + 0.5, y + 0.5}) != (mask.part == Part::keep))
        std::fill_n(pixel_at(image, x, y), 3, 0.F);
}

}  // namespace

Result<ObjectPicture> load_object(const ObjectEdit& object) {
  ObjectPicture picture;
  EMBERLOCK_ASSIGN_OR_RETURN(picture.grey, read_grey(object.file, picture.size));
  std::uint64_t hash = session::pixel_hash(std::as_bytes(std::span(picture.grey)));
  if (object.mask) {
    ImageSize size;
    EMBERLOCK_ASSIGN_OR_RETURN(picture.opacity, read_grey(*object.mask, size));
    if (!(size == picture.size))
      return Error{ErrorKind::bad_input, "isn't of its picture's size", object.mask->string(),
                   fmt::format("Give {} x {} pixels", picture.size.width, picture.size.height)};
    hash = mix64(hash) ^ session::pixel_hash(std::as_bytes(std::span(picture.opacity)));
    for (float& value : picture.opacity) value /= kOpaque;
  }
  picture.hash = fmt::format("{:016x}", hash);
  if (!object.hash.empty() && object.hash != picture.hash)
    return Error{ErrorKind::bad_input, "shows something else than when it was recorded", object.file.string(),
                 "Give the picture of then, or leave its hash away"};
  return picture;
}

const std::string* view_of(const Operation& operation) {
  if (const auto* object = std::get_if<ObjectEdit>(&operation)) return &object->view;
  if (const auto* brush = std::get_if<BrushEdit>(&operation)) return &brush->view;
  if (const auto* mask = std::get_if<MaskEdit>(&operation)) return &mask->view;
  return nullptr;
}

recon::SharedImage edited_picture(const recon::SharedImage& captured, const std::string& view,
                                  const std::vector<const Operation*>& operations, const FindObject& object) {
  const auto concerns = [&](const Operation* o) {
    const std::string* const of = view_of(*o);
    return of != nullptr && *of == view;
  };
  if (std::none_of(operations.begin(), operations.end(), concerns)) return captured;
  recon::RadianceImage image = *captured;
  for (const Operation* operation : operations) {
    if (!concerns(operation)) continue;
    if (const auto* put = std::get_if<ObjectEdit>(operation)) put_object(image, *put, object(*put));
    if (const auto* brush = std::get_if<BrushEdit>(operation)) paint(image, *brush);
    if (const auto* mask = std::get_if<MaskEdit>(operation)) mask_out(image, *mask);
  }
  return recon::share(std::move(image));
}

}  // namespace emberlock::apply
