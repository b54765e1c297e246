// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

#include "base/output_folder.h"

namespace emberlock::cli {

// The verbs that write output folders, besides `reconstruct` (recon/pipeline/reconstruct.h) and `sessions
// export` (session/export.h). New sessions (import, align --record, `sessions join`) need a new
// folder: check_new_folder().

inline constexpr OutputVerb kPlan{"reconstruct --plan"};
inline constexpr OutputVerb kSequence{"reconstruct --frames"};
inline constexpr OutputVerb kBatch{"batch"};
inline constexpr OutputVerb kTradeoffRecon{"tradeoff recon"};
inline constexpr OutputVerb kTradeoffSync{"tradeoff sync"};
inline constexpr OutputVerb kTradeoffRig{"tradeoff rig"};
inline constexpr OutputVerb kDesign{"design"};
inline constexpr OutputVerb kMeasure{"measure"};
inline constexpr OutputVerb kRender{"render"};
inline constexpr OutputVerb kScene{"scene"};
inline constexpr OutputVerb kStylize{"stylize"};
inline constexpr OutputVerb kAr{"ar"};
inline constexpr OutputVerb kExport{"export"};
inline constexpr OutputVerb kVerify{"verify"};
inline constexpr OutputVerb kDemo{"demo"};
inline constexpr OutputVerb kSample{"sample"};
inline constexpr OutputVerb kSimulateFlame{"simulate flame"};

inline constexpr std::array<std::string_view, 2> kBesideCameras{"calibrate colour",
                                                                "calibrate colour --black-body"};
inline constexpr OutputVerb kCalibrateCameras{"calibrate cameras", kBesideCameras};
inline constexpr std::array<std::string_view, 3> kBesideColour{"calibrate cameras", "calibrate convert",
                                                               "calibrate colour --black-body"};
inline constexpr OutputVerb kCalibrateColour{"calibrate colour", kBesideColour};
inline constexpr std::array<std::string_view, 3> kBesideResponse{"calibrate cameras", "calibrate convert",
                                                                 "calibrate colour"};
inline constexpr OutputVerb kCalibrateResponse{"calibrate colour --black-body", kBesideResponse};
inline constexpr OutputVerb kCalibrateConvert{"calibrate convert"};

}  // namespace emberlock::cli
