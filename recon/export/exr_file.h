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

/// A channel that was read, a value a pixel.
struct ExrValues {
  ImageSize size;
  std::vector<float> values;
};
/// Reads the first of these channels that an OpenEXR file has. Errors (bad_input): no such file, none of
/// them, damaged, sides beyond 16384.
Result<ExrValues> read_exr(const std::filesystem::path& path, const std::vector<std::string>& names);

}  // namespace emberlock::recon
