// SPDX-License-Identifier: Apache-2.0
#include "apply/pose_track.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "recon/calibrate/chain_poses.h"
#include "recon/calibrate/pose.h"

namespace emberlock::apply {
namespace {

using Matrix = MotionState::Matrix;
using Vector = Eigen::Matrix<double, MotionState::kValues, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// How a twist on the right of a motion looks on its left.
Matrix6 adjoint(const recon::Rigid3& motion) {
  Matrix6 matrix = Matrix6::Zero();
  matrix.topLeftCorner<3, 3>() = motion.rotation;
  matrix.bottomRightCorner<3, 3>() = motion.rotation;
  matrix.topRightCorner<3, 3>() = recon::cross_matrix(motion.translation) * motion.rotation;
  return matrix;
}

/// a minus b, as the error's twists.
Vector difference(const MotionState& a, const MotionState& b) {
  Vector d;
  d.head<6>() = twist_of(recon::chained(a.pose, b.pose.inverse()));
  d.segment<6>(6) = a.twist - b.twist;
  d.tail<6>() = a.acceleration - b.acceleration;
  return d;
}

MotionState moved_by(const MotionState& state, const Vector& d) {
  MotionState moved = state;
  moved.pose = recon::chained(rigid_of(d.head<6>()), state.pose);
  moved.twist += d.segment<6>(6);
  moved.acceleration += d.tail<6>();
  return moved;
}

Matrix inverse_of(const Matrix& covariance) { return covariance.ldlt().solve(Matrix::Identity()); }

/// So many squared sigmas are beyond what `points` scatter by.
double gate(std::size_t points) {
  const auto values = 2 * static_cast<double>(points);
  return values + 15 * std::sqrt(2 * values);
}

}  // namespace

/// Of a coordinate: what frames so far left over when each was explained on its own, at least; more of a
/// frame that leaves over far more.
double PoseTrack::variance_of(const MarkerPose& pose, std::size_t points) {
  const auto n = static_cast<double>(points);
  const double own = pose.rms * pose.rms * n / (2 * n - 6);  // a pose takes up six of the 2 n values
  constexpr double kFollows = 0.05;
  constexpr double kFar = 9;
  const double least = options_.least_sigma * options_.least_sigma;
  noise_ += kFollows * (std::min(own, kFar * std::max(noise_, least)) - noise_);
  return std::max({least, noise_, own / kFar});
}

MotionState PoseTrack::started(const std::vector<MarkerPoint>& points, const MarkerPose& pose,
                               double variance) const {
  constexpr double kMetresPerSecond = 1;
  constexpr double kRadiansPerSecond = 2;
  MotionState state;
  state.pose = pose.camera_from_marker;
  const Residuals seen = residuals(points, lens_, state.pose);
  state.covariance.topLeftCorner<6, 6>() =
      variance * (seen.by.transpose() * seen.by).ldlt().solve(Matrix6::Identity());
  const double distance = state.pose.translation.norm();
  for (int a = 0; a < 6; ++a) {
    const double speed = a < 3 ? kMetresPerSecond * distance : kRadiansPerSecond;
    const double usual = a < 3 ? options_.move_acceleration * distance : options_.turn_acceleration;
    state.covariance(6 + a, 6 + a) = speed * speed;
    state.covariance(12 + a, 12 + a) = usual * usual;
  }
  return state;
}

void PoseTrack::predict(double dt, TrackStep& step) const {
  const double lasts = options_.lasts.value();
  const double stays = std::exp(-dt / lasts);
  const double adds_twist = lasts * (1 - stays);
  const double adds_pose = lasts * (dt - adds_twist);
  const recon::Rigid3 motion = rigid_of(dt * state_->twist + adds_pose * state_->acceleration);
  step.continues = true;
  step.transition.topLeftCorner<6, 6>() = adjoint(motion);
  step.transition.block<6, 6>(0, 6) = dt * Matrix6::Identity();
  step.transition.block<6, 6>(0, 12) = adds_pose * Matrix6::Identity();
  step.transition.block<6, 6>(6, 12) = adds_twist * Matrix6::Identity();
  step.transition.block<6, 6>(12, 12) = stays * Matrix6::Identity();
  step.predicted = *state_;
  step.predicted.pose = recon::chained(motion, state_->pose);
  step.predicted.twist += adds_twist * state_->acceleration;
  step.predicted.acceleration *= stays;
  Matrix& p = step.predicted.covariance;
  p = step.transition * state_->covariance * step.transition.transpose();
  // White noise of the acceleration's rate of change, over a step that is short beside what accelerations
  // last.
  const double powers[3][3] = {{std::pow(dt, 5) / 20, std::pow(dt, 4) / 8, std::pow(dt, 3) / 6},
                               {std::pow(dt, 4) / 8, std::pow(dt, 3) / 3, dt * dt / 2},
                               {std::pow(dt, 3) / 6, dt * dt / 2, dt}};
  const double distance = state_->pose.translation.norm();
  for (int a = 0; a < 6; ++a) {
    const double usual = a < 3 ? options_.move_acceleration * distance : options_.turn_acceleration;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p(6 * i + a, 6 * j + a) += 2 * usual * usual / lasts * powers[i][j];
  }
}

std::optional<PoseTrack::Update> PoseTrack::updated(const MotionState& predicted,
                                                    const std::vector<MarkerPoint>& points,
                                                    double variance) const {
  const Matrix prior = inverse_of(predicted.covariance);
  Update update{predicted};
  Matrix information = prior;
  for (int round = 0; round < 8; ++round) {
    const Residuals seen = residuals(points, lens_, update.state.pose);
    if (!seen.before_camera) return {};
    information = prior;
    information.topLeftCorner<6, 6>() += seen.by.transpose() * seen.by / variance;
    Vector slope = -prior * difference(update.state, predicted);
    slope.head<6>() += seen.by.transpose() * seen.off / variance;
    const Vector step = information.ldlt().solve(slope);
    if (!step.allFinite()) return {};
    update.state = moved_by(update.state, step);
    if (step.norm() < 1e-9) break;
  }
  const Residuals seen = residuals(points, lens_, update.state.pose);
  if (!seen.before_camera) return {};
  const Vector moved = difference(update.state, predicted);
  update.squares = seen.off.squaredNorm() / variance;
  update.cost = update.squares + moved.dot(prior * moved);
  update.state.covariance = inverse_of(information);
  return update;
}

TrackStep PoseTrack::see(Seconds time, const std::vector<MarkerPoint>& points) {
  TrackStep step;
  constexpr Seconds kPause{1};  // of the film: nothing is known behind it
  if (state_ && time - time_ > kPause) state_.reset();
  if (state_) predict(std::max((time - time_).value(), 1e-6), step);
  time_ = time;
  const std::vector<MarkerPose> poses = marker_poses(points, lens_);
  const double variance = poses.empty() ? 0 : variance_of(poses.front(), points.size());
  std::optional<MotionState> known;
  if (!poses.empty() && state_) {
    // For another pose speaks what it explains better than the tracked one, by its likelihood (Wald 1945); no
    // single frame decides.
    constexpr double kMostOfFrame = 4;
    const double best = static_cast<double>(points.size()) * std::pow(poses.front().rms, 2) / variance;
    const auto update = updated(step.predicted, points, variance);
    const bool fits = update && update->cost < gate(points.size());
    const double speaks = fits ? (update->squares - best - 12) / 2 : kMostOfFrame;
    evidence_ = std::max(0.0, evidence_ + std::clamp(speaks, -kMostOfFrame, kMostOfFrame));
    if (fits) known = update->state;
  }
  constexpr double kDecides = 10;
  if (!poses.empty() && (!state_ || evidence_ > kDecides)) {
    known = started(points, poses.front(), variance);
    step.continues = false;
    evidence_ = 0;
  }
  lost_ = known ? 0 : lost_ + 1;
  if (known) {
    step.seen.from = TrackedPose::From::marker;
    state_ = known;
  } else if (state_ && lost_ <= options_.held) {
    step.seen.from = TrackedPose::From::prediction;
    state_ = step.predicted;
  } else {
    was_hidden_ = was_hidden_ || state_;
    state_.reset();
    evidence_ = 0;
    back_ = 0;
    step.continues = false;
    return step;
  }
  ++back_;
  step.known = *state_;
  step.seen.camera_from_marker = state_->pose;
  step.seen.shown = was_hidden_ ? std::min(1.0, static_cast<double>(back_) / options_.fade) : 1;
  if (known) {
    step.points = points;
    step.seen.rms = rms_off(points, lens_, state_->pose);
  }
  return step;
}

std::vector<TrackedPose> smooth(std::span<const TrackStep> steps, const recon::Intrinsics& lens) {
  std::vector<TrackedPose> poses;
  for (const TrackStep& step : steps) poses.push_back(step.seen);
  if (steps.empty()) return poses;
  MotionState later = steps.back().known;
  for (std::size_t i = steps.size() - 1; i-- > 0;) {
    const TrackStep& next = steps[i + 1];
    if (!next.continues) {
      later = steps[i].known;
      continue;
    }
    const Matrix gain =
        next.predicted.covariance.ldlt().solve(next.transition * steps[i].known.covariance).transpose();
    later = moved_by(steps[i].known, gain * difference(later, next.predicted));
    poses[i].camera_from_marker = later.pose;
    if (!steps[i].points.empty()) poses[i].rms = rms_off(steps[i].points, lens, later.pose);
  }
  return poses;
}

}  // namespace emberlock::apply
