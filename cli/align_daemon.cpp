// SPDX-License-Identifier: Apache-2.0
#include "cli/align_daemon.h"

#include <cstdint>
#include <cstdio>
#include <optional>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

bool is_aligning(v1::Phase phase) { return phase == v1::ALIGNING || phase == v1::CALIBRATING; }

/// Tells the alignment that was asked for from the one before, whose status may still be on its way.
class Follower {
 public:
  Follower(const v1::DaemonStatus& before, bool json) : before_(before), json_(json) {}

  /// False when it has come to an end.
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
      std::printf("%s", round_table(status).c_str());
      if (!status.next_step().empty()) std::printf("  next: %s\n", status.next_step().c_str());
    }
    std::fflush(stdout);
  }

  v1::DaemonStatus before_;
  bool json_;
  bool ours_ = false;
  std::optional<v1::DaemonStatus> last_;
};

void print_end(const v1::DaemonStatus& status) {
  std::printf("%s: %s\n", in_words(v1::Phase_Name(status.phase())).c_str(), status.reason().c_str());
  for (const v1::AlignmentOffer& offer : status.alignment().offers()) {
    std::printf("  could be met: %.0f rows with policy %s, %.0f resets, %s\n", offer.tolerance_rows(),
                offer.policy().c_str(), offer.cost().resets(),
                seconds_in_words(offer.cost().time_s()).c_str());
  }
}

}  // namespace

void align_by_daemon(const DaemonAlignment& wanted) {
  Client client = connect_or_leave(wanted.daemon);
  if (wanted.stop) return or_leave(client, client.stop_sync());
  Follower follower(or_leave(client, client.status()), wanted.json);
  or_leave(client, client.align(wanted.request));
  const Interrupt interrupt;
  or_leave(client, client.watch_status([&](const v1::DaemonStatus& status) { return follower.take(status); },
                                       Interrupt::asked));
  if (Interrupt::asked()) {
    std::fprintf(stderr, "the daemon goes on; `emberlock align --stop` ends it\n");
    throw CLI::RuntimeError(1);
  }
  if (!follower.last()) leave(client, {ErrorKind::io, "the daemon ended before it aligned"});
  if (!wanted.json) print_end(*follower.last());
  const v1::Phase phase = follower.last()->phase();
  if (phase != v1::LOCKED && phase != v1::CAPTURING) throw CLI::RuntimeError(1);
}

}  // namespace emberlock::cli
