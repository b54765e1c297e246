// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/markers.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "recon/calibrate/marker_dictionary.h"

namespace emberlock::recon {
namespace {

constexpr std::array<std::pair<const char*, cv::aruco::PREDEFINED_DICTIONARY_NAME>, 17> kDictionaries = {{
    {"4X4_50", cv::aruco::DICT_4X4_50},
    {"4X4_100", cv::aruco::DICT_4X4_100},
    {"4X4_250", cv::aruco::DICT_4X4_250},
    {"4X4_1000", cv::aruco::DICT_4X4_1000},
    {"5X5_50", cv::aruco::DICT_5X5_50},
    {"5X5_100", cv::aruco::DICT_5X5_100},
    {"5X5_250", cv::aruco::DICT_5X5_250},
    {"5X5_1000", cv::aruco::DICT_5X5_1000},
    {"6X6_50", cv::aruco::DICT_6X6_50},
    {"6X6_100", cv::aruco::DICT_6X6_100},
    {"6X6_250", cv::aruco::DICT_6X6_250},
    {"6X6_1000", cv::aruco::DICT_6X6_1000},
    {"7X7_50", cv::aruco::DICT_7X7_50},
    {"7X7_100", cv::aruco::DICT_7X7_100},
    {"7X7_250", cv::aruco::DICT_7X7_250},
    {"7X7_1000", cv::aruco::DICT_7X7_1000},
    {"ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
}};

/// A grey picture's light between pixels; coordinates count from the centre of the first pixel.
class Brightness {
 public:
  Brightness(const cv::Mat& grey, const std::array<float, 256>* light) : grey_(grey), light_(light) {}
  [[nodiscard]] bool covers(const Eigen::Vector2d& p) const {
    return p.x() >= 0 && p.y() >= 0 && p.x() < grey_.cols - 1 && p.y() < grey_.rows - 1;
  }
  [[nodiscard]] double at(const Eigen::Vector2d& p) const {
    const auto x = static_cast<int>(p.x());
    const auto y = static_cast<int>(p.y());
    const double fx = p.x() - x;
    const double fy = p.y() - y;
    return (1 - fy) * ((1 - fx) * of(x, y) + fx * of(x + 1, y)) +
           fy * ((1 - fx) * of(x, y + 1) + fx * of(x + 1, y + 1));
  }

 private:
  [[nodiscard]] double of(int x, int y) const {
    const std::uint8_t level = grey_.at<std::uint8_t>(y, x);
    return light_ != nullptr ? static_cast<double>((*light_)[level]) : level;
  }
  const cv::Mat& grey_;
  const std::array<float, 256>* light_;
};

/// Where brightness first crosses half way between a border's black and the brightest around it, along
/// `outwards` (unit length) from a place near a side, pixels. It is searched from `inside` pixels within the
/// place, which must lie in the border, to `outside` beyond it. Nothing where it doesn't get brighter.
std::optional<double> crossing(const Brightness& picture, const Eigen::Vector2d& place,
                               const Eigen::Vector2d& outwards, double inside, double outside) {
  constexpr double kStep = 0.25;
  if (!picture.covers(place - inside * outwards) || !picture.covers(place + outside * outwards)) return {};
  std::vector<double> levels;
  for (double at = -inside; at <= outside; at += kStep) levels.push_back(picture.at(place + at * outwards));
  const double dark = (levels[0] + levels[1]) / 2;
  double bright = dark;
  for (std::size_t i = 1; i < levels.size(); ++i) bright = std::max(bright, (levels[i - 1] + levels[i]) / 2);
  const double middle = (dark + bright) / 2;
  for (std::size_t i = 1; i < levels.size(); ++i) {
    const double a = levels[i - 1];
    const double b = levels[i];
    if (a <= middle && b > middle)
      return (static_cast<double>(i - 1) + (middle - a) / (b - a)) * kStep - inside;
  }
  return {};
}

/// A line n . p = c in the undistorted picture.
struct SideLine {
  Eigen::Vector2d normal;
  double offset = 0;
};

/// Through most of the places: those farther away than twice the middle distance are left out once.
std::optional<SideLine> line_through(const std::vector<Eigen::Vector2d>& places) {
  constexpr std::size_t kFewest = 4;
  std::vector<Eigen::Vector2d> kept = places;
  SideLine line;
  for (int round = 0; round < 2; ++round) {
    if (kept.size() < kFewest) return {};
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : kept) middle += p / static_cast<double>(kept.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const Eigen::Vector2d& p : kept) spread += (p - middle) * (p - middle).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    line = {axes.eigenvectors().col(0), axes.eigenvectors().col(0).dot(middle)};
    std::vector<double> away;
    away.reserve(kept.size());
    for (const Eigen::Vector2d& p : kept) away.push_back(std::abs(line.normal.dot(p) - line.offset));
    std::vector<double> sorted = away;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double most = 2 * sorted[sorted.size() / 2] + 1e-9;
    std::vector<Eigen::Vector2d> near;
    for (std::size_t i = 0; i < kept.size(); ++i)
      if (away[i] <= most) near.push_back(kept[i]);
    kept = std::move(near);
  }
  return line;
}

std::optional<Eigen::Vector2d> meet(const SideLine& a, const SideLine& b) {
  Eigen::Matrix2d both;
  both << a.normal.transpose(), b.normal.transpose();
  if (!(std::abs(both.determinant()) > 0.05)) return {};
  return both.inverse() * Eigen::Vector2d(a.offset, b.offset);
}

/// A pixel where the lens would have put it without distortion, and back.
class Undistorted {
 public:
  explicit Undistorted(const Intrinsics& lens) : lens_(lens) {}
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& pixel) const {
    double x = (pixel.x() - lens_.cx) / lens_.fx;
    double y = (pixel.y() - lens_.cy) / lens_.fy;
    lens_.distortion.undistort(x, y);
    return {lens_.fx * x, lens_.fy * y};
  }
  [[nodiscard]] Eigen::Vector2d back(const Eigen::Vector2d& p) const {
    double x = 0;
    double y = 0;
    lens_.distortion.distort(p.x() / lens_.fx, p.y() / lens_.fy, x, y);
    return {lens_.fx * x + lens_.cx, lens_.fy * y + lens_.cy};
  }

 private:
  const Intrinsics& lens_;
};

/// The corners where the sides meet; as they were where a side isn't clear enough. False where some corners
/// aren't near those that OpenCV saw and others are unclear, so that they fit no square.
bool meet_sides(const Brightness& picture, const Undistorted& undistorted, int cells, SeenMarker& marker) {
  constexpr int kAlong = 24;
  constexpr double kHalfPixel = 0.5;  // OpenCV counts from pixel centres
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(kHalfPixel);
  std::array<std::optional<SideLine>, 4> sides;
  std::array<double, 4> reaches{};
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : marker.corners) middle += corner / 4;
  for (std::size_t s = 0; s < 4; ++s) {
    const Eigen::Vector2d from = marker.corners[s];
    const Eigen::Vector2d along = marker.corners[(s + 1) % 4] - from;
    Eigen::Vector2d outwards(along.y(), -along.x());
    outwards.normalize();
    if (outwards.dot(from - middle) < 0) outwards = -outwards;
    // Neither to the first cells of the pattern nor beyond a white margin of as much. OpenCV's corners can
    // lie outside a thin white rim by half of its largest window, 12 pixels, but not inside the border.
    const double across = 2 * outwards.dot(from + along / 2 - middle) / cells;
    reaches[s] = std::clamp(0.7 * across, 1.5, 16.0);
    const double outside = std::min(reaches[s], 8.0);
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i < kAlong; ++i) {
      const double share = 0.08 + 0.84 * (i + 0.5) / kAlong;  // corners are blurred along both sides
      const Eigen::Vector2d place = from + share * along - half;
      if (const auto off = crossing(picture, place, outwards, reaches[s], outside))
        places.push_back(undistorted(place + *off * outwards + half));
    }
    sides[s] = line_through(places);
  }
  constexpr double kNear = 3;  // pixels from where OpenCV saw it
  std::array<Eigen::Vector2d, 4> corners = marker.corners;
  bool far = false;
  bool unclear = false;
  for (std::size_t s = 0; s < 4; ++s) {
    const auto& before = sides[(s + 3) % 4];
    const auto corner = before && sides[s] ? meet(*before, *sides[s]) : std::nullopt;
    const Eigen::Vector2d pixel = corner ? undistorted.back(*corner) : corners[s];
    const double moved = (pixel - corners[s]).norm();
    const bool clear =
        corner && moved < std::max(kNear, M_SQRT2 * std::max(reaches[s], reaches[(s + 3) % 4]));
    if (clear) corners[s] = pixel;
    far = far || (clear && moved >= kNear);
    unclear = unclear || !clear;
  }
  marker.corners = corners;
  return !(far && unclear);
}

/// The light of a negative's levels.
std::array<float, 256> negative_light(const std::array<float, 256>* light) {
  std::array<float, 256> negative{};
  for (std::size_t i = 0; i < negative.size(); ++i)
    negative[i] = light != nullptr ? -(*light)[negative.size() - 1 - i] : static_cast<float>(i);
  return negative;
}

}  // namespace

const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    all.reserve(std::size(kDictionaries));
    for (const auto& entry : kDictionaries) all.emplace_back(entry.first);
    return all;
  }();
  return names;
}

std::optional<std::string> marker_dictionary_name(std::string_view name) {
  std::string upper(name);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  if (upper.starts_with("DICT_")) upper.erase(0, 5);
  if (upper == "ARUCO_ORIGINAL") upper = "ORIGINAL";
  const auto& names = marker_dictionaries();
  if (std::find(names.begin(), names.end(), upper) == names.end()) return {};
  return upper;
}

cv::Ptr<cv::aruco::Dictionary> marker_dictionary(std::string_view name) {
  const auto known = marker_dictionary_name(name);
  if (!known) return {};
  for (const auto& entry : kDictionaries)
    if (*known == entry.first) return cv::aruco::getPredefinedDictionary(entry.second);
  return {};
}

int markers_in(const std::string& dictionary) {
  const auto known = marker_dictionary(dictionary);
  return known ? known->bytesList.rows : 0;
}

cv::Mat grey_of(const ImageView& picture) {
  const auto& layout = picture.layout;
  const bool wide = bytes_per_sample(layout.format) == 2;
  const int depth = wide ? CV_16U : CV_8U;
  // OpenCV doesn't write to it.
  const cv::Mat raw(picture.height(), picture.width(), CV_MAKETYPE(depth, channels(layout.format)),
                    const_cast<std::byte*>(picture.data),
                    picture.stride);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  cv::Mat grey;
  if (is_bayer(layout.format)) {
    cv::cvtColor(raw, grey,
                 cv::COLOR_BayerBG2GRAY);  // RGGB; OpenCV's names start at the second pixel of the second row
  } else if (channels(layout.format) == 3) {
    cv::cvtColor(raw, grey, cv::COLOR_RGB2GRAY);
  } else {
    grey = raw;
  }
  cv::Mat result;
  grey.convertTo(result, CV_8U, 255.0 / layout.white());
  return result;
}

FoundQuads find_quads(const cv::Mat& grey, const cv::Ptr<cv::aruco::Dictionary>& dictionary, double margin) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  // OpenCV drops one of two outlines whose corners are nearer than this share of the perimeter. Those of a
  // border and of the margin around it are 1.4 margins apart.
  parameters->minMarkerDistanceRate = std::min(parameters->minMarkerDistanceRate, 0.5 * M_SQRT2 * margin / 4);
  FoundQuads all;
  cv::aruco::detectMarkers(grey, dictionary, all.corners, all.ids, parameters);
  // So a marker may be found twice, by outlines of several thresholds. The longest is the one that OpenCV
  // keeps.
  FoundQuads found;
  for (std::size_t m = 0; m < all.ids.size(); ++m) {
    const double length = cv::arcLength(all.corners[m], true);
    const auto middle = [](const auto& q) { return 0.25F * (q[0] + q[1] + q[2] + q[3]); };
    std::size_t same = 0;
    while (same < found.ids.size() &&
           (found.ids[same] != all.ids[m] ||
            cv::norm(middle(found.corners[same]) - middle(all.corners[m])) > length / 8)) {
      ++same;
    }
    if (same == found.ids.size()) {
      found.ids.push_back(all.ids[m]);
      found.corners.push_back(all.corners[m]);
    } else if (length > cv::arcLength(found.corners[same], true)) {
      found.corners[same] = all.corners[m];
    }
  }
  return found;
}

std::vector<SeenMarker> find_markers(const ImageView& picture, const std::string& dictionary,
                                     const Intrinsics& lens, const std::array<float, 256>* light,
                                     MarkerInk ink) {
  const auto known = marker_dictionary(dictionary);
  constexpr int kSmallest = 16;
  if (!known || std::min(picture.width(), picture.height()) < kSmallest) return {};
  cv::Mat grey = grey_of(picture);
  std::array<float, 256> negative{};
  if (ink == MarkerInk::light) {
    cv::bitwise_not(grey, grey);
    negative = negative_light(light);
    light = &negative;
  }
  const int cells = known->markerSize + 2;
  const FoundQuads quads = find_quads(grey, known, 1.0 / cells);
  const Brightness brightness(grey, light);
  const Undistorted undistorted(lens);
  std::vector<SeenMarker> markers;
  for (std::size_t m = 0; m < quads.ids.size(); ++m) {
    SeenMarker marker{quads.ids[m], {}};
    for (std::size_t c = 0; c < 4; ++c)
      marker.corners[c] = {static_cast<double>(quads.corners[m][c].x) + 0.5,
                           static_cast<double>(quads.corners[m][c].y) + 0.5};
    if (meet_sides(brightness, undistorted, cells, marker)) markers.push_back(marker);
  }
  return markers;
}

Image mirror_picture(const ImageView& picture) {
  const cv::Mat grey = grey_of(picture);
  Image image({{grey.cols, grey.rows}, PixelFormat::gray8, 8});
  cv::Mat into(grey.rows, grey.cols, CV_8U, image.bytes().data());
  cv::flip(grey, into, 1);
  return image;
}

Image draw_marker(const std::string& dictionary, int id, int cell) {
  const auto known = marker_dictionary(dictionary);
  const int cells = known->markerSize + 2;
  Image image({{(cells + 2) * cell, (cells + 2) * cell}, PixelFormat::gray8, 8});
  cv::Mat all(image.layout().size.height, image.layout().size.width, CV_8U, image.bytes().data());
  all.setTo(255);
  cv::Mat drawn;
  cv::aruco::drawMarker(known, id, cells * cell, drawn, 1);
  drawn.copyTo(all(cv::Rect(cell, cell, cells * cell, cells * cell)));
  return image;
}

}  // namespace emberlock::recon
