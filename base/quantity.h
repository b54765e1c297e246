// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <compare>

namespace emberlock {

/// A number whose type is its unit. `value()` is in the unit that the alias names (SI, or image rows).
/// Quantities of one unit can be added, compared and scaled. The products below are the only ones between
/// units.
template <class Unit>
class Quantity {
 public:
  constexpr Quantity() = default;
  constexpr explicit Quantity(double value) : value_(value) {}
  [[nodiscard]] constexpr double value() const { return value_; }

  constexpr Quantity& operator+=(Quantity o) { return value_ += o.value_, *this; }
  constexpr Quantity& operator-=(Quantity o) { return value_ -= o.value_, *this; }
  constexpr Quantity& operator*=(double s) { return value_ *= s, *this; }
  constexpr Quantity& operator/=(double s) { return value_ /= s, *this; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity(a.value_ + b.value_); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity(a.value_ - b.value_); }
  friend constexpr Quantity operator-(Quantity a) { return Quantity(-a.value_); }
  friend constexpr Quantity operator*(Quantity a, double s) { return Quantity(a.value_ * s); }
  friend constexpr Quantity operator*(double s, Quantity a) { return Quantity(a.value_ * s); }
  friend constexpr Quantity operator/(Quantity a, double s) { return Quantity(a.value_ / s); }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.value_ / b.value_; }
  friend constexpr auto operator<=>(Quantity, Quantity) = default;

 private:
  double value_ = 0;
};

using Seconds = Quantity<struct SecondsUnit>;
using Rows = Quantity<struct RowsUnit>;                    ///< image rows; +y is down
using SecondsPerRow = Quantity<struct SecondsPerRowUnit>;  ///< t_row, the time to shift one row
using Meters = Quantity<struct MetersUnit>;
using Radians = Quantity<struct RadiansUnit>;
using Kelvin = Quantity<struct KelvinUnit>;
using PerMeter = Quantity<struct PerMeterUnit>;  ///< extinction, absorption, scattering coefficients
using Hertz = Quantity<struct HertzUnit>;
using PartsPerMillion = Quantity<struct PartsPerMillionUnit>;

constexpr Seconds milliseconds(double v) { return Seconds(v * 1e-3); }
constexpr Seconds microseconds(double v) { return Seconds(v * 1e-6); }
constexpr Seconds nanoseconds(double v) { return Seconds(v * 1e-9); }
constexpr double in_milliseconds(Seconds t) { return t.value() * 1e3; }
constexpr double in_microseconds(Seconds t) { return t.value() * 1e6; }
constexpr SecondsPerRow microseconds_per_row(double v) { return SecondsPerRow(v * 1e-6); }

constexpr Seconds operator*(Rows r, SecondsPerRow t) { return Seconds(r.value() * t.value()); }
constexpr Seconds operator*(SecondsPerRow t, Rows r) { return r * t; }
constexpr Rows operator/(Seconds t, SecondsPerRow per_row) { return Rows(t.value() / per_row.value()); }
constexpr SecondsPerRow operator/(Seconds t, Rows r) { return SecondsPerRow(t.value() / r.value()); }
constexpr double operator*(PerMeter c, Meters l) { return c.value() * l.value(); }
constexpr double operator*(Meters l, PerMeter c) { return c * l; }
constexpr double operator*(Hertz f, Seconds t) { return f.value() * t.value(); }
constexpr Seconds period(Hertz f) { return Seconds(1 / f.value()); }
constexpr Hertz rate(Seconds t) { return Hertz(1 / t.value()); }

/// a modulo n in [0, n), for n > 0. Rounding never yields n itself.
inline double wrap_positive(double a, double n) {
  const double r = a - n * std::floor(a / n);
  return r >= n || r < 0 ? 0 : r;
}
/// a modulo n in [-n/2, n/2).
inline double wrap_symmetric(double a, double n) { return wrap_positive(a + n / 2, n) - n / 2; }

template <class Unit>
Quantity<Unit> wrap_positive(Quantity<Unit> a, Quantity<Unit> n) {
  return Quantity<Unit>(wrap_positive(a.value(), n.value()));
}
template <class Unit>
Quantity<Unit> wrap_symmetric(Quantity<Unit> a, Quantity<Unit> n) {
  return Quantity<Unit>(wrap_symmetric(a.value(), n.value()));
}
template <class Unit>
Quantity<Unit> abs(Quantity<Unit> a) {
  return Quantity<Unit>(std::abs(a.value()));
}

}  // namespace emberlock
