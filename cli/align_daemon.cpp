// SPDX-License-Identifier: Apache-2.0
#include "cli/align_daemon.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"
#include "cli/phase_circle.h"

namespace emberlock::cli {
namespace {

bool is_aligning(v1::Phase phase) { return phase == v1::ALIGNING || phase == v1::CALIBRATING; }

/// Distinguishes the requested alignment from the previous one, whose status may still arrive.
class Follower {
 public:
  Follower(const v1::DaemonStatus& before, const DaemonAlignment& wanted)
      : before_(before), json_(wanted.json), detail_(wanted.detail) {}

  /// False when the alignment has ended.
  bool take(const v1::DaemonStatus& status) {
    const bool news = status.revision() > before_.revision() &&
                      status.alignment().SerializeAsString() != before_.alignment().SerializeAsString();
    ours_ = ours_ || is_aligning(status.phase()) || news;
    if (!ours_) return true;
    show(status);
    last_ = status;
    return is_aligning(status.phase());
  }

  [[nodiscard]] const std::optional<v1::DaemonStatus>& last() const { return last_; }

 private:
  void show(const v1::DaemonStatus& status) {
    const bool same = last_ && last_->phase() == status.phase() &&
                      last_->alignment().round() == status.alignment().round() &&
                      last_->alignment().reset_next() == status.alignment().reset_next();
    if (same) return;
    if (json_) {
      std::printf("%s\n", json_line(status).c_str());
    } else {
      std::printf("%s", (detail_ == AlignDetail::all ? round_table(status) : round_line(status)).c_str());
      if (!status.next_step().empty()) std::printf("  next: %s\n", status.next_step().c_str());
    }
    std::fflush(stdout);
  }

  v1::DaemonStatus before_;
  bool json_;
  AlignDetail detail_;
  bool ours_ = false;
  std::optional<v1::DaemonStatus> last_;
};

/// The cameras on the circle, where the last round saw any.
std::string circle_of(const v1::DaemonStatus& status) {
  const v1::AlignmentStatus& alignment = status.alignment();
  std::vector<CirclePoint> points;
  for (const v1::CameraStatus& camera : status.cameras()) {
    points.push_back({camera.id(), {}});
    if (camera.has_error_s()) points.back().error = Seconds(camera.error_s());
  }
  const bool seen = std::any_of(points.begin(), points.end(), [](const CirclePoint& p) { return !!p.error; });
  if (!seen || alignment.period_s() <= 0 || alignment.row_time_s() <= 0) return {};
  return phase_circle(points, Seconds(alignment.period_s()), Seconds(alignment.tolerance_s()),
                      SecondsPerRow(alignment.row_time_s()), alignment.staggered());
}

void print_end(const v1::DaemonStatus& status) {
  std::printf("%s: %s\n", in_words(v1::Phase_Name(status.phase())).c_str(), status.reason().c_str());
  std::printf("%s", circle_of(status).c_str());
  for (const v1::AlignmentOffer& offer : status.alignment().offers()) {
    std::printf("  could be met: %s with policy %s, %.0f resets, %s\n",
                tolerance_in_words(offer.tolerance_s(), offer.tolerance_rows()).c_str(),
                offer.policy().c_str(), offer.cost().resets(),
                seconds_in_words(offer.cost().time_s()).c_str());
  }
}

}  // namespace

void align_by_daemon(const DaemonAlignment& wanted) {
  Client client = connect_or_leave(wanted.daemon);
  if (wanted.stop) return or_leave(client, client.stop_sync());
  Follower follower(or_leave(client, client.status()), wanted);
  or_leave(client, client.align(wanted.request));
  const Interrupt interrupt;
  or_leave(client, client.watch_status([&](const v1::DaemonStatus& status) { return follower.take(status); },
                                       Interrupt::asked));
  if (Interrupt::asked()) {
    std::fprintf(stderr, "the daemon goes on; `emberlock align --stop` ends it\n");
    throw Exit(1);
  }
  if (!follower.last()) leave(client, {ErrorKind::io, "the daemon ended before it aligned"});
  if (!wanted.json) print_end(*follower.last());
  const v1::Phase phase = follower.last()->phase();
  if (phase != v1::LOCKED && phase != v1::CAPTURING) throw Exit(1);
}

}  // namespace emberlock::cli
