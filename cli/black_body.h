// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace emberlock::cli {

/// `calibrate colour --black-body` as typed.
struct BlackBodyArguments {
  std::vector<std::string> pictures;  ///< one a temperature, in their order
  std::string temperatures;           ///< "1500,1800", K
  std::string emitter = "furnace";
  double window = 1;
  double temperature_sigma = 0;  ///< K
  std::string region;            ///< x,y,width,height; empty: found
  std::string dark;              ///< a picture; empty: none
  std::string base = "srgb";
  std::string rig;        ///< rig.json; empty: none
  std::string camera;     ///< of the rig
  std::string exposures;  ///< s: "0.004", or one a picture: "0.004,0.001"; empty: of one, not told
  std::optional<double> gamma = {};
  std::string out;
};

/// Finds the response, writes response.json and response.html, and with a rig its rig.json; prints the
/// result.
Status calibrate_black_body(const BlackBodyArguments& arguments);

}  // namespace emberlock::cli
