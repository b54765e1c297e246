// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "paper/evaluate_paper.h"
#include "report/html.h"

namespace emberlock::paper {

/// A protocol's runs as pictures: for each case the truth, and what each method shows of the first test view
/// and where it errs.
std::vector<report::HtmlPage::Picture> method_pictures(const PaperEvaluation& evaluation,
                                                       const Protocol& protocol);
/// The first test view after 10, 30, 50 and 70 iterations, and its errors.
std::vector<report::HtmlPage::Picture> pass_pictures(const PaperEvaluation& evaluation,
                                                     const Protocol& protocol);
/// Of the case with most cameras up to 16: temperatures across the flame's middle, the truth and the
/// difference.
std::vector<report::HtmlPage::Picture> slice_pictures(const PaperEvaluation& evaluation,
                                                      const Protocol& protocol);

}  // namespace emberlock::paper
