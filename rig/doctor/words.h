// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "rig/doctor/doctor.h"
#include "rig/doctor/finding.h"

namespace emberlock::rig::doctor {

/// A finding in sentences, for people and scripts.
struct FindingWords {
  std::string what;    ///< a word or two: "groups"
  std::string found;   ///< a sentence
  std::string remedy;  ///< a command to paste where there is one; empty when ok
};
/// `facts` are those that `finding` was made from.
FindingWords words(const Finding& finding, const Facts& facts);

}  // namespace emberlock::rig::doctor
