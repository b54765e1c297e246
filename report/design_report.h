// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/output_folder.h"
#include "evaluate/design.h"
#include "evaluate/twin.h"

// A rig before anything is bought, as text, JSON and HTML.
namespace emberlock::report {

/// What the frames of the designed rig take on a machine.
struct MachineMinutes {
  std::string name;
  double frame = 0;    ///< seconds
  double minutes = 0;  ///< of the whole film's reconstruction
};

/// A rig that stands, and where one more camera would do most.
struct OneMore {
  evaluate::StandingRig rig;
  evaluate::ErrorSquares now{};
  std::vector<evaluate::NextCamera> places;
};

struct DesignPage {
  evaluate::DesignRequest request;
  evaluate::ErrorLaw law;
  std::vector<evaluate::NamedRig> sweep;
  std::vector<evaluate::MeasuredRig> measured;  ///< of `sweep`
  evaluate::Design design;                      ///< where no rig was given
  std::optional<evaluate::Recording> recording;
  std::vector<MachineMinutes> machines;
  std::optional<OneMore> one_more;        ///< instead of all four above
  std::vector<std::string> extrapolated;  ///< evaluate::list_extrapolated() of the rig, chosen or standing
};

/// What the terminal shows.
std::string design_summary(const DesignPage& page);
nlohmann::ordered_json design_json(const DesignPage& page);
std::string design_html(const DesignPage& page);
/// Writes report.html and report.json.
Status write_design(const DesignPage& page, const OutputRequest& where);

/// "views 61 %, pixels 20 %": shares of the error's square, the largest first, without those below 1 %.
std::string shares_text(const evaluate::ErrorSquares& squares);

}  // namespace emberlock::report
