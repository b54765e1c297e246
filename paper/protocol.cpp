// SPDX-License-Identifier: Apache-2.0
#include "paper/protocol.h"

#include <algorithm>
#include <cstddef>

namespace emberlock::paper {

std::vector<Protocol> protocols(Extent extent) {
  return {iterations_protocol(extent), nine_views_protocol(extent), cameras_protocol(extent),
          captured_protocol(extent),   four_views_protocol(extent), smoke_protocol(extent)};
}

Result<std::vector<Protocol>> choose_protocols(const std::vector<std::string>& names, Extent extent) {
  std::vector<Protocol> all = protocols(extent);
  std::string list;
  for (const Protocol& p : all) list += (list.empty() ? "" : ", ") + std::string(p.name);
  for (const std::string& wanted : names)
    if (std::none_of(all.begin(), all.end(), [&](const Protocol& p) { return p.name == wanted; }))
      return Error{ErrorKind::bad_input, "no such table", "--only " + wanted, "Take some of " + list};
  if (!names.empty())
    std::erase_if(
        all, [&](const Protocol& p) { return std::find(names.begin(), names.end(), p.name) == names.end(); });
  return all;
}

std::vector<CameraPlace> ring(int count, double first) {
  std::vector<CameraPlace> cameras;
  cameras.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    cameras.push_back({first + 360.0 * i / count, i % 2 == 0 ? 10.0 : -10.0, recon::ViewRole::input});
  return cameras;
}

ImageSize image_size(Extent extent, ImageSize full) {
  return extent == Extent::full ? full : ImageSize{full.width / 4, full.height / 4};
}

}  // namespace emberlock::paper
