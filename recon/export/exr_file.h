// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::recon {

/// A channel of a picture: its name in the file (R, G, B, A, or any other), and a value a pixel.
struct ExrChannel {
  std::string name;
  const std::vector<float>& values;
};

/// Writes an OpenEXR file of 32-bit channels, ZIP-compressed. `path` is written in place: call it inside an
/// OutputFolder. Errors: bad_input for a channel of another size, io.
Status write_exr(ImageSize size, const std::vector<ExrChannel>& channels, const std::filesystem::path& path);

}  // namespace emberlock::recon
