// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_response.h"

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/target.h"

/// Whatever a response.json holds: an error that says where and what to do, or a valid response that is read
/// back as it was.
FUZZ_TARGET(camera_response) {
  using namespace emberlock;
  const auto response =
      recon::parse_camera_response({reinterpret_cast<const char*>(data), size}, "fuzz/response.json");
  if (!response) {
    if (response.error().where.empty() || response.error().remedy.empty()) std::abort();
    return 0;
  }
  if (!recon::check_camera_response(*response, "fuzz").ok()) std::abort();
  const auto again = recon::parse_camera_response(recon::to_json(*response), "again");
  if (!again || *again != *response) std::abort();
  for (std::size_t c = 0; c < 3; ++c)
    if (!std::isfinite(recon::integral(*response, c, [](double nm) { return 1 / nm; }))) std::abort();
  return 0;
}
