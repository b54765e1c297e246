// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <span>

#include "drivers/ptp/container.h"
#include "tests/fuzz/target.h"

// Whatever a device sends: an error, or what encodes to the same bytes again; and datasets no longer than the
// bytes can hold. The first byte says what the others are read as.
FUZZ_TARGET(ptp_container) {
  using namespace emberlock;
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  switch (data[0] % 4) {
    case 0: {
      const auto message = drivers::parse_ptp_message(bytes);
      if (!message.ok()) break;
      const auto again = drivers::encode(*message);
      if (!std::equal(again.begin(), again.end(), bytes.begin(), bytes.end())) std::abort();
      break;
    }
    case 1: {
      const auto info = drivers::parse_ptp_device_info(bytes);
      if (info.ok() && info->operations.size() * 2 > bytes.size()) std::abort();
      break;
    }
    case 2: {
      const auto info = drivers::parse_ptp_object_info(bytes);
      if (info.ok() && info->name.size() > 2 * bytes.size()) std::abort();
      break;
    }
    default: {
      const auto list = drivers::parse_ptp_u32_array(bytes);
      if (list.ok() && list->size() * 4 > bytes.size()) std::abort();
      break;
    }
  }
  return 0;
}
