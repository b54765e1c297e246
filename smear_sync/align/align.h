// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/shutter.h"
#include "base/strobe_dial.h"
#include "base/time_point.h"
#include "smear_sync/align/align_reason.h"
#include "smear_sync/align/phase_track.h"
#include "smear_sync/align/rate_servo.h"
#include "smear_sync/clocks/drift.h"
#include "smear_sync/clocks/flash_rate.h"
#include "smear_sync/clocks/phase.h"

namespace emberlock::smear {

// The alignment as a pure step: what was known, and what a round of filming showed, give what is known now
// and what to do next. It has no clock and no device: rig/align/run.h carries its orders out, and a
// recording replays through it.

/// Which cameras are reset, and towards what.
enum class AlignPolicy {
  fixed_reference,  ///< the paper's: one camera stays, the others are reset until each lies within tolerance
  densest,  ///< the target is chosen anew each round: the middle of the cameras that take the fewest resets
  timed,    ///< as densest, and each reset is ordered for the moment that lands it on the target, or so far
            ///< before it that its drift leads it through the whole tolerance; cameras that are held are
            ///< reset before they leave it
  trimmed,  ///< as timed until all are within reach of their trims; then frame rates are trimmed (a
            ///< phase-locked loop), towards the phase that the last camera reaches soonest
};
std::string_view name(AlignPolicy policy);
/// From "fixed-reference", "densest", "timed" or "trimmed"; the error lists them.
Result<AlignPolicy> parse_align_policy(std::string_view text);

using MetersPerSecond = Quantity<struct MetersPerSecondUnit>;

/// How far a camera may lie from the target, to either side; two cameras may differ by twice as much.
struct Tolerance {
  std::variant<Rows, Seconds> amount = Rows(100);
  [[nodiscard]] Seconds in_time(SecondsPerRow row_time) const;
  [[nodiscard]] Rows in_rows(SecondsPerRow row_time) const;
};
/// From "0.5ms", "500us" or "10rows": a positive number and its unit.
Result<Tolerance> parse_tolerance(std::string_view text);

/// What the tolerance of a recording follows from.
struct FlameMotion {
  MetersPerSecond speed{2};  ///< of what moves fastest in the flame, > 0
  Meters detail{0.004};      ///< the smallest that shall be resolved, > 0: some voxels
};
/// That in which a detail moves by a quarter of itself: two cameras, a tolerance to either side of the
/// target, then see it displaced by half of itself at most.
Tolerance tolerance_for(const FlameMotion& flame);
/// "0.50 ms (9.3 rows)": people think in rows and flames move in time.
std::string words(const Tolerance& tolerance, SecondsPerRow row_time);

/// Who resets shutters while an alignment runs.
enum class ResetBy {
  orders,   ///< the alignment alone, also those by hand: it knows of each
  anybody,  ///< people too, who press buttons and say nothing: they are asked for one camera at a time, and a
            ///< phase that jumps, or a camera that was away, has been reset
};

/// The time from the moment for which a reset is ordered to the stamps of the frames that follow, modulo T.
/// It holds the camera's own latency and its transport's: nothing else needs to be known of either for a
/// timed reset.
struct ResetDelay {
  Seconds mean;   ///< in [0, T)
  Seconds sigma;  ///< standard error of the mean for this camera
};

struct AlignCamera {
  std::string id;
  std::string model;  ///< cameras of one model teach each other their delay
  ShutterReset method = ShutterReset::on_command;
  std::optional<ResetDelay>
      expected_delay;  ///< known before (from an earlier session, or the model's data); else learnt
  std::optional<FrameRateTrim> trim = {};  ///< where its frame rate can be trimmed
  /// By how much its read phase shall start after the target, 0..T: of staggered cameras (stagger.h). Its
  /// errors are those to its own instant.
  Seconds offset{0};
};

/// What an operator will spend on an alignment. One that can't be had for it is refused before anything is
/// reset.
struct AlignLimits {
  int resets = 1000;
  Seconds time{3600};
  double probability = 0.9;  ///< with which it must be had, 0..1
};

/// What bringing the cameras within a tolerance takes.
struct AlignEffort {
  double resets = 0;   ///< expected
  int resets_p95 = 0;  ///< 95th percentile
  Seconds time;        ///< expected
  Seconds time_p95;    ///< 95th percentile
  double within = 1;   ///< probability of being done within the limits; those that aren't count as their
                       ///< limits above
};

/// A tolerance that could be met, and how.
struct AlignOffer {
  AlignPolicy policy = AlignPolicy::densest;
  Tolerance tolerance;
  AlignEffort effort;
};

struct AlignOptions {
  AlignPolicy policy = AlignPolicy::densest;
  Tolerance tolerance{};
  Seconds period{1 / 23.976};                         ///< T
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row
  std::size_t reference = 0;                          ///< of fixed_reference
  Seconds delay_jitter =
      milliseconds(0.2);  ///< standard deviation of one reset's delay about its camera's mean, > 0
  PartsPerMillion rate_spread{
      20};  ///< of the cameras' rates about the common beat, before they were seen: how fast a phase ages
  PartsPerMillion rate_wander{0.2};  ///< of a rate in a minute, as cameras warm up
  Seconds trim_time{60};    ///< of trimmed, > 0: cameras that trims wouldn't bring to the target by then,
                            ///< the outermost, are reset
  Seconds round_time{0.6};  ///< of one round of filming, for what is foretold, > 0
  Seconds reset_time{0};    ///< of one reset more in a round: an operator's way to the button
  Seconds sweep_time{0};    ///< of a round after resets, beyond its own: what finds a reset shutter's phase
  std::optional<AlignLimits> limits = {};  ///< absent: nothing is refused for what it takes
  int max_rounds = 500;                    ///< without all within tolerance, > 0
  int max_looks = 6;                       ///< strobe phases tried in a row for cameras that show no dot, > 0
  /// By which the strobe is moved to see that every dot moves with it, as no reflection does, before cameras
  /// are called aligned; > 0 and < T / 4. Zero: what looks like a dot is believed.
  Seconds strobe_step = milliseconds(2);
  ResetBy reset_by = ResetBy::orders;
  /// Of a strobe that somebody sets by hand: it is told nothing, and its flashes walk through the frames at a
  /// rate that the frames tell (align_dial.h). `strobe_step` is then how far dots shall be seen to follow.
  std::optional<StrobeDial> dial = {};
  /// Cameras are called aligned once they surely stay so for this long, as far as it can be had: drifts are
  /// measured before, and cameras are reset that would leave before although a reset lets them stay. While
  /// they are held that is renewed before less is left. Zero: whenever all are within
  /// tolerance.
  Seconds shortest_take{0};
};

/// How phases are followed under these options.
TrackOptions track_options(const AlignOptions& options);

/// One camera in one round.
struct CameraView {
  Phase phase;  ///< at the round's instant, of flashes that are delayed by the round's strobe_phase
  std::optional<TimePoint>
      stamp;             ///< an instant, near the round's, at which its frames are stamped (modulo T)
  bool away = false;     ///< no frame came in time: switched off, unplugged, or somebody resets it
  bool unheard = false;  ///< its phase was left out: too few cameras agree on how the flashes walk
};

struct ResetDone {
  std::size_t camera = 0;
  std::optional<TimePoint>
      at;  ///< the moment that the camera was told; absent when an operator pressed a button
};

struct TrimDone {
  std::size_t camera = 0;
  TimePoint at;  ///< the moment that the camera was told
  PartsPerMillion trim;
};

/// What a round of filming showed, and what was done since the one before.
struct AlignRound {
  TimePoint at;  ///< the instant to which all phases refer
  PeriodOffset period_offset;
  Seconds strobe_phase;  ///< the delay of the flashes during the round; tau grows by as much as it does
  std::vector<CameraView> cameras;
  std::vector<ResetDone> resets;     ///< carried out since the round before
  std::vector<TrimDone> trims = {};  ///< likewise
  FlashRate flashes = {};            ///< of a strobe with a dial: what the frames tell of it
  /// `strobe_phase` doesn't rest on one camera's word, which can't be a witness to itself: dots may be judged
  /// by how they follow it.
  bool moves_told = true;
};

/// A dot, or what passes for one, where it stood when it was seen.
struct Sighting {
  Seconds tau;           ///< strobe_phase taken out
  Seconds strobe_phase;  ///< of that round
};

/// What is remembered of a camera from round to round.
struct CameraTrack {
  PhaseTrack phase;  ///< strobe_phase taken out
  int resets = 0;
  int taught = 0;                    ///< resets whose delay was observed
  std::optional<ResetDelay> delay;   ///< its own, once taught
  std::optional<Drift> before_hand;  ///< where it stood before a reset by hand that hasn't been seen yet
  std::vector<Seconds> hand_shifts;  ///< by which resets by hand moved its tau, modulo T; the newest last
  // Since the shutter's phase was last drawn:
  std::optional<Sighting> sighted;  ///< the newest
  bool moved = false;               ///< its dot was seen to move with the strobe
  std::optional<Seconds> rough;  ///< seen at two places of the strobe, but only to this: too roughly to tell
  std::optional<Doubt> doubt;    ///< why what is seen isn't taken for its dot; absent if it is
  bool away = false;             ///< in the last round
  bool renewed = false;          ///< reset in the renewal under way

  /// Whether it is doubted because it and another camera contradict each other, of which either may err.
  [[nodiscard]] bool disputed() const { return doubt && doubt->cause == DoubtCause::walked_apart; }
};

/// The phase to which cameras are brought, strobe_phase taken out: it moves as a camera of this rate would.
struct AlignTarget {
  TimePoint at;
  Seconds tau;
  PartsPerMillion rate;
  bool settled = false;  ///< trims are near it: it stays as it is
};

/// What is remembered of a strobe that somebody sets by hand.
struct DialState {
  std::optional<Hertz> wanted;  ///< what was asked for last, where that isn't one flash a frame
  PhaseTrack walk;  ///< how far the flashes have walked through the frames since they were first seen
  std::optional<TimePoint> at;    ///< of the round before
  Seconds walked;                 ///< since a look was counted, there or back
  std::vector<ResetDone> resets;  ///< carried out while the dial was waited for: no camera has told of them
  std::vector<TrimDone> trims;    ///< likewise
};

struct AlignState {
  int rounds = 0;
  int rounds_out = 0;  ///< since all were last within tolerance
  int resets = 0;
  int looks = 0;  ///< rounds in a row that ended with a camera whose phase isn't known, or hasn't moved yet
  double jitter_seen = 0;  ///< s^2: sum over resets of a delay's squared deviation from its camera's mean
  int jitter_samples = 0;
  bool affordable = false;  ///< the limits have been looked at, and hold
  std::optional<TimePoint> last_round;
  std::optional<AlignTarget> target;  ///< of trims, once they have begun; of timed resets, once all are held
  bool held = false;  ///< the last round found all within tolerance, or resets those that would leave it
  int renewal = 0;  ///< rounds since cameras were last reset before they left tolerance; 0: none is under way
  std::optional<TimePoint> trimming;  ///< since when, until aligned
  std::optional<std::size_t> asked;   ///< the camera that somebody was asked to reset
  DialState dial;
  std::vector<CameraTrack> cameras;
};

struct CameraDecision {
  PhaseState state = PhaseState::unusable;  ///< in this round; a dot in doubt is none
  std::optional<Seconds>
      error;           ///< to the target; positive when it reads earlier. From an earlier round if blind now
  Seconds sigma;       ///< standard error of its own phase
  bool reset = false;  ///< reset it now
  std::optional<TimePoint> moment;  ///< order the reset for this instant or any that differs by whole periods
  std::optional<PartsPerMillion> trim;  ///< trim its frame rate to this from now on, aligned or not
  std::optional<ServoState> servo;      ///< of a camera that is trimmed
  std::optional<TimeLeft> time_left;    ///< in tolerance, as it drifts now
  std::optional<Seconds> sure_stay;  ///< in tolerance (three standard errors): `next_check` is the shortest
  CameraReason reason;
};

/// What is asked of whoever sets the strobe by its dial, and what it was seen to do.
struct DialAdvice {
  Hertz set;                      ///< flashes a second that it shall be set to
  std::optional<Hertz> measured;  ///< what it does, by the frames of this round
  PartsPerMillion sigma;          ///< standard error of that
  std::vector<Hertz> others{};    ///< rates that would have shown the same (flash_rate.h)
  bool ready = false;             ///< the flashes can be followed; if not, nothing goes on
  bool act = false;               ///< somebody must turn it
  DialCause cause = DialCause::leave;
  FlashesSeen seen = FlashesSeen::none;
  std::optional<Hertz> slower_than{};  ///< of flashes too slow to tell their rate
  // Of turn_off_rate:
  std::optional<Hertz> from{};        ///< the rate that it is turned from
  std::vector<std::size_t> hidden{};  ///< cameras whose dots shall walk into sight; none: dots shall follow
};

enum class AlignVerdict {
  go_on,
  aligned,
  refused,   ///< the tolerance can't be met within the limits; `offers` says what could be
  given_up,  ///< somebody must see to the rig
};
std::string_view name(AlignVerdict verdict);

/// What a round decided: codes and numbers. align_words.h says them.
struct AlignDecision {
  int round = 0;  ///< from 1
  AlignVerdict verdict = AlignVerdict::go_on;
  std::optional<Seconds> target;  ///< tau of the target in this round, strobe_phase included; absent while
                                  ///< phases are missing. A camera's own is less by its offset
  std::optional<std::size_t> reference;  ///< the camera nearest to the target; of fixed_reference that one
  std::vector<CameraDecision> cameras;
  std::optional<Seconds>
      worst_pair;  ///< largest difference between two cameras' errors; absent while phases are missing
  std::optional<Seconds> strobe_phase;  ///< the delay to which the strobe shall be moved, in [0, T): to bring
                                        ///< blind cameras out, or to see that dots move with it; once aligned
                                        ///< by the next check
  int resets_so_far = 0;                ///< before this decision's
  /// Nobody has left tolerance: cameras that would have before long are being reset meanwhile.
  bool renews = false;
  /// In this round that begins; without `renews` shutters are drawn at random, and nobody knows how long it
  /// takes.
  bool in_time = false;
  std::optional<std::size_t> reset_next;  ///< of ResetBy::anybody: the camera that somebody must reset now
  std::vector<std::size_t> jumped;        ///< likewise: those that somebody has reset, as this round shows
  std::optional<Seconds> next_check;  ///< once aligned: film again by then, before the drift may have led a
                                      ///< camera out (three standard errors)
  std::optional<Seconds> renewed;  ///< once aligned: what next_check would be if cameras were reset now for
                                   ///< it; absent where nobody can tell
  std::optional<AlignEffort> effort;  ///< foretold in the first round that has all phases, given limits
  std::vector<AlignOffer> offers;     ///< of a refusal
  std::optional<DialAdvice> dial;     ///< of a strobe that somebody sets by hand
  AlignGoal goal = AlignGoal::tolerance;
  AlignReason reason;
};

struct AlignStep {
  AlignState state;
  AlignDecision decision;
};

/// One round. `round.cameras`, `cameras` and `state.cameras` (empty at first) go by the same index.
AlignStep align_step(const AlignState& state, const AlignRound& round,
                     const std::vector<AlignCamera>& cameras, const AlignOptions& options);

}  // namespace emberlock::smear
