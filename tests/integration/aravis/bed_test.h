// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdlib>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/clock.h"
#include "drivers/aravis/aravis_driver.h"
#include "tests/integration/aravis/fake_cameras.h"
#include "tests/integration/aravis/film.h"
#include "tests/support/wait.h"

namespace emberlock::testing_support {

/// The film that the figures speak of, at which the fake camera's pixels are known.
inline drivers::CameraRequest small_film() {
  drivers::CameraRequest request;
  request.size = ImageSize{640, 480};
  request.format = PixelFormat::gray8;
  request.frame_rate = Hertz(15);
  request.exposure = milliseconds(10);
  return request;
}

/// A number from the environment: how long or how often, where the short run isn't enough.
inline int asked_for(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atoi(text);
}

class AravisBed : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(why_no_bed(), "") << "no test bed"; }

  /// `n` cameras named `prefix`1 ..., listening.
  std::vector<std::unique_ptr<FakeCamera>> fakes(int n, const std::string& prefix, int first_host = 2,
                                                 int lost_per_thousand = 0) {
    std::vector<std::unique_ptr<FakeCamera>> all;
    for (int i = 0; i < n; ++i) {
      all.push_back(
          std::make_unique<FakeCamera>(first_host + i, prefix + std::to_string(i + 1), lost_per_thousand));
    }
    EXPECT_TRUE(test::wait_until([&] {
      return std::all_of(all.begin(), all.end(), [](const auto& fake) { return fake->listens(); });
    }));
    return all;
  }

  /// All opened, at the same time.
  std::vector<std::unique_ptr<drivers::Camera>> open_all(
      const std::vector<std::unique_ptr<FakeCamera>>& cameras, const drivers::CameraRequest& request) {
    std::vector<std::future<Result<std::unique_ptr<drivers::Camera>>>> opening;
    for (const auto& fake : cameras) {
      opening.push_back(std::async(std::launch::async, driver.open, fake->serial(), request));
    }
    std::vector<std::unique_ptr<drivers::Camera>> all;
    for (auto& one : opening) {
      auto opened = one.get();
      EXPECT_TRUE(opened.ok()) << opened.error().message();
      if (opened) all.push_back(std::move(opened).value());
    }
    return all;
  }

  const drivers::CameraDriver driver = drivers::aravis_driver();
  SteadyClock clock;
};

}  // namespace emberlock::testing_support
