// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/output_folder.h"
#include "paper/evaluate_paper.h"

namespace emberlock::paper {

/// One line a run: protocol, case, method, device, seconds, iterations, errors of R, G and B, temperatures.
std::string paper_csv(const PaperEvaluation& evaluation);

/// What the tables come to, a line each: by how much which method is better. Without line ends.
std::vector<std::string> paper_words(const PaperEvaluation& evaluation);

/// A page with a section a protocol: tables beside what the paper prints, plots, pictures; and the table of
/// methods.
std::string paper_html(const PaperEvaluation& evaluation);

/// Writes index.html and runs.csv.
Status write_paper_report(const PaperEvaluation& evaluation, const OutputRequest& where);

}  // namespace emberlock::paper
