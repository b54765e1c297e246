// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include <arv.h>

#include "base/quantity.h"
#include "base/result.h"

// RAII owners for GLib and Aravis, and a wrapper for calls that may hang.
namespace emberlock::drivers::aravis {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// Owns one reference to a GObject.
template <class T>
using ObjectPtr = std::unique_ptr<T, Unref>;

struct Free {
  void operator()(gpointer memory) const { g_free(memory); }
};
template <class T>
using MemoryPtr = std::unique_ptr<T, Free>;

/// Receives a library call's error: `arv_...(camera, error.out())`.
class ErrorSlot {
 public:
  ErrorSlot() = default;
  ErrorSlot(const ErrorSlot&) = delete;
  ErrorSlot& operator=(const ErrorSlot&) = delete;
  ~ErrorSlot() { g_clear_error(&error_); }

  /// Pass this to one call; it clears an earlier error.
  GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  [[nodiscard]] std::string text() const { return error_ == nullptr ? "" : error_->message; }
  [[nodiscard]] Error error(ErrorKind kind, const std::string& where, std::string remedy = {}) const {
    return {kind, text(), where, std::move(remedy)};
  }

 private:
  GError* error_ = nullptr;
};

/// Runs work that may hang on its own thread, which is left behind if nobody waits for it. The captured
/// objects and an unused result are destroyed on that thread, because that may hang too.
template <class T>
std::future<T> in_background(std::function<T()> work) {
  std::promise<T> promise;
  auto answer = promise.get_future();
  std::thread([promise = std::move(promise), work = std::move(work)]() mutable {
    T value = work();
    work = nullptr;
    promise.set_value(std::move(value));
  }).detach();
  return answer;
}

template <class T>
bool done_within(const std::future<T>& answer, Seconds deadline) {
  return answer.wait_for(std::chrono::duration<double>(deadline.value())) == std::future_status::ready;
}

}  // namespace emberlock::drivers::aravis
