// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace emberlock::recon {

/// Remarks on a foreign file for its user: what isn't used, what was renamed. Each is one sentence without a
/// full stop.
using ImportNotes = std::vector<std::string>;

enum class NamedBy {
  folder,   ///< the first folder that differs, else the file's name
  picture,  ///< the file's name, else the first folder that differs
};

/// One camera id per picture, from its path in a foreign file. Extensions are dropped. Where no single folder
/// or name differs between all pictures, the id is the whole path, joined by "_". Characters that an id can't
/// hold become "_", which `notes` reports. Different pictures get different ids; a picture that is listed
/// twice has the same id twice.
std::vector<std::string> camera_ids(const std::vector<std::string>& pictures, NamedBy by, ImportNotes* notes);

}  // namespace emberlock::recon
