// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/time_point.h"
#include "daemon/live/reasons.h"
#include "daemon/live/yield.h"
#include "emberlock/v1/child.pb.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// What a child's messages and end, and its verdicts, say of a recording's live volumes: pure.
class LiveState {
 public:
  LiveState(const std::string& session, const v1::LiveRequest& request);

  /// What the board shall show of it, if anything. `now` is on the clock of the frames' arrivals.
  std::optional<v1::IterationPreview> take(v1::ChildMessage&& message, TimePoint now);
  void yield(LiveYield::Verdict verdict, const LiveReason& reason);
  /// The child has ended though nobody wanted it to.
  void failed(const ChildEnd& end, const std::string& last_words);
  /// With the recording. What has ended before stays as it is.
  void ended();

  /// Without a reason in words.
  [[nodiscard]] const v1::LiveStatus& status() const { return status_; }
  [[nodiscard]] LiveReason reason() const;
  /// "take 1 live": what previews name as their reconstruction.
  [[nodiscard]] std::string name() const { return status_.session() + " live"; }

 private:
  [[nodiscard]] bool over() const;
  v1::IterationPreview preview_of(v1::LiveFrame&& frame);

  v1::LiveStatus status_;
  LiveReason reason_;      ///< of PAUSED, STOPPED, FAILED
  std::string no_volume_;  ///< why the newest frame without one has none
  std::string told_;       ///< the failure that the child told itself
};

}  // namespace emberlock::daemon
