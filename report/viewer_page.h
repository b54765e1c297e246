// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/result.h"
#include "recon/export/shared_volume.h"
#include "recon/views/camera_model.h"
#include "recon/views/view.h"

namespace emberlock::report {

/// How a page holds a volume's values.
enum class Stored {
  half,     ///< as 16 bits times a power of two: within 2^-11 of a value, or 2^-39 of the channel's largest
  float32,  ///< bit for bit
};

/// A grid's values as the viewer reads them (daemon/console/src/viewer/contents.ts): a bit for each brick of
/// 8 x 8 x 8 key points (x fastest, lowest bit first), set where any of its bits is; then these bricks'
/// values, x fastest with the lanes interleaved, 0 beyond the grid, as planes of bytes: the lowest byte of
/// all values first.
struct PackedGrid {
  std::string bytes;
  double scale = 1;  ///< what the values are times, a power of two
};
/// Error (bad_input): values that aren't finite, or not one or three a key point.
Result<PackedGrid> packed(const recon::Grid& grid, const recon::SharedGrid& values, Stored stored);

/// A camera that filmed.
struct ViewerCamera {
  std::string name;
  recon::ViewRole role = recon::ViewRole::input;
  recon::CameraModel camera;
};

/// What it saw of a frame, as captured and as rendered: `data:` URIs of pictures of one size, or empty.
struct ViewerView {
  std::optional<std::array<double, 3>> rmse = {};  ///< R, G, B, grey levels
  std::string captured = {}, rendered = {};
};

struct ViewerTrace {
  double seconds = 0;
  double input_rmse = 0;
  std::optional<double> heldout_rmse = {};
};

/// The viewer's own files, as its build leaves them.
struct ViewerProgram {
  std::string script, style;
};

/// A page that shows a result's volumes to turn, in slices and over time, its cameras and its errors. It
/// needs no other file, no server and no network.
class ViewerPage {
 public:
  /// `up` points up in the world, unit length.
  ViewerPage(std::string title, std::string input, const Eigen::Vector3d& up, Stored stored)
      : title_(std::move(title)), input_(std::move(input)), up_(up), stored_(stored) {}

  /// The next frame: `emission`, and all other grids that hold anything; what each camera saw of it, or
  /// nothing. Errors: those of packed(); it has no `emission`.
  Status add_frame(const recon::SharedVolume& volume, std::vector<ViewerView> views = {});
  void add_camera(ViewerCamera camera) { cameras_.push_back(std::move(camera)); }
  void set_trace(std::vector<ViewerTrace> trace) { trace_ = std::move(trace); }
  [[nodiscard]] std::string html(const ViewerProgram& program) const;

 private:
  struct Channel {
    std::string name, unit;
    std::size_t lanes = 1;
    double scale = 1;
  };
  struct Frame {
    recon::Grid grid;
    std::optional<std::uint64_t> number;
    std::vector<Channel> channels;
    std::vector<ViewerView> views;
  };
  [[nodiscard]] std::string header() const;

  std::string title_, input_;
  Eigen::Vector3d up_;
  Stored stored_;
  std::vector<Frame> frames_;
  std::vector<std::string> blocks_;  // of all frames' channels in turn, base64 of zlib's format
  std::vector<ViewerCamera> cameras_;
  std::vector<ViewerTrace> trace_;
};

}  // namespace emberlock::report
