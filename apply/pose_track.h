// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "apply/marker.h"
#include "apply/marker_pose.h"
#include "base/quantity.h"

namespace emberlock::apply {

// The motion of a camera before a marker: twists in the camera's axes whose accelerations fade over time
// (Singer 1970, "Estimating optimal tracking filter performance for manned maneuvering targets"), on the Lie
// group SE(3). A pose T goes to exp(dt xi + ...) T; its error is a twist left of it. What is measured are the
// pixels of the marker's points: an iterated extended Kalman filter (Bell and Cathey 1993), whose update is
// the most probable pose given the pixels and the prediction. So the prediction also tells which of a flat
// marker's two poses it is.

struct TrackOptions {
  /// Noise of a point's coordinates, pixels: at first, and at least; it is measured as frames come.
  double pixel_sigma = 0.15, least_sigma = 0.05;
  /// What accelerations are usual, as a camera is moved by hand: of moves, m/s2 per metre of distance to the
  /// marker; of turns, rad/s2; and for how long they last.
  double move_acceleration = 0.4, turn_acceleration = 0.4;
  Seconds lasts{0.8};
  int held = 5;  ///< lost frames that the motion is trusted for
  int fade = 6;  ///< frames in which the flame comes back after it was hidden
};

/// A frame's pose.
struct TrackedPose {
  enum class From { nothing, prediction, marker };
  From from = From::nothing;
  recon::Rigid3 camera_from_marker = {};
  double rms = 0;    ///< of the marker's points, pixels; from the marker alone
  double shown = 0;  ///< 0..1: of the flame
};

/// What the filter knows: a pose, its twist and that one's acceleration, and the covariance of all three.
struct MotionState {
  static constexpr int kValues = 18;
  using Matrix = Eigen::Matrix<double, kValues, kValues>;

  recon::Rigid3 pose;
  Twist twist = Twist::Zero(), acceleration = Twist::Zero();
  Matrix covariance = Matrix::Zero();
};

/// One step of a PoseTrack, for smooth().
struct TrackStep {
  TrackedPose seen;
  std::vector<MarkerPoint> points;  ///< where they told the pose
  bool continues = false;           ///< the step before, through `transition`
  MotionState predicted, known;
  MotionState::Matrix transition = MotionState::Matrix::Identity();
};

/// Poses as frames come.
class PoseTrack {
 public:
  explicit PoseTrack(const recon::Intrinsics& lens, const TrackOptions& options = {})
      : lens_(lens), options_(options), noise_(options.pixel_sigma * options.pixel_sigma) {}
  /// The next frame, later than the one before; `points` is empty where the marker isn't seen.
  TrackStep see(Seconds time, const std::vector<MarkerPoint>& points);

 private:
  [[nodiscard]] MotionState started(const std::vector<MarkerPoint>& points, const MarkerPose& pose,
                                    double variance) const;
  void predict(double dt, TrackStep& step) const;
  struct Update {
    MotionState state;
    double cost = 0;     ///< of pixels and prediction, in squared sigmas
    double squares = 0;  ///< of the pixels
  };
  [[nodiscard]] std::optional<Update> updated(const MotionState& predicted,
                                              const std::vector<MarkerPoint>& points, double variance) const;
  double variance_of(const MarkerPose& pose, std::size_t points);

  recon::Intrinsics lens_;
  TrackOptions options_;
  double noise_;  ///< variance of a coordinate, pixels squared
  std::optional<MotionState> state_;
  Seconds time_{0};
  int lost_ = 0;         ///< frames since the marker was seen
  double evidence_ = 0;  ///< for another pose than the tracked one
  bool was_hidden_ = false;
  int back_ = 0;  ///< frames since the flame came back
};

/// The same poses once what comes after each is known too (Rauch, Tung and Striebel 1965): lost frames lie
/// between both ends.
std::vector<TrackedPose> smooth(std::span<const TrackStep> steps, const recon::Intrinsics& lens);

}  // namespace emberlock::apply
