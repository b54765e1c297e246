// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_fit.h"

#include <algorithm>

#include <Eigen/Dense>
#include <ceres/ceres.h>

namespace emberlock::recon {
namespace {

constexpr int kCameraUnknowns = 10;
constexpr double kLeastExposure = 1e-7;
constexpr double kOutlier = 5;  // standard deviations

/// ln of what a camera makes of a patch, over the common radiance; by standard deviations.
struct RadianceResidual {
  const ColourEquation& e;

  template <class T>
  bool operator()(const T* response, const T* log_gain, const T* vignetting, const T* log_light,
                  T* residual) const {
    using std::exp;
    using std::log;
    T exposure = exp(ResponseCurve::log_exposure(response, e.sample, e.variance));
    if (e.dark_sample > ResponseCurve::kLeastSample)
      exposure -= exp(ResponseCurve::log_exposure(response, e.dark_sample, 0.0));
    if (exposure < kLeastExposure) exposure = T(kLeastExposure);
    const double r = e.radius_squared;
    T light = 1.0 + r * (vignetting[0] + r * (vignetting[1] + r * vignetting[2]));
    if (light < 0.02) light = T(0.02);
    residual[0] = (log(exposure) + log_gain[0] - log(light) - e.flat - log_light[0] - e.known) / e.sigma;
    return true;
  }
};

/// What cameras are like before anything is measured, so that what no picture tells stays small; and a
/// response that falls costs much.
struct LikelyCurve {
  static constexpr int kSlopes = 16;
  static constexpr double kLeastSlope = 0.2;
  template <class T>
  bool operator()(const T* p, T* residual) const {
    residual[0] = (p[0] - 2.0) / 2.0;
    for (int j = 1; j < ResponseCurve::kParameters; ++j) residual[j] = p[j] / 0.5;
    for (int i = 0; i < kSlopes; ++i) {
      const T slope = ResponseCurve::log_slope(p, (i + 1.0) / kSlopes);
      residual[ResponseCurve::kParameters + i] = slope < kLeastSlope ? (kLeastSlope - slope) * 100.0 : T(0.0);
    }
    return true;
  }
};
struct LikelyVignetting {
  template <class T>
  bool operator()(const T* k, T* residual) const {
    residual[0] = k[0] / 0.7;
    residual[1] = k[1] / 0.35;
    residual[2] = k[2] / 0.2;
    return true;
  }
};

/// Owns the numbers that Ceres moves.
class ColourProblem {
 public:
  ColourProblem(std::vector<ColourEquation>& equations, ColourFit& fit, const ColourHeld& held)
      : equations_(equations), fit_(fit) {
    for (ColourEquation& e : equations_) {
      if (e.outlier) continue;
      ColourUnknowns& c = fit_.cameras[e.camera];
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<RadianceResidual, 1, ResponseCurve::kParameters, 1, 3, 1>(
              new RadianceResidual{e}),
          new ceres::CauchyLoss(2), c.response.data(), &c.log_gain[e.channel], c.vignetting.data(),
          &fit_.log_light[e.light]);
    }
    for (std::size_t i = 0; i < fit_.cameras.size(); ++i) add_camera(i, held);
  }

  bool solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 60;
    options.function_tolerance = 1e-10;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  /// Of the cameras' unknowns, zero where held; nothing where something is left open.
  [[nodiscard]] std::optional<Eigen::MatrixXd> covariance() {
    std::vector<double*> blocks;
    std::vector<int> place;  // of each column in the result, -1 for lights
    const auto take = [&](double* block, int size, int at) {
      if (!problem_.HasParameterBlock(block) || problem_.IsParameterBlockConstant(block)) return;
      blocks.push_back(block);
      for (int i = 0; i < size; ++i) place.push_back(at < 0 ? -1 : at + i);
    };
    for (std::size_t i = 0; i < fit_.cameras.size(); ++i) {
      ColourUnknowns& c = fit_.cameras[i];
      const int at = static_cast<int>(i) * kCameraUnknowns;
      take(c.response.data(), ResponseCurve::kParameters, at);
      for (int k = 0; k < 3; ++k) take(&c.log_gain[static_cast<std::size_t>(k)], 1, at + 4 + k);
      take(c.vignetting.data(), 3, at + 7);
    }
    for (double& light : fit_.log_light) take(&light, 1, -1);
    ceres::Problem::EvaluateOptions options;
    options.parameter_blocks = blocks;
    ceres::CRSMatrix jacobian;
    double cost = 0;
    if (!problem_.Evaluate(options, &cost, nullptr, nullptr, &jacobian)) return std::nullopt;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(jacobian.num_cols, jacobian.num_cols);
    for (int row = 0; row < jacobian.num_rows; ++row)
      for (int a = jacobian.rows[row]; a < jacobian.rows[row + 1]; ++a)
        for (int b = jacobian.rows[row]; b < jacobian.rows[row + 1]; ++b)
          normal(jacobian.cols[a], jacobian.cols[b]) += jacobian.values[a] * jacobian.values[b];
    const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-14)) return std::nullopt;
    const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
    const auto size = static_cast<Eigen::Index>(fit_.cameras.size()) * kCameraUnknowns;
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size, size);
    for (std::size_t a = 0; a < place.size(); ++a)
      for (std::size_t b = 0; b < place.size(); ++b)
        if (place[a] >= 0 && place[b] >= 0)
          out(place[a], place[b]) = inverse(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
    return out;
  }

 private:
  void add_camera(std::size_t i, const ColourHeld& held) {
    ColourUnknowns& c = fit_.cameras[i];
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<LikelyCurve, ResponseCurve::kParameters + LikelyCurve::kSlopes,
                                        ResponseCurve::kParameters>(new LikelyCurve),
        nullptr, c.response.data());
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<LikelyVignetting, 3, 3>(new LikelyVignetting),
                              nullptr, c.vignetting.data());
    if (held.response) problem_.SetParameterBlockConstant(c.response.data());
    if (held.vignetting[i]) problem_.SetParameterBlockConstant(c.vignetting.data());
    for (std::size_t k = 0; k < 3; ++k)
      if (held.gain[i][k] && problem_.HasParameterBlock(&c.log_gain[k]))
        problem_.SetParameterBlockConstant(&c.log_gain[k]);
  }

  std::vector<ColourEquation>& equations_;
  ColourFit& fit_;
  ceres::Problem problem_;
};

/// Relative standard deviation of the exposure that a reading tells.
void weigh(std::vector<ColourEquation>& equations, const ColourFit& fit) {
  for (ColourEquation& e : equations) {
    const ColourUnknowns& c = fit.cameras[e.camera];
    const double whole = std::exp(ResponseCurve::log_exposure(c.response.data(), e.sample, e.variance));
    const double slope = whole * ResponseCurve::log_slope(c.response.data(), e.sample) / e.sample;
    const double noise = slope * e.sample_sigma /
                         std::max(kLeastExposure, whole - ResponseCurve::exposure(c.response, e.dark_sample));
    e.sigma = std::hypot(e.floor, noise);
  }
}

void mark_outliers(std::vector<ColourEquation>& equations, ColourFit& fit) {
  std::vector<double> off;
  for (ColourEquation& e : equations) {
    ColourUnknowns& c = fit.cameras[e.camera];
    double residual = 0;
    RadianceResidual{e}(c.response.data(), &c.log_gain[e.channel], c.vignetting.data(),
                        &fit.log_light[e.light], &residual);
    e.residual = residual * e.sigma;
    off.push_back(std::abs(residual));
  }
  if (off.empty()) return;
  // Where the model doesn't fit a camera to its noise, that isn't the fault of single readings.
  std::vector<double> sorted = off;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = kOutlier * std::max(1.0, 1.4826 * *middle);
  for (std::size_t i = 0; i < off.size(); ++i) equations[i].outlier = off[i] > limit;
}

}  // namespace

std::optional<ColourFit> fit_colour(std::vector<ColourEquation>& equations, ColourFit start,
                                    const ColourHeld& held) {
  constexpr int kRounds = 3;
  ColourFit fit = std::move(start);
  for (int round = 0; round < kRounds; ++round) {
    weigh(equations, fit);
    ColourProblem problem(equations, fit, held);
    if (!problem.solve()) return std::nullopt;
    mark_outliers(equations, fit);
  }
  weigh(equations, fit);
  const auto covariance = ColourProblem(equations, fit, held).covariance();
  if (!covariance) return std::nullopt;
  // Where the model misses by more than the noise, the noise isn't what limits the result.
  double squares = 0;
  double count = 0;
  for (const ColourEquation& e : equations) {
    if (e.outlier) continue;
    squares += e.residual * e.residual / (e.sigma * e.sigma);
    count += 1;
  }
  const double unknowns =
      static_cast<double>(covariance->rows() + static_cast<Eigen::Index>(fit.log_light.size()));
  fit.covariance = std::max(1.0, squares / std::max(1.0, count - unknowns)) * *covariance;
  return fit;
}

}  // namespace emberlock::recon
