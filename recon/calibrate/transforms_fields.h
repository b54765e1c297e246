// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/result.h"

namespace emberlock::recon {

/// What becomes of a key of transforms.json. Each known key is in one of the three lists; docs/formats.md
/// repeats them. Unknown keys are passed over and named in one warning.
enum class FieldUse {
  used,
  refused,  ///< unless its value changes nothing, such as k4 = 0
  ignored,  ///< changes neither a ray nor what a pixel means
};
enum class FieldLevel { file, frame, both };

struct TransformsField {
  std::string_view key;
  FieldUse use = FieldUse::used;
  FieldLevel level = FieldLevel::both;
};

/// The known keys of NeRF, instant-ngp, nerfstudio and Polycam, and our own.
const std::vector<TransformsField>& transforms_fields();

/// Checks the keys of a transforms.json, and returns the unknown ones, sorted, each once. Errors: all keys
/// that are refused, that belong elsewhere in the file or look like a misspelling of a used key, in one
/// error. `file` names the file.
Result<std::vector<std::string>> check_transforms_keys(const nlohmann::json& document,
                                                       const std::string& file);

}  // namespace emberlock::recon
