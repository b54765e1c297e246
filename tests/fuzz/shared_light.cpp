// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/shared_light.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/virtual/virtual_strobe.h"
#include "tests/fuzz/target.h"

namespace {

using namespace emberlock;

/// All settings of a text that comes in parts of `part` bytes; none if it is refused.
std::vector<drivers::LightSetting> settings_in(std::string_view text, std::size_t part, bool& refused) {
  drivers::LightText reader("fuzz/light.txt");
  std::vector<drivers::LightSetting> all;
  for (; !text.empty(); text.remove_prefix(std::min(part, text.size()))) {
    const auto settings = reader.take(text.substr(0, part));
    refused = !settings.ok();
    if (refused) {
      if (settings.error().where.empty() || settings.error().remedy.empty()) std::abort();
      return {};
    }
    all.insert(all.end(), settings->begin(), settings->end());
  }
  return all;
}

}  // namespace

/// The first byte says in what parts the others come. Whatever a light file holds: an error that says where
/// and what to do, or settings that a strobe can have, in order, which are read back as they were.
FUZZ_TARGET(shared_light) {
  if (size == 0 || size > 4096) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  bool refused = false;
  bool refused_whole = false;
  const auto settings = settings_in(text, 1 + data[0] % 64, refused);
  if (settings_in(text, text.size() + 1, refused_whole) != settings || refused != refused_whole) std::abort();
  drivers::StrobeTimeline timeline{PartsPerMillion(0)};
  std::string again = drivers::first_light_line({});
  TimePoint last;
  for (const drivers::LightSetting& next : settings) {
    if (next.at < last || !drivers::check_settings(next.settings, "fuzz").ok()) std::abort();
    last = next.at;
    timeline.apply(next.settings, next.at);
    again += drivers::light_line(next);
  }
  static_cast<void>(timeline.light(last, Seconds(-1), Seconds(1)));
  bool refused_again = false;
  if (settings_in(again, again.size(), refused_again) != settings || refused_again) std::abort();
  return 0;
}
