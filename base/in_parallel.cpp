// SPDX-License-Identifier: Apache-2.0
#include "base/in_parallel.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

namespace emberlock {

Status in_parallel(std::size_t count, const Observer& observer,
                   const std::function<Status(std::size_t number, const Observer& observer)>& part) {
  std::mutex mutex;
  std::size_t next = 0;
  Status failure;
  std::vector<double> done(count, 0);
  const auto told = [&](std::size_t number, double fraction, std::string_view what) {
    const std::lock_guard lock(mutex);
    done[number] = fraction;
    const double sum = std::accumulate(done.begin(), done.end(), 0.0);
    return failure.ok() && (!observer || observer(sum / static_cast<double>(count), what));
  };
  const auto take = [&]() -> std::size_t {
    const std::lock_guard lock(mutex);
    return failure.ok() && next < count ? next++ : count;
  };
  const auto work = [&] {
    for (std::size_t number = take(); number < count; number = take()) {
      const Status ended = part(number, [&told, number](double fraction, std::string_view what) {
        return told(number, fraction, what);
      });
      const std::lock_guard lock(mutex);
      done[number] = 1;
      if (!ended.ok() && failure.ok()) failure = ended;
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t processors = std::max(std::thread::hardware_concurrency(), 1U);
    for (std::size_t i = 1; i < std::min(processors, count); ++i) others.emplace_back(work);
    work();
  }
  return failure;
}

}  // namespace emberlock
