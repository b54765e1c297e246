// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/pool.h"

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "recon/compute/cuda_device.h"

#ifdef EMBERLOCK_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace emberlock::recon {
namespace {

// Debian's oneTBB isn't instrumented, so ThreadSanitizer doesn't see that starting a task and waiting for it
// order memory accesses. These two calls tell it; in other builds they do nothing.
void publish([[maybe_unused]] void* address) {
#ifdef EMBERLOCK_THREAD_SANITIZER
  __tsan_release(address);
#endif
}
void observe([[maybe_unused]] void* address) {
#ifdef EMBERLOCK_THREAD_SANITIZER
  __tsan_acquire(address);
#endif
}

std::size_t thread_count(int threads) {
  return threads > 0 ? static_cast<std::size_t>(threads)
                     : std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

Device resolved(Device choice) {
  const Result<Device> device = resolve(choice);
  if (!device.ok()) throw DeviceError(device.error());
  return *device;
}

}  // namespace

struct Pool::Arena {
  explicit Arena(std::size_t threads)
      : limit(tbb::global_control::max_allowed_parallelism, std::max(threads, thread_count(0))),
        arena(static_cast<int>(threads)) {}
  tbb::global_control limit;  // of the process: several pools may be at work at once
  tbb::task_arena arena;
  char started = 0;  // addresses for publish and observe
  char ended = 0;
};

Pool::Pool(int threads, Device device)
    : arena_(std::make_unique<Arena>(thread_count(threads))), device_(device) {
  if (device == Device::cuda) use_gpu(device.gpu);
}
Pool::Pool(const ComputeOptions& compute) : Pool(compute.threads, resolved(compute.device)) {}
Pool::~Pool() = default;

void Pool::run(int tasks, const std::function<void(int)>& task) {
  Arena& a = *arena_;
  publish(&a.started);
  a.arena.execute([&] {
    tbb::parallel_for(
        0, tasks,
        [&](int i) {
          observe(&a.started);
          task(i);
          publish(&a.ended);
        },
        tbb::simple_partitioner());
  });
  observe(&a.ended);
}

void at_once(const Pool& pool, int count, const std::function<void(int)>& act) {
  if (pool.device() != Device::cuda || count < 2) {
    for (int i = 0; i < count; ++i) act(i);
    return;
  }
  finish_gpu_work();  // what the others read is there
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count));
  std::vector<std::thread> threads;
  threads.reserve(thrown.size());
  for (int i = 0; i < count; ++i)
    threads.emplace_back([&, i] {
      try {
        use_gpu(pool.device().gpu);
        act(i);
        finish_gpu_work();
      } catch (...) {
        thrown[static_cast<std::size_t>(i)] = std::current_exception();
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
}

}  // namespace emberlock::recon
