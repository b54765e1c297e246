// SPDX-License-Identifier: Apache-2.0
#pragma once

// A GPU in software, for tests (EMBERLOCK_CUDA=SOFTWARE): as much of CUDA's runtime as Emberlock calls, over
// the CPU's memory. The .cu files compile as C++ and run wherever there is no GPU, so that what they string
// together is tested there too, and so that sanitizers see each access and each race of a launch.
//
// It is stricter than a GPU where that shows errors: memory comes filled with a pattern that is no number; a
// launch runs its calls on two threads, each half in another order; what a launch is told must not point into
// the CPU's memory. With EMBERLOCK_SOFTWARE_GPU=closed the CPU can't touch the GPU's memory but by launches
// and copies, which then take several times as long. It says nothing of speed, of warps, or of what nvcc
// makes of the code.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <sys/mman.h>

enum cudaError_t {
  cudaSuccess,
  cudaErrorMemoryAllocation,
  cudaErrorNotReady,
  cudaErrorIllegalAddress,
  cudaErrorInvalidValue,
  cudaErrorStreamCaptureUnsupported,
};
enum cudaMemcpyKind { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
enum cudaDeviceAttr {
  cudaDevAttrComputeCapabilityMajor,
  cudaDevAttrComputeCapabilityMinor,
  cudaDevAttrMemoryPoolsSupported,
};
enum cudaMemPoolAttr {
  cudaMemPoolAttrReleaseThreshold,
  cudaMemPoolAttrReservedMemCurrent,
  cudaMemPoolAttrUsedMemCurrent,
};
enum cudaStreamCaptureMode { cudaStreamCaptureModeThreadLocal };
using cudaMemPool_t = int*;
using cudaStream_t = int*;
using cudaEvent_t = int*;

namespace software_gpu {

using Work = std::function<void()>;

/// Addresses far from those of the CPU's memory, but where ThreadSanitizer lets programs be.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define EMBERLOCK_UNDER_TSAN
#endif
#endif
#ifdef EMBERLOCK_UNDER_TSAN
inline constexpr std::uintptr_t kWanted = 0;
inline constexpr int kExactly = 0;
#else
inline constexpr std::uintptr_t kWanted = 0x200000000000;
inline constexpr int kExactly = MAP_FIXED_NOREPLACE;
#endif
/// Programs, libraries, heaps and stacks lie above on x86-64.
inline constexpr std::uintptr_t kFirstOfTheCpu = 0x500000000000;
inline constexpr std::size_t kSize = std::size_t{1} << 35;
/// What EMBERLOCK_SOFTWARE_GPU_MB allows, for tests of a memory that is too small.
inline std::size_t capacity() {
  const char* told = std::getenv("EMBERLOCK_SOFTWARE_GPU_MB");
  return told != nullptr ? std::strtoull(told, nullptr, 10) << 20 : kSize;
}

/// The memory: pieces of whole pages that follow each other, and those that were freed, by size. Each
/// piece has a page behind it that nobody may touch.
class Memory {
 public:
  static Memory& get() {
    static Memory memory;
    return memory;
  }

  void* allocate(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    const std::size_t pages = (bytes + kPage - 1) / kPage * kPage;
    if (used_ + pages > capacity()) return nullptr;
    std::uintptr_t at = 0;
    const auto free =
        std::find_if(free_.begin(), free_.end(), [&](const Piece& p) { return p.bytes == pages; });
    if (free != free_.end()) {
      at = free->at;
      free_.erase(free);
    } else {
      if (next_ + pages + kPage > first_ + kSize) return nullptr;
      at = next_;
      next_ += pages + kPage;
    }
    used_ += pages;
    most_ = std::max(most_, used_);
    // Ends as close to the page that nobody may touch as the largest elements' alignment allows.
    const std::uintptr_t begin = at + (pages - bytes) / kAlign * kAlign;
    pieces_.push_back({at, pages});
    protect(pieces_.back(), true);
    std::memset(reinterpret_cast<void*>(begin), 0xff, at + pages - begin);
    if (closes_ && open_ == 0) protect(pieces_.back(), false);
    return reinterpret_cast<void*>(begin);
  }
  void free(void* data) {
    const std::lock_guard lock(mutex_);
    const auto at = reinterpret_cast<std::uintptr_t>(data);
    const auto piece = std::find_if(pieces_.begin(), pieces_.end(),
                                    [&](const Piece& p) { return at >= p.at && at < p.at + p.bytes; });
    if (piece == pieces_.end()) std::abort();  // freed twice, or never the GPU's
    ::madvise(reinterpret_cast<void*>(piece->at), piece->bytes, MADV_DONTNEED);
    ::mprotect(reinterpret_cast<void*>(piece->at), piece->bytes, PROT_NONE);
    used_ -= piece->bytes;
    free_.push_back(*piece);
    pieces_.erase(piece);
  }
  [[nodiscard]] bool holds(const void* data) const {
    const auto at = reinterpret_cast<std::uintptr_t>(data);
    return at >= first_ && at < first_ + kSize;
  }
  [[nodiscard]] std::size_t used() {
    const std::lock_guard lock(mutex_);
    return used_;
  }
  /// The most that was in use at once: what a pool that gives nothing back has from the driver.
  [[nodiscard]] std::size_t reserved() {
    const std::lock_guard lock(mutex_);
    return most_;
  }
  /// The GPU's memory can be touched while any of these lives, if it is closed at all.
  class Open {
   public:
    Open() {
      if (get().closes_) get().open(1);
    }
    ~Open() {
      if (get().closes_) get().open(-1);
    }
    Open(Open&&) = delete;
    Open& operator=(Open&&) = delete;
  };
  /// Whether there is memory of the CPU at this address.
  static bool is_of_the_cpu(std::uintptr_t address) {
    unsigned char in = 0;
    return address >= kFirstOfTheCpu &&
           ::mincore(reinterpret_cast<void*>(address / kPage * kPage), 1, &in) == 0;
  }

 private:
  static constexpr std::size_t kPage = 4096;
  static constexpr std::size_t kAlign = 32;
  struct Piece {
    std::uintptr_t at;
    std::size_t bytes;
  };

  Memory() {
    void* const mapped = ::mmap(reinterpret_cast<void*>(kWanted), kSize, PROT_NONE,
                                MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | kExactly, -1, 0);
    if (mapped == MAP_FAILED) std::abort();
    first_ = next_ = reinterpret_cast<std::uintptr_t>(mapped);
  }
  static void protect(const Piece& piece, bool open) {
    ::mprotect(reinterpret_cast<void*>(piece.at), piece.bytes, open ? PROT_READ | PROT_WRITE : PROT_NONE);
  }
  void open(int change) {
    const std::lock_guard lock(mutex_);
    const bool was = open_ > 0;
    open_ += change;
    if (was != (open_ > 0))
      for (const Piece& piece : pieces_) protect(piece, open_ > 0);
  }

  static bool told_to_close() {
    const char* told = std::getenv("EMBERLOCK_SOFTWARE_GPU");
    return told != nullptr && std::strcmp(told, "closed") == 0;
  }

  const bool closes_ = told_to_close();
  std::mutex mutex_;
  std::uintptr_t first_ = 0;
  std::uintptr_t next_ = 0;
  std::size_t used_ = 0, most_ = 0;
  int open_ = 0;
  std::vector<Piece> pieces_, free_;
};

/// What a thread's stream records instead of doing it, between cudaStreamBeginCapture and EndCapture.
inline thread_local std::vector<Work>* recording = nullptr;
inline thread_local cudaError_t last_error = cudaSuccess;

inline void enqueue(Work work) {
  if (recording != nullptr) return recording->push_back(std::move(work));
  const Memory::Open open;
  work();
}

/// Whether any word of what a launch is told is an address of the CPU's memory. GCC alone tells padding,
/// which may hold anything.
template <class Act>
bool points_to_the_cpu([[maybe_unused]] Act act) {
#if __has_builtin(__builtin_clear_padding)
  __builtin_clear_padding(&act);
  std::uintptr_t words[sizeof(Act) / sizeof(std::uintptr_t) + 1] = {};
  std::memcpy(words, &act, sizeof(Act) / sizeof(std::uintptr_t) * sizeof(std::uintptr_t));
  return std::any_of(std::begin(words), std::end(words), Memory::is_of_the_cpu);
#else
  return false;
#endif
}

template <class Act>
void launch(std::size_t first, std::size_t last, const Act& act) {
  if (points_to_the_cpu(act)) {
    last_error = cudaErrorIllegalAddress;
    return;
  }
  enqueue([act, first, last] {
    const std::size_t middle = first + (last - first) / 2;
    constexpr std::size_t kWorthAThread = 2048;
    const auto upwards = [&] {
      for (std::size_t i = first; i < middle; ++i) act(i);
    };
    std::thread other;
    if (last - first > kWorthAThread) other = std::thread(upwards);
    for (std::size_t i = last; i-- > middle;) act(i);
    if (other.joinable())
      other.join();
    else
      upwards();
  });
}

}  // namespace software_gpu

struct SoftwareGraph {
  std::vector<software_gpu::Work> works;
};
using cudaGraph_t = SoftwareGraph*;
using cudaGraphExec_t = SoftwareGraph*;

inline const char* cudaGetErrorString(cudaError_t code) {
  switch (code) {
    case cudaSuccess:
      return "no error";
    case cudaErrorMemoryAllocation:
      return "out of memory";
    case cudaErrorNotReady:
      return "not ready";
    case cudaErrorIllegalAddress:
      return "an illegal memory access was encountered";
    case cudaErrorInvalidValue:
      return "invalid argument";
    case cudaErrorStreamCaptureUnsupported:
      return "operation not permitted when stream is capturing";
  }
  return "unknown error";
}
inline cudaError_t cudaGetLastError() { return std::exchange(software_gpu::last_error, cudaSuccess); }
inline cudaError_t cudaGetDeviceCount(int* count) {
  *count = 2;
  return cudaSuccess;
}
inline cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr /*which*/, int /*gpu*/) {
  *value = 9;
  return cudaSuccess;
}
inline cudaError_t cudaSetDevice(int /*gpu*/) { return cudaSuccess; }
inline cudaError_t cudaGetDevice(int* gpu) {
  *gpu = 0;
  return cudaSuccess;
}
inline cudaError_t cudaDeviceGetDefaultMemPool(cudaMemPool_t* pool, int /*gpu*/) {
  *pool = nullptr;
  return cudaSuccess;
}
inline cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t /*pool*/, cudaMemPoolAttr /*which*/,
                                           void* /*value*/) {
  return cudaSuccess;
}
inline cudaError_t cudaMemPoolGetAttribute(cudaMemPool_t /*pool*/, cudaMemPoolAttr which, void* value) {
  if (which == cudaMemPoolAttrReleaseThreshold) return cudaErrorInvalidValue;
  auto& memory = software_gpu::Memory::get();
  *static_cast<std::uint64_t*>(value) =
      which == cudaMemPoolAttrReservedMemCurrent ? memory.reserved() : memory.used();
  return cudaSuccess;
}
inline cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  *total = software_gpu::capacity();
  *free = *total - software_gpu::Memory::get().used();
  return cudaSuccess;
}
inline cudaError_t cudaMallocAsync(void** data, std::size_t bytes, cudaStream_t /*stream*/) {
  if (software_gpu::recording != nullptr) return cudaErrorStreamCaptureUnsupported;
  *data = software_gpu::Memory::get().allocate(bytes);
  return *data != nullptr ? cudaSuccess : software_gpu::last_error = cudaErrorMemoryAllocation;
}
inline cudaError_t cudaFreeAsync(void* data, cudaStream_t /*stream*/) {
  if (software_gpu::recording != nullptr) return cudaErrorStreamCaptureUnsupported;
  software_gpu::Memory::get().free(data);
  return cudaSuccess;
}
inline cudaError_t cudaMallocHost(void** data, std::size_t bytes) {
  *data = std::malloc(bytes);
  return cudaSuccess;
}
template <class T>
cudaError_t cudaMallocHost(T** data, std::size_t bytes) {
  return cudaMallocHost(reinterpret_cast<void**>(data), bytes);
}
inline cudaError_t cudaFreeHost(void* data) {
  std::free(data);
  return cudaSuccess;
}
inline cudaError_t cudaMemsetAsync(void* data, int value, std::size_t bytes,
                                   cudaStream_t /*stream*/ = nullptr) {
  software_gpu::enqueue([=] { std::memset(data, value, bytes); });
  return cudaSuccess;
}
inline cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind,
                                   cudaStream_t /*stream*/ = nullptr) {
  const software_gpu::Memory& memory = software_gpu::Memory::get();
  if (memory.holds(to) != (kind != cudaMemcpyDeviceToHost) ||
      memory.holds(from) != (kind != cudaMemcpyHostToDevice))
    return cudaErrorInvalidValue;
  software_gpu::enqueue([=] { std::memcpy(to, from, bytes); });
  return cudaSuccess;
}
/// The legacy copy waits, which a stream that records can't.
inline cudaError_t cudaMemcpy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) {
  if (software_gpu::recording != nullptr) return cudaErrorStreamCaptureUnsupported;
  return cudaMemcpyAsync(to, from, bytes, kind);
}
inline cudaStream_t const cudaStreamPerThread = nullptr;
inline constexpr unsigned cudaStreamNonBlocking = 1;
inline constexpr unsigned cudaEventDisableTiming = 2;
inline cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned /*flags*/) {
  *stream = new int;
  return cudaSuccess;
}
inline cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  delete stream;
  return cudaSuccess;
}
inline cudaError_t cudaDeviceSynchronize() { return cudaSuccess; }
inline cudaError_t cudaStreamSynchronize(cudaStream_t /*stream*/) { return cudaSuccess; }
inline cudaError_t cudaStreamWaitEvent(cudaStream_t /*stream*/, cudaEvent_t /*event*/) { return cudaSuccess; }
inline cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned /*flags*/) {
  *event = new int;
  return cudaSuccess;
}
inline cudaError_t cudaEventDestroy(cudaEvent_t event) {
  delete event;
  return cudaSuccess;
}
inline cudaError_t cudaEventRecord(cudaEvent_t /*event*/, cudaStream_t /*stream*/) { return cudaSuccess; }
inline cudaError_t cudaEventQuery(cudaEvent_t /*event*/) { return cudaSuccess; }

inline cudaError_t cudaStreamBeginCapture(cudaStream_t /*stream*/, cudaStreamCaptureMode /*mode*/) {
  if (software_gpu::recording != nullptr) return cudaErrorStreamCaptureUnsupported;
  software_gpu::recording = new std::vector<software_gpu::Work>;
  return cudaSuccess;
}
inline cudaError_t cudaStreamEndCapture(cudaStream_t /*stream*/, cudaGraph_t* graph) {
  if (software_gpu::recording == nullptr) return cudaErrorStreamCaptureUnsupported;
  *graph = new SoftwareGraph{std::move(*software_gpu::recording)};
  delete std::exchange(software_gpu::recording, nullptr);
  return cudaSuccess;
}
inline cudaError_t cudaGraphInstantiate(cudaGraphExec_t* exec, cudaGraph_t graph,
                                        unsigned long long /*flags*/) {
  *exec = new SoftwareGraph(*graph);
  return cudaSuccess;
}
inline cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t /*stream*/) {
  for (const software_gpu::Work& work : exec->works) software_gpu::enqueue(work);
  return cudaSuccess;
}
inline cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
inline cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec) {
  delete exec;
  return cudaSuccess;
}
