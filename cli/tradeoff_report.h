#pragma once

#include <filesystem>
#include <string>

#include "recon/pipeline/sweep.h"

namespace emberlock::cli {

/// What a tradeoff page speaks of.
struct Tradeoff {
  std::string input;    ///< as the user named it
  std::string options;  ///< of `emberlock reconstruct` for all points alike: held-out views, box, device
  std::string machine;  ///< where the seconds were measured
  Sweep sweep;          ///< has points
};

/// The work-precision diagram: held-out error against seconds on logarithmic axes, every point with its
/// settings as a tooltip, the Pareto front as a marked line with its settings written beside it.
std::string tradeoff_svg(const std::vector<WorkPoint>& points);

/// What a second buys, in one sentence a doubling of time.
std::string what_a_second_buys(const std::vector<WorkPoint>& points);

std::string tradeoff_html(const Tradeoff& tradeoff);

/// A table whose last column is a command, to be copied whole; `header` names the others.
std::string command_table(const std::vector<std::string>& header,
                          const std::vector<std::vector<std::string>>& rows);

/// A tradeoff's files.
struct TradeoffFiles {
  std::string csv, svg, html;
};
/// Writes points.csv, diagram.svg and index.html; the folder appears whole, or not at all.
Status write_tradeoff_files(const TradeoffFiles& files, const std::filesystem::path& folder);

/// Whether write_tradeoff() may write to `folder`: it is absent, empty, or holds an earlier points.csv.
Status check_tradeoff_output(const std::filesystem::path& folder);

Status write_tradeoff(const Tradeoff& tradeoff, const std::filesystem::path& folder);

}  // namespace emberlock::cli
