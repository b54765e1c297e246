// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/response_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "recon/kernels/planck.h"

namespace emberlock::recon {
namespace {

constexpr std::array<const char*, 3> kNames = {"red", "green", "blue"};
constexpr double kNothing = 3;  // standard errors
constexpr std::size_t kMostReadings = 64;
constexpr double kFarthestShift = 150;  // nm
constexpr double kWidest = 0.9;         // of |ln w|

Error bad_reading(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// A channel of the base as a sum over places: Simpson's rule over pieces of at most 2 nm.
struct Lobe {
  std::vector<double> nm, weight;
  double middle = 0;
  [[nodiscard]] bool dead() const { return nm.empty(); }
};

Lobe lobe_of(const CameraResponse& base, std::size_t c) {
  Lobe lobe;
  const std::vector<double>& x = base.wavelength_nm;
  const std::vector<double>& y = base.level[c];
  double area = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    if (y[i] == 0 && y[i + 1] == 0) continue;
    const int pieces = std::max(1, static_cast<int>(std::ceil((x[i + 1] - x[i]) / 2)));
    const int last = 2 * pieces;
    for (int p = 0; p <= last; ++p) {
      const double share = static_cast<double>(p) / last;
      const double simpson = p == 0 || p == last ? 1 : p % 2 == 1 ? 4 : 2;
      lobe.nm.push_back(std::lerp(x[i], x[i + 1], share));
      lobe.weight.push_back(simpson * (x[i + 1] - x[i]) / (6 * pieces) * std::lerp(y[i], y[i + 1], share));
      area += std::abs(lobe.weight.back());
      lobe.middle += lobe.nm.back() * std::abs(lobe.weight.back());
    }
  }
  if (!lobe.dead()) lobe.middle /= area;
  return lobe;
}

/// a, s (nm) and ln w.
struct Shape {
  double log_scale = 0, shift = 0, log_width = 0;
  [[nodiscard]] double place(const Lobe& lobe, double nm) const {
    return lobe.middle + shift + std::exp(log_width) * (nm - lobe.middle);
  }
};

/// A level, and its changes with log_scale (itself), shift, log_width and the temperature.
struct LevelAndSlopes {
  double value = 0, by_shift = 0, by_width = 0, by_kelvin = 0;
};

LevelAndSlopes level_of(const Lobe& lobe, const Shape& shape, const KnownEmitter& emitter, double kelvin) {
  LevelAndSlopes out;
  const double width = std::exp(shape.log_width);
  for (std::size_t i = 0; i < lobe.nm.size(); ++i) {
    constexpr double kShortest = 100;  // nm
    const double nm = std::max(kShortest, shape.place(lobe, lobe.nm[i]));
    const double own = emittance(emitter, nm, Kelvin(kelvin));
    const double light = lobe.weight[i] * own * std::exp(log_planck(nm, kelvin));
    const double x = kSecondRadiation / (nm * kelvin);
    const double slope =
        (-5 + x / -std::expm1(-x)) / nm + (emittance(emitter, nm + 0.5, Kelvin(kelvin)) / own - 1) / 0.5;
    out.value += light;
    out.by_shift += light * slope;
    out.by_width += light * slope * width * (lobe.nm[i] - lobe.middle);
    out.by_kelvin += light * log_planck_slope(nm, kelvin);  // the emissivity's own change is a thousandth
  }
  const double scale = std::exp(shape.log_scale);
  return {scale * out.value, scale * out.by_shift, scale * out.by_width, scale * out.by_kelvin};
}

/// Unknowns: log_scale, shift and log_width of the live channels, then what each temperature is off by.
class GlowProblem {
 public:
  GlowProblem(const std::vector<GlowReading>& readings, const CameraResponse& base,
              const ResponseFitOptions& options)
      : readings_(readings), options_(options) {
    for (std::size_t c = 0; c < 3; ++c) {
      lobes_[c] = lobe_of(base, c);
      const bool seen = std::any_of(readings.begin(), readings.end(), [&](const GlowReading& r) {
        return r.saturated[c] || r.level[c] > kNothing * r.sigma[c];
      });
      if (lobes_[c].dead() || !seen) continue;
      first_[c] = unknowns_;
      unknowns_ += 3;
    }
    temperatures_ = unknowns_;
    if (options.temperature_sigma.value() > 0) unknowns_ += static_cast<Eigen::Index>(readings.size());
  }

  [[nodiscard]] bool live(std::size_t c) const { return first_[c] >= 0; }
  [[nodiscard]] Eigen::Index first(std::size_t c) const { return first_[c]; }
  [[nodiscard]] const Lobe& lobe(std::size_t c) const { return lobes_[c]; }
  [[nodiscard]] Shape shape(const Eigen::VectorXd& x, std::size_t c) const {
    return {x[first_[c]], x[first_[c] + 1], x[first_[c] + 2]};
  }
  [[nodiscard]] double error(const GlowReading& reading, std::size_t c) const {
    return std::hypot(reading.sigma[c], options_.floor * reading.level[c]);
  }
  [[nodiscard]] double kelvin(const Eigen::VectorXd& x, std::size_t reading) const {
    const double told = readings_[reading].temperature.value();
    return temperatures_ < unknowns_ ? std::max(1.0, told + x[temperatures_ + as_index(reading)]) : told;
  }

  /// The scales that fit best, unshifted.
  [[nodiscard]] Result<Eigen::VectorXd> start() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(unknowns_);
    for (std::size_t c = 0; c < 3; ++c) {
      if (!live(c)) continue;
      double cross = 0;
      double square = 0;
      for (std::size_t i = 0; i < readings_.size(); ++i) {
        if (readings_[i].saturated[c]) continue;
        const double weight = std::pow(error(readings_[i], c), -2);
        const double model = level_of(lobes_[c], {}, options_.emitter, kelvin(x, i)).value;
        cross += weight * model * readings_[i].level[c];
        square += weight * model * model;
      }
      if (square == 0)
        return bad_reading(std::string("channel ") + kNames[c],
                           "is at white in each picture that shows it, so nothing tells its scale",
                           "Shorten the exposure, or take a lower temperature");
      if (!(cross > 0))
        return bad_reading(std::string("channel ") + kNames[c],
                           "shows light where the base response has none (the negative lobes of sRGB)",
                           "Take a base without negative lobes: --base sensor");
      x[first_[c]] = std::log(cross / square);
    }
    return x;
  }

  struct Point {
    double cost = 0;
    Eigen::MatrixXd normal;
    Eigen::VectorXd gradient;
  };
  [[nodiscard]] Point at(const Eigen::VectorXd& x) const {
    Point p{0, Eigen::MatrixXd::Zero(unknowns_, unknowns_), Eigen::VectorXd::Zero(unknowns_)};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!live(c)) continue;
      add_prior(x, first_[c] + 1, options_.shift_prior, p);
      add_prior(x, first_[c] + 2, options_.width_prior, p);
      for (std::size_t i = 0; i < readings_.size(); ++i) add_level(x, c, i, p);
    }
    for (Eigen::Index i = temperatures_; i < unknowns_; ++i)
      add_prior(x, i, options_.temperature_sigma.value(), p);
    return p;
  }

 private:
  static Eigen::Index as_index(std::size_t i) { return static_cast<Eigen::Index>(i); }
  static void add_prior(const Eigen::VectorXd& x, Eigen::Index i, double sigma, Point& p) {
    p.cost += std::pow(x[i] / sigma, 2);
    p.normal(i, i) += 1 / (sigma * sigma);
    p.gradient[i] += x[i] / (sigma * sigma);
  }
  void add_level(const Eigen::VectorXd& x, std::size_t c, std::size_t i, Point& p) const {
    const GlowReading& reading = readings_[i];
    const LevelAndSlopes model = level_of(lobes_[c], shape(x, c), options_.emitter, kelvin(x, i));
    if (reading.saturated[c] && model.value >= reading.level[c]) return;
    const double sigma = error(reading, c);
    const bool black = reading.level[c] <= kNothing * reading.sigma[c];
    if (black && model.value < 0) {  // pictures end at black
      p.cost += std::pow(reading.level[c] / sigma, 2);
      return;
    }
    const double residual = (model.value - reading.level[c]) / sigma;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns_);
    row.segment<3>(first_[c]) << model.value, model.by_shift, model.by_width;
    if (temperatures_ < unknowns_) row[temperatures_ + as_index(i)] = model.by_kelvin;
    row /= sigma;
    p.cost += residual * residual;
    p.normal += row * row.transpose();
    p.gradient += residual * row;
  }

  const std::vector<GlowReading>& readings_;
  const ResponseFitOptions& options_;
  std::array<Lobe, 3> lobes_;
  std::array<Eigen::Index, 3> first_ = {-1, -1, -1};
  Eigen::Index temperatures_ = 0, unknowns_ = 0;
};

/// Levenberg and Marquardt: never a step that raises the cost.
Eigen::VectorXd descend(const GlowProblem& problem, Eigen::VectorXd x) {
  constexpr int kMostSteps = 200;
  double damping = 1e-4;
  GlowProblem::Point here = problem.at(x);
  for (int step = 0; step < kMostSteps && damping < 1e12; ++step) {
    Eigen::MatrixXd damped = here.normal;
    damped.diagonal() *= 1 + damping;
    Eigen::VectorXd next = x - damped.ldlt().solve(here.gradient);
    for (std::size_t c = 0; c < 3; ++c) {
      if (!problem.live(c)) continue;
      double* const shape = &next[problem.first(c)];
      shape[1] = std::clamp(shape[1], -kFarthestShift, kFarthestShift);
      shape[2] = std::clamp(shape[2], -kWidest, kWidest);
    }
    GlowProblem::Point there = problem.at(next);
    if (!(there.cost < here.cost)) {  // also where it isn't finite
      damping *= 8;
      continue;
    }
    const bool done = here.cost - there.cost < 1e-12 * (1 + here.cost);
    x = std::move(next);
    here = std::move(there);
    damping = std::max(1e-12, damping / 8);
    if (done) break;
  }
  return x;
}

double value_at(const CameraResponse& base, std::size_t c, double nm) {
  const std::vector<double>& x = base.wavelength_nm;
  if (nm < x.front() || nm > x.back()) return 0;
  const auto after = std::upper_bound(x.begin() + 1, x.end() - 1, nm);
  const auto i = static_cast<std::size_t>(after - x.begin());
  return std::lerp(base.level[c][i - 1], base.level[c][i], (nm - x[i - 1]) / (x[i] - x[i - 1]));
}

/// The base's channels in their new shapes, at all places where one of them bends.
CameraResponse shaped(const GlowProblem& problem, const Eigen::VectorXd& x, const CameraResponse& base) {
  constexpr double kEdge = 1e-3;  // nm: where a channel ends at another level than 0
  std::vector<double> nm;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!problem.live(c)) continue;
    const Shape shape = problem.shape(x, c);
    for (const double w : base.wavelength_nm) nm.push_back(shape.place(problem.lobe(c), w));
    nm.push_back(shape.place(problem.lobe(c), base.wavelength_nm.front()) - kEdge);
    nm.push_back(shape.place(problem.lobe(c), base.wavelength_nm.back()) + kEdge);
  }
  std::sort(nm.begin(), nm.end());
  CameraResponse out;
  out.absolute = true;
  for (const double w : nm)
    if (w >= 100 && w <= 20000 && (out.wavelength_nm.empty() || w > out.wavelength_nm.back() + 1e-6))
      out.wavelength_nm.push_back(w);
  for (std::size_t c = 0; c < 3; ++c) {
    out.level[c].assign(out.wavelength_nm.size(), 0);
    if (!problem.live(c)) continue;
    const Shape shape = problem.shape(x, c);
    const double width = std::exp(shape.log_width);
    const double middle = problem.lobe(c).middle;
    for (std::size_t i = 0; i < out.wavelength_nm.size(); ++i)
      out.level[c][i] = std::exp(shape.log_scale) / width *
                        value_at(base, c, middle + (out.wavelength_nm[i] - middle - shape.shift) / width);
  }
  return out;
}

Status check_glow(const std::vector<GlowReading>& readings) {
  if (readings.empty() || readings.size() > kMostReadings)
    return bad_reading("temperatures", fmt::format("there are {}", readings.size()), "Give 1 to 64");
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const GlowReading& r = readings[i];
    const std::string where = fmt::format("picture {} of {:g} K", i + 1, r.temperature.value());
    if (!(r.temperature >= kColdestGlow && r.temperature <= kHottestGlow))
      return bad_reading(where, "the temperature isn't within 500 to 6000 K",
                         "Give true temperatures in kelvin; colder emitters show cameras nothing");
    bool seen = false;
    for (std::size_t c = 0; c < 3; ++c) {
      if (!std::isfinite(r.level[c]) || !std::isfinite(r.sigma[c]) || !(r.sigma[c] > 0))
        return bad_reading(where, std::string("channel ") + kNames[c] + " has no level with an error above 0",
                           "Give finite levels and standard errors");
      seen = seen || r.saturated[c] || r.level[c] > kNothing * r.sigma[c];
    }
    if (!seen)
      return bad_reading(where, "shows nothing above its noise",
                         "Expose longer, or leave this temperature out");
  }
  return {};
}

void tell_channel(const GlowProblem& problem, const Eigen::VectorXd& x, const ResponseFitOptions& options,
                  std::size_t c, ResponseFit& fit) {
  FittedChannel& channel = fit.channels[c];
  const Shape shape = problem.shape(x, c);
  const auto sigma = [&](Eigen::Index k) {
    const auto at = 3 * static_cast<Eigen::Index>(c) + k;
    return std::sqrt(fit.covariance(at, at));
  };
  const auto by_data = [](double error, double prior) {
    return std::clamp(1 - error * error / (prior * prior), 0.0, 1.0);
  };
  channel.scale = {std::exp(shape.log_scale), sigma(0), 1};
  channel.shift = {shape.shift, sigma(1), by_data(sigma(1), options.shift_prior)};
  channel.width = {std::exp(shape.log_width), sigma(2), by_data(sigma(2), options.width_prior)};
  const std::vector<double>& level = fit.response.level[c];
  const auto peak = std::max_element(level.begin(), level.end());
  channel.peak = *peak;
  channel.peak_nm = fit.response.wavelength_nm[static_cast<std::size_t>(peak - level.begin())];
}

void warn_of_fit(ResponseFit& fit) {
  bool prior = false;
  for (std::size_t c = 0; c < 3; ++c) {
    const FittedChannel& channel = fit.channels[c];
    if (channel.dead)
      fit.warnings.push_back(
          fmt::format("no picture shows light in the {} channel: its response is 0", kNames[c]));
    else
      prior = prior || channel.shift.by_data < 0.5;
  }
  if (prior)
    fit.warnings.push_back(
        "the levels tell less of where a channel lies than is assumed of any camera (10 nm, 15 % of its "
        "width): pictures of further temperatures would");
}

}  // namespace

Result<ResponseFit> fit_response(const std::vector<GlowReading>& readings, const CameraResponse& base,
                                 const ResponseFitOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_camera_response(base, "base response"));
  EMBERLOCK_RETURN_IF_ERROR(check_glow(readings));
  const GlowProblem problem(readings, base, options);
  EMBERLOCK_ASSIGN_OR_RETURN(Eigen::VectorXd x, problem.start());
  if (x.size() == 0 || !(problem.live(0) || problem.live(1) || problem.live(2)))
    return bad_reading("base response", "has no channel that any picture shows light in",
                       "Give a base whose channels are the camera's");
  x = descend(problem, std::move(x));
  const GlowProblem::Point point = problem.at(x);
  const Eigen::MatrixXd inverse =
      point.normal.ldlt().solve(Eigen::MatrixXd::Identity(point.normal.rows(), point.normal.cols()));
  ResponseFit fit;
  fit.response = shaped(problem, x, base);
  fit.covariance = Eigen::MatrixXd::Zero(9, 9);
  fit.chi_square = point.cost;
  fit.predicted.resize(readings.size());
  for (std::size_t c = 0; c < 3; ++c) {
    fit.channels[c].dead = !problem.live(c);
    if (!problem.live(c)) continue;
    --fit.freedom;
    for (std::size_t d = 0; d < 3; ++d)
      if (problem.live(d))
        fit.covariance.block<3, 3>(3 * static_cast<Eigen::Index>(c), 3 * static_cast<Eigen::Index>(d)) =
            inverse.block<3, 3>(problem.first(c), problem.first(d));
    for (std::size_t i = 0; i < readings.size(); ++i) {
      fit.freedom += readings[i].saturated[c] ? 0 : 1;
      fit.predicted[i][c] =
          level_of(problem.lobe(c), problem.shape(x, c), options.emitter, problem.kelvin(x, i)).value;
    }
  }
  if (!fit.covariance.allFinite())
    return Error{ErrorKind::not_converged, "the levels leave the response open", "camera response",
                 "Take pictures of further temperatures"};
  const double expected = std::max(1, fit.freedom);
  if (fit.chi_square > expected + 3 * std::sqrt(2 * expected)) {
    fit.covariance *= fit.chi_square / expected;
    fit.warnings.push_back(fmt::format(
        "the levels deviate from any such response: chi-square {:.1f}, {:.0f} expected. Are the pictures in "
        "the order of the temperatures, linear in light, and of the exposures told?",
        fit.chi_square, expected));
  }
  for (std::size_t c = 0; c < 3; ++c)
    if (problem.live(c)) tell_channel(problem, x, options, c, fit);
  warn_of_fit(fit);
  EMBERLOCK_RETURN_IF_ERROR(check_camera_response(fit.response, "camera response"));
  return fit;
}

std::array<double, 3> level_errors(const ResponseFit& fit, const CameraResponse& base, Kelvin temperature) {
  std::array<double, 3> out = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const FittedChannel& channel = fit.channels[c];
    if (channel.dead) continue;
    const Shape shape{0, channel.shift.value, std::log(channel.width.value)};
    const LevelAndSlopes level = level_of(lobe_of(base, c), shape, {}, temperature.value());
    if (!(level.value > 0)) continue;
    const Eigen::Vector3d slope(1, level.by_shift / level.value, level.by_width / level.value);
    const auto at = 3 * static_cast<Eigen::Index>(c);
    out[c] = std::sqrt(std::max(0.0, slope.dot(fit.covariance.block<3, 3>(at, at) * slope)));
  }
  return out;
}

const CameraResponse& sensor_response() {
  static const CameraResponse response = [] {
    CameraResponse out = standard_response();
    for (std::vector<double>& channel : out.level)
      for (double& v : channel) v = std::max(0.0, v);
    return out;
  }();
  return response;
}

}  // namespace emberlock::recon
