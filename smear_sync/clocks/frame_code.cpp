// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/frame_code.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fmt/format.h>

namespace emberlock::smear {
namespace {

constexpr int kWordLength = 31;
// Margin in flash periods: a flash this close to the exposure's border may light either picture. A known
// phase has jitter; a tried one is off by up to half the step.
constexpr double kKnownEdge = 0.005;
constexpr double kTriedEdge = 0.02;
constexpr int kPhases = 32;         // number tried if the phase is unknown: one is within kTriedEdge of it
constexpr double kTie = 1;          // smaller differences of log-likelihood decide nothing
constexpr double kPlaceSlack = 3;   // a loss may be wherever its likelihood is at least e^-3 of the largest
constexpr std::size_t kFewest = 8;  // frames

/// A maximum-length sequence by its recurrence: each flash is the sum modulo 2 of the flashes `lags` before
/// it.
template <std::size_t N>
std::array<bool, kWordLength> sequence(const std::array<std::size_t, N>& lags) {
  std::array<bool, kWordLength> bits{true, false, false, false, false};
  for (std::size_t i = 5; i < bits.size(); ++i) {
    for (const std::size_t lag : lags) bits[i] = bits[i] != bits[i - lag];
  }
  return bits;
}

Status check(const FrameCode& code) {
  const auto refuse = [](const std::string& what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "frame code", remedy};
  };
  if (code.words < 1 || code.words > kWordLength)
    return refuse("words is " + std::to_string(code.words), "give 1 to 31");
  if (code.spacing <= kWordLength)
    return refuse("spacing is " + std::to_string(code.spacing), "give 32 or more");
  return {};
}

Status check(std::span<const CodeFrame> frames, const DecodeOptions& o) {
  EMBERLOCK_RETURN_IF_ERROR(check(o.code));
  const auto refuse = [](const char* what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "frame numbers", remedy};
  };
  if (!(std::abs(o.flashes_per_frame - 1) <= 0.05))
    return refuse("flashes_per_frame is not near 1", "play the code at the cameras' frame rate");
  if (o.first_phase && !(*o.first_phase >= 0 && *o.first_phase < 1))
    return refuse("first_phase is out of range", "give tau / P in [0, 1)");
  if (!(o.misread > 0 && o.misread < 0.5))
    return refuse("misread is out of range", "give a value in (0, 0.5)");
  if (!(o.drop_chance > 0 && o.drop_chance < 0.1))
    return refuse("drop_chance is out of range", "give a value in (0, 0.1)");
  if (!(o.confidence >= 0.5 && o.confidence < 1))
    return refuse("confidence is out of range", "give a value in [0.5, 1)");
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i].frame <= frames[i - 1].frame)
      return refuse("frames aren't in order", "sort them by their count");
  }
  return {};
}

/// The likelihood of every frame for every flash number. Read phase i begins at base + phase + i T / P, and
/// its picture is lit by the flashes of the T before.
class Course {
 public:
  Course(std::span<const CodeFrame> frames, const DecodeOptions& o, const std::vector<bool>& pattern,
         double phase)
      : frames_(frames),
        step_(o.flashes_per_frame),
        phase_(phase),
        edge_(o.first_phase ? kKnownEdge : kTriedEdge),
        pattern_(pattern),
        right_(std::log(1 - o.misread)),
        wrong_(std::log(o.misread)) {
    for (std::size_t i = 0; i < 2 * pattern.size(); ++i) {
      const bool flash = pattern[i % pattern.size()];
      if_seen_.push_back(flash ? right_ : wrong_);
      if_dark_.push_back(flash ? wrong_ : right_);
    }
  }

  /// Adds the log-likelihood of frame i for every base.
  void add(std::size_t i, std::vector<double>& score) const {
    const FlashSeen seen = frames_[i].seen;
    if (seen == FlashSeen::unknown) return;
    const Lit lit = lit_of(i);
    if (lit.first == lit.last && lit.edge_count == 0) {  // the usual case
      const auto cycle = static_cast<std::int64_t>(score.size());
      const double* logs =
          (seen == FlashSeen::yes ? if_seen_ : if_dark_).data() + (lit.first % cycle + cycle) % cycle;
      for (std::size_t base = 0; base < score.size(); ++base) score[base] += logs[base];
      return;
    }
    for (std::size_t base = 0; base < score.size(); ++base) score[base] += weigh(lit, base, seen);
  }
  [[nodiscard]] double at(std::size_t i, std::size_t base) const {
    return frames_[i].seen == FlashSeen::unknown ? 0 : weigh(lit_of(i), base, frames_[i].seen);
  }
  [[nodiscard]] bool misread(std::size_t i, std::size_t base) const {
    return frames_[i].seen != FlashSeen::unknown && at(i, base) == wrong_;
  }
  [[nodiscard]] double start(std::size_t i, std::size_t base) const {
    return wrap_positive(static_cast<double>(base) + begin(i), static_cast<double>(pattern_.size()));
  }

 private:
  /// Flashes relative to the base: those within the exposure, and those at its borders.
  struct Lit {
    std::int64_t first = 0, last = -1;
    std::array<std::int64_t, 4> edges{};
    int edge_count = 0;
  };
  [[nodiscard]] double begin(std::size_t i) const {
    return phase_ + static_cast<double>(frames_[i].frame - frames_.front().frame) * step_;
  }
  [[nodiscard]] Lit lit_of(std::size_t i) const {
    const double end = begin(i);
    const double from = end - step_;
    Lit lit;
    lit.first = static_cast<std::int64_t>(std::ceil(from + edge_));
    lit.last = static_cast<std::int64_t>(std::floor(end - edge_));
    for (const double edge : {from, end}) {
      const double nearest = std::round(edge);
      if (std::abs(edge - nearest) < edge_)
        lit.edges[static_cast<std::size_t>(lit.edge_count++)] = std::llround(nearest);
    }
    return lit;
  }
  [[nodiscard]] bool given(std::size_t base, std::int64_t flash) const {
    const auto cycle = static_cast<std::int64_t>(pattern_.size());
    const std::int64_t j = (static_cast<std::int64_t>(base) + flash) % cycle;
    return pattern_[static_cast<std::size_t>(j < 0 ? j + cycle : j)];
  }
  [[nodiscard]] double weigh(const Lit& lit, std::size_t base, FlashSeen seen) const {
    bool yes = false;
    for (std::int64_t j = lit.first; j <= lit.last; ++j) yes = yes || given(base, j);
    if (!yes && lit.edge_count > 0) {
      int edges = 0;
      for (int e = 0; e < lit.edge_count; ++e)
        edges += given(base, lit.edges[static_cast<std::size_t>(e)]) ? 1 : 0;
      if (edges == 1) return std::log(0.5);
      yes = edges > 0;  // one of two flashes at opposite borders lights it
    }
    return yes == (seen == FlashSeen::yes) ? right_ : wrong_;
  }

  std::span<const CodeFrame> frames_;
  double step_, phase_, edge_;
  const std::vector<bool>& pattern_;
  double right_, wrong_;
  std::vector<double> if_seen_, if_dark_;  ///< log-likelihoods by flash number, repeated twice
};

/// The most probable base of every frame; it is constant except for rare jumps (Viterbi).
struct Path {
  double score = -std::numeric_limits<double>::infinity();
  double phase = 0;
  std::vector<std::size_t> bases;
};

Path most_probable(const Course& course, std::size_t frames, std::size_t cycle, const DecodeOptions& o) {
  const double jump = std::log(o.drop_chance / static_cast<double>(cycle));
  const double stay = std::log(1 - o.drop_chance);
  std::vector<double> score(cycle, 0);
  std::vector<std::vector<std::uint8_t>> jumped(frames, std::vector<std::uint8_t>(cycle, 0));
  std::vector<std::size_t> from(frames, 0);
  for (std::size_t i = 0; i < frames; ++i) {
    if (i > 0) {
      from[i] = static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
      const double by_jump = score[from[i]] + jump;
      for (std::size_t b = 0; b < cycle; ++b) {
        const double by_stay = score[b] + stay;
        jumped[i][b] = by_jump > by_stay ? 1 : 0;
        score[b] = std::max(by_jump, by_stay);
      }
    }
    course.add(i, score);
  }
  Path path;
  path.bases.resize(frames);
  auto base = static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
  path.score = score[base];
  for (std::size_t i = frames; i-- > 0;) {
    path.bases[i] = base;
    if (jumped[i][base] != 0) base = from[i];
  }
  return path;
}

/// A run of frames with one base, by index.
struct Stretch {
  std::size_t begin, end;
  std::size_t base;
  double confidence;
};

/// Log-probability of the frames without any code: lit at random, with the observed frequency.
double log_chance(std::span<const CodeFrame> frames) {
  double yes = 0;
  double no = 0;
  for (const CodeFrame& f : frames) {
    yes += f.seen == FlashSeen::yes ? 1 : 0;
    no += f.seen == FlashSeen::no ? 1 : 0;
  }
  const auto part = [&](double n) { return n > 0 ? n * std::log(n / (yes + no)) : 0; };
  return part(yes) + part(no);
}

std::vector<Stretch> stretches(std::span<const CodeFrame> frames, const Course& course, const Path& path,
                               std::size_t cycle) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < path.bases.size(); ++i) {
    if (i == 0 || path.bases[i] != path.bases[i - 1]) found.push_back({i, i, path.bases[i], 0});
    found.back().end = i + 1;
  }
  for (Stretch& s : found) {
    std::vector<double> all(cycle, 0);
    for (std::size_t i = s.begin; i < s.end; ++i) course.add(i, all);
    const double chance = log_chance(frames.subspan(s.begin, s.end - s.begin));
    double sum = static_cast<double>(cycle) * std::exp(std::min(chance - all[s.base], 50.0));
    for (const double a : all) sum += std::exp(std::min(a - all[s.base], 50.0));
    s.confidence = 1 / sum;
  }
  return found;
}

/// The frames between which the base may have changed from a's to b's.
DroppedFrames loss_between(std::span<const CodeFrame> frames, const Course& course, const Stretch& a,
                           const Stretch& b, std::size_t cycle) {
  std::vector<double> scores;  // for b's base, from frame a.begin + 1 + index on
  double score = 0;
  for (std::size_t i = a.begin + 1; i < b.end; ++i) {
    scores.push_back(score);
    score += course.at(i, a.base) - course.at(i, b.base);
  }
  const double best = *std::max_element(scores.begin(), scores.end());
  std::size_t first = scores.size();
  std::size_t last = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (scores[i] < best - kPlaceSlack) continue;
    first = std::min(first, i);
    last = i;
  }
  DroppedFrames loss;
  loss.after = frames[a.begin + first].frame;
  loss.before = frames[a.begin + 1 + last].frame;
  loss.frames = static_cast<int>(
      wrap_symmetric(static_cast<double>(b.base) - static_cast<double>(a.base), static_cast<double>(cycle)));
  return loss;
}

std::string why_not(std::span<const CodeFrame> frames, const DecodeOptions& o) {
  std::size_t yes = 0;
  std::size_t no = 0;
  for (const CodeFrame& f : frames) {
    yes += f.seen == FlashSeen::yes ? 1U : 0U;
    no += f.seen == FlashSeen::no ? 1U : 0U;
  }
  if (yes + no < kFewest) return fmt::format("only {} frames tell whether the strobe lit them", yes + no);
  if (no == 0)
    return fmt::format("no frame lacks its flash: let the strobe play the code, and film more than {} frames",
                       o.code.spacing);
  if (yes == 0) return "no frame shows the lamp";
  return fmt::format(
      "what is lit fits no part of the code: film more than {} frames, exposed for the whole frame period",
      o.code.spacing);
}

}  // namespace

Result<std::vector<bool>> flash_pattern(const FrameCode& code) {
  EMBERLOCK_RETURN_IF_ERROR(check(code));
  const auto still = sequence<2>({3, 5});
  const auto turned = sequence<4>({1, 2, 3, 5});
  std::vector<bool> pattern(static_cast<std::size_t>(code.flashes()), true);
  for (int w = 0; w < code.words; ++w) {
    for (int i = 0; i < kWordLength; ++i) {
      const int flash = w * code.spacing + i;
      pattern[static_cast<std::size_t>(flash)] =
          still[static_cast<std::size_t>(i)] != turned[static_cast<std::size_t>((i + w) % kWordLength)];
    }
  }
  return pattern;
}

FlashSeen flash_seen(const SmearReading& reading) {
  if (reading.state == SmearState::no_lamp) return FlashSeen::no;
  if (reading.state == SmearState::ambiguous && !reading.lamp) return FlashSeen::unknown;
  return FlashSeen::yes;
}

Result<FrameNumbers> number_frames(std::span<const CodeFrame> frames, const DecodeOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check(frames, options));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<bool> pattern, flash_pattern(options.code));
  FrameNumbers numbers;
  numbers.reason = why_not(frames, options);
  const bool some_no =
      std::any_of(frames.begin(), frames.end(), [](const CodeFrame& f) { return f.seen == FlashSeen::no; });
  if (frames.size() < kFewest || !some_no) return numbers;

  // Without a known phase, all distinguishable ones are tried; equally good ones give the slack.
  const double slip = std::abs(options.flashes_per_frame - 1) *
                      static_cast<double>(frames.back().frame - frames.front().frame);
  std::vector<double> phases;
  if (options.first_phase) {
    phases.push_back(wrap_positive(-*options.first_phase, 1));
  } else if (slip < kTriedEdge) {
    phases.push_back(0.5);
  } else {
    for (int i = 0; i < kPhases; ++i) phases.push_back((i + 0.5) / kPhases);
  }
  std::vector<Path> paths;
  for (const double phase : phases) {
    paths.push_back(most_probable({frames, options, pattern, phase}, frames.size(), pattern.size(), options));
    paths.back().phase = phase;
  }
  const Path& best = *std::max_element(paths.begin(), paths.end(),
                                       [](const Path& a, const Path& b) { return a.score < b.score; });
  double low = 1;
  double high = 0;
  for (const Path& p : paths) {
    if (p.score < best.score - kTie || p.bases != best.bases) continue;
    low = std::min(low, p.phase);
    high = std::max(high, p.phase);
  }
  const double slack = options.first_phase ? 0 : (high - low + 1.0 / static_cast<double>(phases.size())) / 2;
  const double centre = (low + high) / 2;
  const Course course(frames, options, pattern, centre);

  std::vector<Stretch> runs = stretches(frames, course, best, pattern.size());
  std::size_t misread = 0;
  for (const Stretch& run : runs) {
    for (std::size_t i = run.begin; i < run.end; ++i) misread += course.misread(i, run.base) ? 1U : 0U;
  }
  numbers.misread = static_cast<double>(misread) / static_cast<double>(frames.size());
  std::erase_if(runs, [&](const Stretch& run) { return run.confidence < options.confidence; });
  if (runs.empty()) return numbers;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Stretch& run = runs[i];
    numbers.runs.push_back({frames[run.begin].frame, frames[run.end - 1].frame,
                            course.start(run.begin, run.base), slack, options.flashes_per_frame,
                            run.confidence});
    if (i > 0) numbers.drops.push_back(loss_between(frames, course, runs[i - 1], run, pattern.size()));
  }
  std::size_t numbered = 0;
  for (const Stretch& run : runs) numbered += run.end - run.begin;
  numbers.reason = fmt::format("{} of {} frames numbered by the skipped flashes, {} misread, {} losses",
                               numbered, frames.size(), misread, numbers.drops.size());
  return numbers;
}

FrameOffset frame_offset(const NumberedRun& a, const NumberedRun& b, const FrameCode& code, std::int64_t i) {
  const double start = a.start + static_cast<double>(i - a.first) * a.flashes_per_frame;
  const double same = static_cast<double>(b.first - i) + (start - b.start) / b.flashes_per_frame;
  const double nearest = wrap_symmetric(same, code.flashes() / b.flashes_per_frame);
  FrameOffset offset;
  offset.frames = std::llround(nearest);
  offset.lag = (nearest - static_cast<double>(offset.frames)) * b.flashes_per_frame;
  offset.confidence = a.confidence * b.confidence;
  const std::int64_t match = i + offset.frames;
  offset.reason = fmt::format("frame {} of one camera and {} of the other start {:.3f} periods apart", i,
                              match, offset.lag);
  if (a.start_slack + b.start_slack > 0.5 - std::abs(offset.lag))
    offset.reason += "; it may be one frame more or less: a phase isn't known";
  return offset;
}

}  // namespace emberlock::smear
