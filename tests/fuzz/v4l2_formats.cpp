// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include <linux/ioctl.h>

#include "drivers/v4l2/controls.h"
#include "drivers/v4l2/modes.h"
#include "tests/fuzz/target.h"

// Whatever a device answers, the modes made of it can be filmed in. The input is its answers one after the
// other: a byte that is 0 for "no more", else the whole answer.
FUZZ_TARGET(v4l2_formats) {
  using namespace emberlock;
  const drivers::Ioctl device = [&](unsigned long request, void* argument) {
    if (size == 0) return EINVAL;
    const bool answers = *data != 0;
    ++data;
    --size;
    if (!answers) return EINVAL;
    // What is asked for by a pointer stays what it was.
    if (request == VIDIOC_S_EXT_CTRLS) return 0;
    const std::size_t n = std::min<std::size_t>(size, _IOC_SIZE(request));
    std::memcpy(argument, data, n);
    data += n;
    size -= n;
    return 0;
  };
  const auto require = [](bool holds) {
    if (!holds) std::abort();
  };
  for (const drivers::V4l2Mode& mode : drivers::list_modes(device, ImageSize{640, 360}).modes) {
    const auto layout = drivers::layout_of(mode.pixels);
    require(layout.ok() && *layout == mode.mode.layout);
    require(!mode.intervals.empty() && mode.mode.frame_rate == drivers::rate_of(mode.intervals.front()));
    for (const double wanted : {0.0, 0.02, 15.0, 9999.0, 1e12}) {
      const Hertz rate = drivers::rate_of(drivers::interval_for(mode, Hertz(wanted)));
      require(rate > Hertz(0) && rate <= mode.mode.frame_rate * (1 + 1e-4));
    }
  }
  (void)drivers::set_control(device, "Brightness", "5", "input");
  return 0;
}
