// SPDX-License-Identifier: Apache-2.0
#include "drivers/probe.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

/// Tolerance for the camera's nominal rate. Crystals are within 100 ppm; alignment copes with this much.
constexpr PartsPerMillion kRateTolerance{2000};
/// Arrival times identify frames of different cameras as long as they deviate by less than this part of a
/// period.
constexpr double kArrivalPart = 0.25;
/// A link with a higher load loses frames as soon as it is used for something else.
constexpr double kFullLink = 0.8;
/// A larger share of lost frames leaves gaps in a film of a flame.
constexpr double kManyLost = 0.01;
constexpr Seconds kFirstFrame{3};
constexpr Seconds kAfterReset{30};  // a power cycle takes many seconds

struct EvenRate {
  Seconds period;
  Seconds rms;
  Seconds worst;
};

/// Fits instants to frame numbers by least squares.
std::optional<EvenRate> even_rate(const std::vector<FrameStamp>& stamps, TimePoint FrameStamp::*instant) {
  if (stamps.size() < 3) return {};
  const auto id = [&](const FrameStamp& s) {
    return static_cast<double>(s.frame_id - stamps.front().frame_id);
  };
  const auto at = [&](const FrameStamp& s) { return (s.*instant - stamps.front().*instant).value(); };
  const auto n = static_cast<double>(stamps.size());
  double mean_id = 0;
  double mean_at = 0;
  for (const FrameStamp& s : stamps) {
    mean_id += id(s) / n;
    mean_at += at(s) / n;
  }
  double ids = 0;
  double both = 0;
  for (const FrameStamp& s : stamps) {
    ids += (id(s) - mean_id) * (id(s) - mean_id);
    both += (id(s) - mean_id) * (at(s) - mean_at);
  }
  if (!(ids > 0 && both > 0)) return {};
  const double period = both / ids;
  EvenRate even{Seconds(period), {}, {}};
  double squares = 0;
  for (const FrameStamp& s : stamps) {
    const double off = at(s) - mean_at - period * (id(s) - mean_id);
    squares += off * off;
    even.worst = std::max(even.worst, Seconds(std::abs(off)));
  }
  even.rms = Seconds(std::sqrt(squares / n));
  return even;
}

std::string losses_in_words(const FrameCounts& counts) {
  std::string words;
  const auto add = [&](std::uint64_t count, std::string_view cause) {
    if (count > 0) words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, cause);
  };
  add(counts.damaged, "damaged");
  add(counts.camera_gap, "skipped by the camera");
  add(counts.transport, "lost on the way");
  add(counts.resend, "lost though asked for again");
  add(counts.underrun, "without a buffer");
  add(counts.queue, "not taken in time");
  return words.empty() ? "none lost or damaged" : words;
}

ProbeFinding judge_rate(const CameraInfo& info, Hertz measured) {
  const PartsPerMillion off((measured / info.frame_rate - 1) * 1e6);
  ProbeFinding finding{"rate", abs(off) <= kRateTolerance ? Fitness::good : Fitness::poor,
                       fmt::format("{:.4f} frames/s, {:+.0f} ppm of {:.4g}", measured.value(), off.value(),
                                   info.frame_rate.value())};
  if (finding.fitness != Fitness::good) {
    finding.remedy = "ask for a rate that it keeps; switch off what lets its exposure lower the rate";
  }
  return finding;
}

ProbeFinding judge_frames(const FrameCounts& counts) {
  const std::uint64_t bad = counts.lost() + counts.damaged;
  const auto all = static_cast<double>(bad + counts.delivered);
  ProbeFinding finding{"frames", Fitness::good,
                       fmt::format("{} whole, {}", counts.delivered, losses_in_words(counts))};
  if (bad == 0) return finding;
  finding.fitness = static_cast<double>(bad) > kManyLost * all ? Fitness::unfit : Fitness::poor;
  finding.remedy = counts.transport + counts.resend + counts.damaged > 0
                       ? "try another cable or port, fewer cameras a bus, smaller pictures or a lower rate"
                   : counts.camera_gap > 0 ? "ask for a lower rate: the camera skips frames by itself"
                                           : "close what else uses this machine, or ask for a lower rate";
  return finding;
}

ProbeFinding judge_arrival(const EvenRate& arrival) {
  ProbeFinding finding{"arrival", Fitness::good,
                       fmt::format("uneven by {:.2f} ms RMS, {:.2f} ms at worst",
                                   in_milliseconds(arrival.rms), in_milliseconds(arrival.worst))};
  if (arrival.worst > arrival.period * kArrivalPart) {
    finding.fitness = Fitness::poor;
    finding.remedy =
        "close what else uses this machine: frames of two cameras can't be told apart by arrival";
  }
  return finding;
}

ProbeFinding judge_link(double megabits, std::optional<double> link_megabits) {
  ProbeFinding finding{"bandwidth", Fitness::good, fmt::format("{:.1f} Mbit/s", megabits)};
  if (!link_megabits) {
    finding.measured += "; how much its link carries isn't known";
    return finding;
  }
  const double part = megabits / *link_megabits;
  finding.measured +=
      fmt::format(" of {:.0f}, {:.0f} % left for others", *link_megabits, std::max(0.0, 100 * (1 - part)));
  if (part > kFullLink) {
    finding.fitness = Fitness::poor;
    finding.remedy = "give it a port or a network of its own, or ask for smaller pictures or a lower rate";
  }
  return finding;
}

Spread spread(const std::vector<Seconds>& values) {
  const auto n = static_cast<double>(values.size());
  const Seconds mean = std::accumulate(values.begin(), values.end(), Seconds(0)) / n;
  double squares = 0;
  for (const Seconds v : values) squares += (v - mean).value() * (v - mean).value();
  return {mean, Seconds(std::sqrt(squares / (n - 1)))};
}

Status time_resets(Camera& camera, int count, Clock& clock, ProbeFilm& film,
                   const std::function<void(int)>& done) {
  for (int i = 0; i < count; ++i) {
    const TimePoint ordered = clock.now();
    EMBERLOCK_RETURN_IF_ERROR(camera.reset_shutter(ordered));
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame first, camera.next_frame(kAfterReset));
    film.reset_delays.push_back(first.stamp.monotonic_time - ordered);
    done(i + 1);
  }
  return {};
}

Status film_for(Camera& camera, const ProbeOptions& options, Clock& clock, ProbeFilm& film,
                const std::function<void(double)>& done) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Frame settling, camera.next_frame(kFirstFrame));
  const FrameCounts before = camera.counts();
  const TimePoint end = settling.stamp.monotonic_time + options.film;
  while (clock.now() < end) {
    const Result<Frame> frame = camera.next_frame(std::max(period(film.info.frame_rate) * 2, Seconds(1)));
    if (!frame && frame.error().kind != ErrorKind::timed_out) return frame.error();
    if (frame) film.stamps.push_back(frame->stamp);
    film.counts = camera.counts() - before;
    done(1 - (end - clock.now()) / options.film);
  }
  return {};
}

}  // namespace

std::string_view name(Fitness fitness) {
  switch (fitness) {
    case Fitness::good:
      return "good";
    case Fitness::poor:
      return "poor";
    case Fitness::unfit:
      return "unfit";
  }
  return "unfit";
}

Result<ProbeFilm> film_probe(Camera& camera, const ProbeOptions& options, Clock& clock,
                             const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(camera.start());
  ProbeFilm film{camera.info(), {}, {}, {}};
  const double filming = options.resets > 0 ? 0.7 : 1.0;
  Status ended = film_for(camera, options, clock, film, [&](double part) {
    tell(progress, std::clamp(filming * part, 0.0, filming), "filming");
  });
  if (ended.ok() && options.resets > 0) {
    ended = time_resets(camera, options.resets, clock, film, [&](int resets) {
      tell(progress, filming + (1 - filming) * resets / options.resets, "resetting its shutter");
    });
  }
  camera.stop();
  tell(progress, 1, "done");
  if (!ended && film.stamps.empty()) return ended.error();
  if (!ended) film.failed = ended.error();
  return film;
}

ProbeVerdict assess(const ProbeFilm& film, std::optional<double> link_megabits) {
  ProbeVerdict verdict;
  const auto arrival = even_rate(film.stamps, &FrameStamp::monotonic_time);
  const auto own = film.info.device_time_of == DeviceTimeOf::unknown
                       ? std::nullopt
                       : even_rate(film.stamps, &FrameStamp::device_time);
  if (arrival) {
    verdict.rate = rate(own ? own->period : arrival->period);
    verdict.arrival_jitter = arrival->rms;
    verdict.arrival_worst = arrival->worst;
    verdict.findings.push_back(judge_rate(film.info, verdict.rate));
  } else {
    verdict.findings.push_back({"rate", Fitness::unfit, fmt::format("{} frames came", film.stamps.size()),
                                "see whether it films, and whether its cable holds"});
  }
  verdict.findings.push_back(judge_frames(film.counts));
  if (arrival) {
    verdict.findings.push_back(judge_arrival(*arrival));
    const ImageLayout& layout = film.info.layout;
    verdict.megabits =
        static_cast<double>(layout.row_bytes()) * layout.size.height * 8e-6 * verdict.rate.value();
    verdict.findings.push_back(judge_link(*verdict.megabits, link_megabits));
  }
  if (film.reset_delays.size() >= 2) {
    verdict.reset = spread(film.reset_delays);
    verdict.findings.push_back(
        {"reset", Fitness::good,
         fmt::format("{:.1f} ms from the order to the new phase's first frame, jitter {:.2f} ms over {}",
                     in_milliseconds(verdict.reset->mean), in_milliseconds(verdict.reset->sigma),
                     film.reset_delays.size())});
  }
  if (film.failed) {
    verdict.findings.push_back({"ended", Fitness::unfit, film.failed->message(), film.failed->remedy});
  }
  for (const ProbeFinding& f : verdict.findings) verdict.fitness = std::max(verdict.fitness, f.fitness);
  return verdict;
}

}  // namespace emberlock::drivers
