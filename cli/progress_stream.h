// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/child.pb.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::cli {

/// Tells another program, by v1::ChildMessages on a descriptor, what a reconstruction does. When nobody reads
/// any more it falls silent, and the work goes on.
class ProgressStream {
 public:
  /// `fd` stays open, and somebody else's. This process dies with its parent from here on, and no longer of
  /// SIGPIPE.
  static Result<ProgressStream> open(int fd);

  void loading(recon::Device device);
  void progress(double fraction, std::string_view doing);
  /// The numbers at once; pictures only where they are due, so that they take at most a twentieth of the
  /// solve's time.
  void iteration(const recon::Preview& preview, const recon::Scene& scene,
                 const recon::ComputeOptions& compute);
  void done(const recon::Outcome& outcome, const recon::Scene& scene, const std::string& folder);
  void failed(const Error& error);

 private:
  using Clock = std::chrono::steady_clock;

  explicit ProgressStream(int fd) : fd_(fd) {}
  void send(const v1::ChildMessage& message);

  int fd_;
  bool broken_ = false;
  Clock::time_point pictures_due_;
};

}  // namespace emberlock::cli
