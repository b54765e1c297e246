#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "smear_sync/phase.h"

namespace emberlock {

// The alignment as a pure step: what was known, and what a round of filming showed, give what is known now
// and what to do next. It has no clock and no device: cli/align_run.h carries its orders out, and a recording
// replays through it.

/// Which cameras are reset, and towards what.
enum class AlignPolicy {
  fixed_reference,  ///< the paper's: one camera stays, the others are reset until each lies within tolerance
  densest,  ///< the reference is chosen anew each round where most cameras already lie within tolerance
  timed,    ///< as densest, and each reset is ordered for the moment that lands it on the reference
};
std::string_view name(AlignPolicy policy);
/// From "fixed-reference", "densest" or "timed"; the error lists them.
Result<AlignPolicy> parse_align_policy(std::string_view text);

/// How far a camera may lie from the reference, to either side; two cameras may differ by twice as much.
struct Tolerance {
  std::variant<Rows, Seconds> amount = Rows(100);
  [[nodiscard]] Seconds in_time(SecondsPerRow row_time) const;
  [[nodiscard]] Rows in_rows(SecondsPerRow row_time) const;
};
/// From "100rows", "5.4ms" or "500us": a positive number and its unit.
Result<Tolerance> parse_tolerance(std::string_view text);

/// How a camera's shutter phase can be drawn anew.
enum class ResetMethod { none, by_hand, on_command };

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
  ResetMethod method = ResetMethod::on_command;
  std::optional<ResetDelay>
      expected_delay;  ///< known before (from an earlier session, or the model's data); else learnt
};

struct AlignOptions {
  AlignPolicy policy = AlignPolicy::densest;
  Tolerance tolerance{};
  Seconds period{1 / 23.976};                         ///< T
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row
  std::size_t reference = 0;                          ///< of fixed_reference
  Seconds delay_jitter =
      milliseconds(0.2);  ///< standard deviation of one reset's delay about its camera's mean, > 0
  Seconds delay_spread = milliseconds(
      10);  ///< standard deviation of the means within one model, > 0; large: they teach each other nothing
  PartsPerMillion rate_spread{
      20};               ///< of the cameras' rates about the common beat: how fast a phase seen earlier ages
  int max_rounds = 500;  ///< > 0
  int max_looks = 6;     ///< strobe phases tried in a row for cameras that show no dot, > 0
};

/// One camera in one round.
struct CameraView {
  Phase phase;  ///< at the round's instant
  std::optional<TimePoint>
      stamp;  ///< an instant, near the round's, at which its frames are stamped (modulo T)
};

struct ResetDone {
  std::size_t camera = 0;
  std::optional<TimePoint>
      at;  ///< the moment that the camera was told; absent when an operator pressed a button
};

/// What a round of filming showed, and what was done since the one before.
struct AlignRound {
  TimePoint at;  ///< the instant to which all phases refer
  Beat beat;
  Seconds strobe_phase;  ///< the delay of the flashes during the round; tau grows by as much as it does
  std::vector<CameraView> cameras;
  std::vector<ResetDone> resets;  ///< carried out since the round before
};

/// What is remembered of a camera from round to round.
struct CameraTrack {
  std::optional<Phase> phase;  ///< as last seen since its last reset, strobe_phase taken out
  TimePoint seen;              ///< when
  int resets = 0;
  int taught = 0;                   ///< resets whose delay was observed
  std::optional<ResetDelay> delay;  ///< its own, once taught
};

struct AlignState {
  int rounds = 0;
  int resets = 0;
  int looks = 0;  ///< rounds in a row that ended with a camera whose phase isn't known
  std::optional<std::size_t> reference;
  std::vector<CameraTrack> cameras;
};

struct CameraDecision {
  PhaseState state = PhaseState::unusable;  ///< in this round
  std::optional<Seconds>
      error;      ///< to the reference; positive when it reads earlier. From an earlier round if blind now
  Seconds sigma;  ///< standard error of its own phase
  bool reset = false;               ///< reset it now
  std::optional<TimePoint> moment;  ///< order the reset for this instant or any that differs by whole periods
  std::string reason;               ///< a sentence that an operator can act on
};

enum class AlignVerdict { go_on, aligned, given_up };

struct AlignDecision {
  int round = 0;  ///< from 1
  AlignVerdict verdict = AlignVerdict::go_on;
  std::optional<std::size_t> reference;  ///< absent while phases are missing
  std::vector<CameraDecision> cameras;
  std::optional<Seconds>
      worst_pair;  ///< largest difference between two cameras; absent while phases are missing
  std::optional<Seconds>
      strobe_phase;  ///< the delay to which the strobe shall be moved, in [0, T), to bring blind cameras out
  int resets_so_far = 0;  ///< before this decision's
  std::string reason;     ///< of the verdict, or what the rig waits for
};

struct AlignStep {
  AlignState state;
  AlignDecision decision;
};

/// One round. `round.cameras`, `cameras` and `state.cameras` (empty at first) go by the same index.
AlignStep align_step(const AlignState& state, const AlignRound& round,
                     const std::vector<AlignCamera>& cameras, const AlignOptions& options);

}  // namespace emberlock
