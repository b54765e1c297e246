// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/output_folder.h"
#include "recon/pipeline/sweep.h"

namespace emberlock::report {

/// What a tradeoff page speaks of.
struct Tradeoff {
  std::string input;    ///< as the user named it
  std::string options;  ///< of `emberlock reconstruct` for all points alike: held-out views, box, device
  std::string machine;  ///< where the seconds were measured
  recon::Sweep sweep;   ///< has points
};

/// The work-precision diagram: held-out error against seconds on logarithmic axes, every point with its
/// settings as a tooltip, the Pareto front as a marked line with its settings written beside it.
std::string tradeoff_svg(const std::vector<recon::WorkPoint>& points);

/// What a second buys, in one sentence a doubling of time.
std::string what_a_second_buys(const std::vector<recon::WorkPoint>& points);

std::string tradeoff_html(const Tradeoff& tradeoff);

/// A table whose last column is a command, to be copied whole; `header` names the others.
std::string command_table(const std::vector<std::string>& header,
                          const std::vector<std::vector<std::string>>& rows);

/// A tradeoff's files.
struct TradeoffFiles {
  std::string csv, svg, html;
};
/// Writes points.csv, diagram.svg and index.html.
Status write_tradeoff_files(const TradeoffFiles& files, const OutputRequest& where);

Status write_tradeoff(const Tradeoff& tradeoff, const OutputRequest& where);

}  // namespace emberlock::report
