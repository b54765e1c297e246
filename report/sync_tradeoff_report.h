// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "base/output_folder.h"
#include "evaluate/sync_tradeoff.h"

// The cost of synchronization as CSV, SVG, HTML and JSON.
namespace emberlock::report {

std::string sync_tradeoff_csv(const evaluate::SyncTradeoff& tradeoff);
std::string sync_tradeoff_svg(const evaluate::SyncTradeoff& tradeoff);
std::string sync_tradeoff_html(const evaluate::SyncTradeoff& tradeoff);
nlohmann::ordered_json sync_tradeoff_json(const evaluate::SyncTradeoff& tradeoff);

/// Writes points.csv, diagram.svg and index.html.
Status write_sync_tradeoff(const evaluate::SyncTradeoff& tradeoff, const OutputRequest& where);

}  // namespace emberlock::report
