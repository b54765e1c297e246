// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/quantity.h"

// Why the aligner decides what it decides: codes, and the numbers that go with them. The step compares them,
// recordings hold them, and align_words.h makes sentences of them. Cameras go by their index.
namespace emberlock::smear {

/// Why what a camera shows isn't taken for its dot.
enum class DoubtCause {
  strobe_stood,    ///< the strobe was told to move, and no camera's dot moved
  stood,           ///< its dot stood still when the strobe was moved
  against,         ///< it moved the other way
  otherwise,       ///< it moved by neither
  walked_apart,    ///< it and another camera's moved apart as the flashes walked: either may err
  walked_against,  ///< it walks the other way than the others' under the flashes
  stood_in_walk,   ///< it stands still while the others' walk
};

struct Doubt {
  DoubtCause cause = DoubtCause::stood;
  Seconds strobe{};  ///< by which the strobe was told to move; zero where flashes walk
  Seconds seen{};    ///< by which the dot moved meanwhile
  friend bool operator==(const Doubt&, const Doubt&) = default;
};

/// Within what cameras must come in this round.
enum class AlignGoal {
  tolerance,
  reach,  ///< of their trims, which bring them to the target from there
};

/// What a camera is told, and why.
enum class CameraCause {
  none,              ///< nothing was looked at
  stands,            ///< its error is known, but the run is refused before anything is decided of it
  reference,         ///< the others are brought to its phase
  within,            ///< within the goal: is left alone
  fixed,             ///< out of the goal, and can't be reset
  waits,             ///< out of the goal; the target may yet come to it
  by_hand,           ///< out of the goal: somebody must reset it
  reset,             ///< out of the goal: is reset
  untaught,          ///< out of tolerance; waits until one of its model has taught how long a reset takes
  in_turn,           ///< out of tolerance; somebody is to reset `after` first
  leaving,           ///< may leave tolerance within `stay`: is reset before
  leaving_by_hand,   ///< the same, and somebody must reset it
  late,              ///< trims take too long for it: is reset
  slewing,           ///< comes at full rate, trimmed by `trim`
  settling,          ///< is stopped on the target by `trim`
  locked,            ///< is held on the target by `trim`
  waits_for_others,  ///< its phase is known, another's isn't
  away,              ///< sends no frames
  doubted,           ///< `doubt` says why what it shows isn't its dot
  blind,             ///< shows no dot: flashes are moved, or walk on by themselves
  unreadable,        ///< its picture can't be read
  unheard,           ///< too few cameras agree on how the flashes walk to take its phase over
  waits_for_dial,    ///< the strobe must be set first
};

/// What the moment of a reset is chosen for.
enum class ResetTiming {
  none,       ///< it is drawn at random
  on_target,  ///< lands it on the target
  far_side,   ///< lands it where its drift leads it through the whole tolerance
  teaches,    ///< is drawn at random, and teaches how long a reset takes
};

struct CameraReason {
  CameraCause cause = CameraCause::none;
  ResetTiming timing = ResetTiming::none;
  Seconds stay{};
  PartsPerMillion trim{};
  std::optional<std::size_t> after{};
  std::optional<Doubt> doubt{};
  friend bool operator==(const CameraReason&, const CameraReason&) = default;
};

/// Why the verdict is what it is, or what the rig waits for.
enum class AlignCause {
  none,
  untrimmable,     ///< refused: `cameras` can't be trimmed, and the policy trims
  untellable,      ///< refused: phases are known to `sigma`, which doesn't tell the tolerance
  too_costly,      ///< refused: it isn't met within the limits
  stuck,           ///< given up: `cameras` are out of tolerance and can't be reset
  out,             ///< `cameras` are out of the goal
  leaving,         ///< `cameras` would leave tolerance before long
  within,          ///< all are within tolerance
  locked,          ///< all are within tolerance, and held there by trims
  trimming,        ///< trims bring all to the target
  waits_for_away,  ///< of `cameras` phases are missing, and somebody is away
  looks_again,     ///< of `cameras` phases are missing
  unseen,          ///< given up: of `cameras` phases are missing after so many `looks`
  unmoved,         ///< given up: dots weren't seen to move after so many `looks`
  drift_unknown,   ///< all are within tolerance, and how `cameras` drift isn't known well enough yet
  dial,            ///< what the strobe's dial is to be set to: the decision's `dial` says more
};

struct AlignReason {
  AlignCause cause = AlignCause::none;
  std::vector<std::size_t> cameras{};
  /// Cameras whose dots must be seen to move with the strobe before they are called aligned: those that
  /// nothing was seen of at two places of the strobe, and those whose phase is known too roughly.
  std::vector<std::size_t> unmoved{};
  std::vector<std::size_t> rough{};
  Seconds sigma{};  ///< to which phases are known: the roughest
  int looks = 0;
  int rounds = 0;                          ///< given up after so many without an end; else 0
  std::optional<std::size_t> first_out{};  ///< once aligned: who may leave tolerance first
  friend bool operator==(const AlignReason&, const AlignReason&) = default;
};

/// What is to be said to whoever sets the strobe by its dial.
enum class DialCause {
  leave,          ///< it is followed
  out_of_sight,   ///< it was followed a moment ago
  set,            ///< the flashes can't be followed as they are seen
  turn_off_rate,  ///< they stand nearly still: it is to be turned away from the frames' rate
};

}  // namespace emberlock::smear
