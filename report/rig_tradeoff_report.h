// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "base/output_folder.h"
#include "evaluate/measure_rig.h"

// The whole workflow's error against minutes and euros as text, CSV, JSON and HTML.
namespace emberlock::report {

/// A few lines for the terminal: the choice, what the next steps buy, and how far predictions were off.
std::string rig_tradeoff_summary(const evaluate::RigTradeoff& tradeoff);
/// All points.
std::string rig_tradeoff_csv(const evaluate::RigTradeoff& tradeoff);
/// All but the points beside the front.
nlohmann::ordered_json rig_tradeoff_json(const evaluate::RigTradeoff& tradeoff);
std::string rig_tradeoff_html(const evaluate::RigTradeoff& tradeoff);

/// Writes points.csv, rig.json and index.html.
Status write_rig_tradeoff(const evaluate::RigTradeoff& tradeoff, const OutputRequest& where);

}  // namespace emberlock::report
