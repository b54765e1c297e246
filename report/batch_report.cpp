// SPDX-License-Identifier: Apache-2.0
#include "report/batch_report.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace emberlock::report {
namespace {

/// What one rank, as one process of a machine's, has done of it.
struct Share {
  std::string device;
  std::size_t chunks = 0, volumes = 0;
  Seconds took{0};
};

std::map<std::pair<int, std::string>, Share> shares_of(const BatchTold& told) {
  std::map<std::pair<int, std::string>, Share> shares;
  for (const BatchChunk& chunk : told.chunks) {
    if (!chunk.done) continue;
    Share& share = shares[{chunk.rank, chunk.host}];
    share.device = share.device.empty() || share.device == chunk.device ? chunk.device : "several";
    ++share.chunks;
    share.volumes += chunk.volumes;
    share.took += chunk.took;
  }
  return shares;
}

std::size_t sum(const BatchTold& told, std::size_t BatchChunk::*of) {
  return std::accumulate(told.chunks.begin(), told.chunks.end(), std::size_t{0},
                         [of](std::size_t total, const BatchChunk& chunk) { return total + chunk.*of; });
}

std::string batch_time(Seconds time) {
  return time < Seconds(100) ? fmt::format("{:.3g} s", time.value()) : fmt::format("{:.0f} s", time.value());
}

/// Up to as many ranks as there are chunks, beyond which none has anything to do.
std::string scaling_words(const std::vector<Seconds>& chunks) {
  constexpr std::size_t kStep = 4;
  std::string words = "its chunks take " + batch_time(time_on(1, chunks)) + " on one rank";
  for (std::size_t ranks = kStep; ranks < chunks.size(); ranks *= kStep)
    words += fmt::format(", {} on {}", batch_time(time_on(ranks, chunks)), ranks);
  return words + fmt::format(", {} on {}; more ranks gain nothing, shorter chunks may",
                             batch_time(time_on(chunks.size(), chunks)), chunks.size());
}

}  // namespace

Seconds time_on(std::size_t ranks, const std::vector<Seconds>& chunks) {
  std::vector<Seconds> busy_until(std::max<std::size_t>(1, ranks));
  for (const Seconds chunk : chunks) *std::min_element(busy_until.begin(), busy_until.end()) += chunk;
  return *std::max_element(busy_until.begin(), busy_until.end());
}

std::size_t BatchTold::planned() const { return sum(*this, &BatchChunk::planned); }
std::size_t BatchTold::volumes() const { return sum(*this, &BatchChunk::volumes); }
std::size_t BatchTold::failed() const { return sum(*this, &BatchChunk::failed); }

std::vector<std::string> batch_words(const BatchTold& told) {
  const auto done = std::count_if(told.chunks.begin(), told.chunks.end(),
                                  [](const BatchChunk& chunk) { return chunk.done; });
  std::vector<std::string> words;
  const std::size_t ranks = shares_of(told).size();
  words.push_back(fmt::format(
      "{} of {} frames are volumes, {} failed; {} of {} chunks are done, by {} rank{}", told.volumes(),
      told.planned(), told.failed(), done, told.chunks.size(), ranks, ranks == 1 ? "" : "s"));
  if (!told.losses.empty())
    words.push_back(
        fmt::format("lost on the way, and done again or gone on with: {}", fmt::join(told.losses, ", ")));
  if (!told.given_up.empty())
    words.push_back(
        fmt::format("given up, as whoever did them died each time: {}", fmt::join(told.given_up, ", ")));
  std::vector<Seconds> took;
  for (const BatchChunk& chunk : told.chunks)
    if (chunk.done) took.push_back(chunk.took);
  if (took.size() > 1 && took.size() == told.chunks.size()) words.push_back(scaling_words(took));
  return words;
}

std::string batch_csv(const BatchTold& told) {
  std::string csv = "chunk,frames,volumes,failed,rank,host,device,seconds\n";
  for (const BatchChunk& c : told.chunks) {
    if (c.done)
      csv += fmt::format("{},{},{},{},{},{},{},{:.3f}\n", c.name, c.planned, c.volumes, c.failed, c.rank,
                         c.host, c.device, c.took.value());
    else
      csv += fmt::format("{},{},,,,,,\n", c.name, c.planned);
  }
  return csv;
}

std::string batch_html(const BatchTold& told, const std::string& input) {
  return sequence_html(told.sequence, input, [&](HtmlPage& page) {
    page.heading("Who did what");
    for (const std::string& words : batch_words(told)) page.paragraph(sentence(words));
    std::vector<std::vector<std::string>> rows;
    for (const auto& [who, share] : shares_of(told))
      rows.push_back({std::to_string(who.first), who.second, share.device, std::to_string(share.chunks),
                      std::to_string(share.volumes), fmt::format("{:.1f}", share.took.value())});
    page.table({"rank", "machine", "device", "chunks", "volumes", "seconds"}, rows);
  });
}

}  // namespace emberlock::report
