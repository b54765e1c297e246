// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include <gtest/gtest.h>
#include <rapidcheck.h>

// What RapidCheck's properties are written with. Call the generators only within a property.
namespace emberlock::test {

inline void law(const char* name, const std::function<void()>& property) {
  EXPECT_TRUE(rc::check(name, property));
}

/// In [low, high), however far the search has come.
inline int any_int(int low, int high) {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(low, high));
}
/// In steps of a millionth of the range.
inline double any_real(double low, double high) { return low + (high - low) * any_int(0, 1000001) * 1e-6; }

}  // namespace emberlock::test
