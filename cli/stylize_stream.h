// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>

#include "apply/stylize.h"
#include "base/quantity.h"
#include "base/result.h"
#include "cli/progress_stream.h"
#include "emberlock/v1/services.pb.h"
#include "session/child_messages.h"

namespace emberlock::cli {

/// What is to be done by who may name no files (v1::EditRequest): its operation. The pictures that came with
/// an object are put into `folder`, which is there, named after their bytes. Errors: those of
/// parse_foreign_operation(); pictures that are neither PNG nor JPEG, damaged, or of more than kMostPixels a
/// side.
Result<apply::Operation> operation_of(const v1::EditRequest& request, const std::filesystem::path& folder);
inline constexpr int kMostPixels = 4096;

/// A stylization that another program runs (emberlock/v1/child.proto): steps come on a descriptor, and
/// previews go to a stream. It goes on for so many passes after each step, then waits without working.
class StylizeStream {
 public:
  /// `last` of the reconstruction before. `folder` takes the pictures of objects.
  StylizeStream(apply::Stylization& stylization, const recon::Scene& captured, const recon::TracePoint& last,
                int passes_after_a_step, std::filesystem::path folder, ProgressStream& stream);

  /// Until nothing comes any more on `fd`. Errors: those of Stylization::pass().
  Status run(int fd);

 private:
  using Clock = std::chrono::steady_clock;

  /// Until a request came, or nothing did for so long; false: nothing will.
  bool read(int fd, std::chrono::milliseconds longest);
  void take(const v1::EditRequest& request);
  Status carry_out(const v1::EditRequest& request);
  Status pass();
  void show();
  [[nodiscard]] bool pauses() const { return stylization_.passes() >= end_; }
  [[nodiscard]] v1::StylizationStatus status() const;

  apply::Stylization& stylization_;
  const recon::Scene& captured_;
  recon::TracePoint last_;
  const int passes_after_a_step_;
  const std::filesystem::path folder_;
  ProgressStream& stream_;
  session::EditRequestParser parser_;
  std::size_t view_ = 0;
  int end_ = 0;          // passes in all
  Seconds worked_{0};    // on passes
  bool edited_ = false;  // since the last pass
  Clock::time_point volume_due_;
  Clock::time_point due_;  // of a preview
};

}  // namespace emberlock::cli
