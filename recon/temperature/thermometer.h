// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <utility>

#include <Eigen/Core>

#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// What is known of a place: its emission in levels a metre, and where extinction was reconstructed and
/// nothing scatters, its absorption.
struct Glow {
  Eigen::Vector3d level = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< inverse of the levels' covariance; a channel
                                                          ///< that isn't known has a row and column of 0
  double absorption = 0;                                  ///< 1/m
  double absorption_sigma = 0;                            ///< 0: not known
};
/// Levels whose errors are independent; an infinite one isn't known.
Glow glow_of(const Eigen::Vector3d& level, const Eigen::Vector3d& sigma);

/// The temperature that most likely shows a glow: of all absorptions that aren't negative, the one that fits
/// best (maximum likelihood, channels and absorption joined by their errors).
struct Reading {
  double kelvin = 0;
  double sigma = 0;       ///< by the curvature of the likelihood, at least what chi-square per freedom says
  double absorption = 0;  ///< 1/m if the response is absolute; else relative
  double chi_square = 0;  ///< of the fit
  int freedom = 0;        ///< data less unknowns; 0: any data fit
  enum class Told { yes, colder, hotter, no } told = Told::no;  ///< beyond the table's end; or not at all
};

/// Chi-square a freedom above which no temperature shows a glow: four sigma.
inline constexpr double kNoBody = 16;

/// Data of a glow that a table can use: channels, and the absorption where the response is absolute.
bool absorption_counts(const Glow& glow, const EmitterTable& table);
int data_of(const Glow& glow, const EmitterTable& table);

/// The temperature from `coldest` to `hottest` where chi-square is least, and its error; all but
/// Reading::absorption.
Reading most_likely(Kelvin coldest, Kelvin hottest, int freedom,
                    const std::function<double(double kelvin)>& chi_square);

/// Reads temperatures by a table. Immutable, thread-safe.
class Thermometer {
 public:
  explicit Thermometer(EmitterTable table) : table_(std::move(table)) {}
  [[nodiscard]] const EmitterTable& table() const { return table_; }
  [[nodiscard]] Reading read(const Glow& glow) const;

  /// Chi-square of a temperature with the best absorption, which `absorption` receives.
  [[nodiscard]] double chi_square(const Glow& glow, double kelvin, double* absorption = nullptr) const;

 private:
  EmitterTable table_;
};

}  // namespace emberlock::recon
