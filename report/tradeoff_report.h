// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/output_folder.h"
#include "evaluate/recon_sweep.h"

namespace emberlock::report {

/// The content of a tradeoff page.
struct Tradeoff {
  std::string input;  ///< as the user typed it
  std::string
      options;  ///< options of `emberlock reconstruct` common to all points: held-out views, box, device
  std::string machine;    ///< on which the times were measured
  evaluate::Sweep sweep;  ///< has at least one point
};

/// The work-precision diagram: held-out error against seconds on logarithmic axes, every point with its
/// settings as a tooltip, the Pareto front as a marked line labelled with its settings.
enum class SheetSize { desktop, phone };
std::string tradeoff_svg(const std::vector<recon::WorkPoint>& points, SheetSize size = SheetSize::desktop);

/// What more time buys: one sentence per doubling of time.
std::string what_a_second_buys(const std::vector<recon::WorkPoint>& points);

std::string tradeoff_html(const Tradeoff& tradeoff);

/// A table whose last column is a complete command to copy; `header` names the other columns.
std::string command_table(const std::vector<std::string>& header,
                          const std::vector<std::vector<std::string>>& rows);

/// The files of a tradeoff.
struct TradeoffFiles {
  std::string csv, svg, html;
};
/// Writes points.csv, diagram.svg and index.html.
Status write_tradeoff_files(const TradeoffFiles& files, const OutputRequest& where);

Status write_tradeoff(const Tradeoff& tradeoff, const OutputRequest& where);

}  // namespace emberlock::report
