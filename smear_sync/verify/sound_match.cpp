// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/sound_match.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace emberlock::smear {
namespace {

constexpr double kSudden = 6;  // ratio of loudness
constexpr Seconds kBefore = milliseconds(100);
constexpr Seconds kEcho = milliseconds(150);  // dead time after a sudden sound
constexpr Seconds kRise = milliseconds(10);   // time within which its maximum is reached
constexpr Seconds kSame = milliseconds(
    15);  // tolerance for the times of the same sound in two clips, for different positions of the cameras
constexpr Seconds kSigma = milliseconds(30);  // of sound relative to picture, between two cameras
constexpr double kUnshared = 0.5;        // penalty for a sound that the other clip should contain and doesn't
constexpr double kClearly = 0.9;         // minimum lead of the best offset
constexpr std::size_t kMostSounds = 60;  // per track: more aren't claps

std::size_t steps(Seconds time, const SoundTrack& track) {
  return static_cast<std::size_t>(std::max(1.0, std::round(time / track.step)));
}

Seconds end_of(const SoundTrack& track) {
  return track.begin + track.step * static_cast<double>(track.levels.size());
}

/// Whether the track covers an instant, with enough margin to detect a sudden sound.
bool covers(const SoundTrack& track, Seconds at) {
  return at >= track.begin + kBefore && at <= end_of(track) - kRise;
}

struct Place {
  Seconds later;
  double score = 0;
  int shared = 0;
};

/// The score of the sounds if the clip begins `later`.
Place try_place(const SoundTrack& a, const std::vector<Seconds>& in_a, const SoundTrack& b,
                const std::vector<Seconds>& in_b, Seconds later) {
  Place place;
  Seconds sum;
  int unshared = 0;
  std::vector<bool> heard(in_b.size(), false);
  for (const Seconds at : in_a) {
    std::optional<std::size_t> nearest;
    for (std::size_t i = 0; i < in_b.size(); ++i) {
      const Seconds apart = abs(in_b[i] + later - at);
      if (!heard[i] && apart <= kSame && (!nearest || apart < abs(in_b[*nearest] + later - at))) nearest = i;
    }
    if (nearest) {
      heard[*nearest] = true;
      sum += at - in_b[*nearest];
      ++place.shared;
    } else {
      unshared += covers(b, at - later) ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < in_b.size(); ++i) unshared += !heard[i] && covers(a, in_b[i] + later) ? 1 : 0;
  place.later = place.shared > 0 ? sum / place.shared : later;
  place.score = place.shared - kUnshared * unshared;
  return place;
}

std::optional<SoundOffset> match(const SoundTrack& a, const std::vector<Seconds>& in_a, const SoundTrack& b,
                                 const std::vector<Seconds>& in_b) {
  std::vector<Place> places;
  for (const Seconds of_a : in_a) {
    for (const Seconds of_b : in_b) places.push_back(try_place(a, in_a, b, in_b, of_a - of_b));
  }
  if (places.empty()) return std::nullopt;
  const Place best = *std::max_element(places.begin(), places.end(),
                                       [](const Place& x, const Place& y) { return x.score < y.score; });
  const bool unique = std::all_of(places.begin(), places.end(), [&](const Place& p) {
    return abs(p.later - best.later) <= kSame * 2 || p.score <= best.score - kClearly;
  });
  if (!unique || best.score <= 0) return std::nullopt;
  return SoundOffset{
      best.later, kSigma,
      fmt::format("{} sudden sound{} in both tracks", best.shared, best.shared == 1 ? "" : "s")};
}

}  // namespace

std::vector<Seconds> sudden_sounds(const SoundTrack& track) {
  std::vector<Seconds> sounds;
  const std::size_t before = steps(kBefore, track);
  if (track.levels.size() <= 2 * before) return sounds;
  std::vector<float> sorted = track.levels;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double usual = std::max(1e-6, static_cast<double>(*middle));
  double sum = 0;
  for (std::size_t i = 0; i < before; ++i) sum += static_cast<double>(track.levels[i]);
  std::size_t next = before;
  for (std::size_t i = before; i < track.levels.size(); ++i) {
    const double quiet = std::max(usual, sum / static_cast<double>(before));
    if (i >= next && static_cast<double>(track.levels[i]) >= kSudden * quiet) {
      sounds.push_back(track.begin + track.step * (static_cast<double>(i) + 0.5));
      next = i + steps(kEcho, track);
    }
    sum += static_cast<double>(track.levels[i]) - static_cast<double>(track.levels[i - before]);
  }
  return sounds;
}

std::vector<std::optional<SoundOffset>> match_sounds(std::span<const SoundTrack> tracks,
                                                     std::size_t reference) {
  std::vector<std::vector<Seconds>> sounds;
  for (const SoundTrack& track : tracks) {
    sounds.push_back(sudden_sounds(track));
    if (sounds.back().size() > kMostSounds) sounds.back().clear();
  }
  std::vector<std::optional<SoundOffset>> offsets(tracks.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (i == reference) {
      offsets[i] = SoundOffset{Seconds(0), Seconds(0), "the reference's own"};
    } else {
      offsets[i] = match(tracks[reference], sounds[reference], tracks[i], sounds[i]);
    }
  }
  return offsets;
}

}  // namespace emberlock::smear
