// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "report/sequence_report.h"

namespace emberlock::report {

/// A chunk of a batch, and who did it.
struct BatchChunk {
  std::string name;
  std::size_t planned = 0;  ///< frames
  std::size_t volumes = 0;
  std::size_t failed = 0;  ///< frames that became none, or weren't tried since the ones before all failed
  bool done = false;       ///< what follows is known where it is
  int rank = 0;
  std::string host = {}, device = {};
  Seconds took{0};  ///< loading, reconstruction and writing of its frames
};

/// A batch as far as it is done.
struct BatchTold {
  SequenceTold sequence;  ///< of the chunks that are done, in order
  std::vector<BatchChunk> chunks = {};
  std::vector<std::string> losses = {};    ///< CHUNK.WORKER: who died, or fell silent, of which
  std::vector<std::string> given_up = {};  ///< chunks that were lost too often

  [[nodiscard]] std::size_t planned() const;
  [[nodiscard]] std::size_t volumes() const;
  [[nodiscard]] std::size_t failed() const;
};

/// How long `ranks` like those that did the chunks would take for them, each taking the next one when it is
/// done; without their start and the report.
Seconds time_on(std::size_t ranks, const std::vector<Seconds>& chunks);

/// What is said of the batch, beside sequence_words(); of one that is done also what more ranks would buy.
std::vector<std::string> batch_words(const BatchTold& told);
/// batch.csv: a line a chunk.
std::string batch_csv(const BatchTold& told);
/// sequence_html() with who did what.
std::string batch_html(const BatchTold& told, const std::string& input);

}  // namespace emberlock::report
