// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/lent_frame.h"

#include <cstdlib>

#include "tests/fuzz/target.h"

/// Whatever another host sends for a frame: an error that says where and what to do, or a picture of the size
/// that it claims, which goes on as it came.
FUZZ_TARGET(lent_frame) {
  using namespace emberlock;
  v1::LentFrame lent;
  if (size > 4096 || !lent.ParseFromArray(data, static_cast<int>(size))) return 0;
  const auto frame = daemon::frame_of(lent, "fuzz");
  if (!frame.ok()) {
    if (frame.error().where.empty() || frame.error().remedy.empty()) std::abort();
    return 0;
  }
  const v1::LentFrame again = daemon::to_proto(*frame, daemon::counts_of(lent.counts()));
  const auto same = daemon::frame_of(again, "fuzz");
  if (!same.ok() || same->stamp != frame->stamp || *same->image != *frame->image) std::abort();
  return 0;
}
