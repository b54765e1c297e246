// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_words.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "base/one_to_one.h"
#include "smear_sync/align/align_context.h"
#include "smear_sync/align/dial_words.h"
#include "smear_sync/align/stagger.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<AlignVerdict, std::string_view, 4> kVerdictNames{{{{AlignVerdict::go_on, "go-on"},
                                                                      {AlignVerdict::aligned, "aligned"},
                                                                      {AlignVerdict::refused, "refused"},
                                                                      {AlignVerdict::given_up, "given-up"}}}};

/// What sentences are made from.
struct Facts {
  const AlignDecision& decision;
  const AlignRound& round;
  const std::vector<AlignCamera>& cameras;
  const AlignOptions& options;

  /// "cam1, cam3"
  [[nodiscard]] std::string ids(const std::vector<std::size_t>& which) const {
    std::string text;
    for (const std::size_t i : which) text += (text.empty() ? "" : ", ") + cameras[i].id;
    return text;
  }
  [[nodiscard]] double in_rows(Seconds time) const { return (time / options.row_time).value(); }
  /// To what errors are taken.
  [[nodiscard]] std::string target() const { return staggered(cameras) ? "its own instant" : "the target"; }
};

/// "reads 34.2 rows (1.847 ms) before the target"
std::string standing(const Facts& facts, Seconds error) {
  return fmt::format("reads {:.1f} rows ({:.3f} ms) {} {}", std::abs(facts.in_rows(error)),
                     std::abs(in_milliseconds(error)), error.value() >= 0 ? "before" : "after",
                     facts.target());
}

/// "1 camera", "3 cameras"
std::string plural(std::size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string looks(const AlignReason& why) { return plural(static_cast<std::size_t>(why.looks), "look"); }

/// "14 resets (95 %: 21) and 40 s (95 %: 1.2 min)"
std::string effort_words(const AlignEffort& effort) {
  return fmt::format("{:.0f} resets (95 %: {}) and ", effort.resets, effort.resets_p95) + words(effort.time) +
         " (95 %: " + words(effort.time_p95) + ")";
}

std::string doubt_words(const Doubt& doubt) {
  const std::string moved = fmt::format("moved by {:.2f} ms", in_milliseconds(doubt.strobe));
  switch (doubt.cause) {
    case DoubtCause::strobe_stood:
      return "no camera's dot moved when the strobe's flashes were " + moved +
             ": see whether the strobe does as it is told";
    case DoubtCause::stood:
      return "its dot stood still when the strobe's flashes were " + moved +
             ": look for a reflection of the lamp in the lamp's own columns, shade it, or turn the camera";
    case DoubtCause::against:
      return "its dot moved the other way when the strobe's flashes were " + moved +
             ": set its read direction the other way round";
    case DoubtCause::otherwise:
      return fmt::format("its dot moved by {:.2f} ms when the strobe's flashes were ",
                         in_milliseconds(doubt.seen)) +
             moved +
             ": see whether its row time is right, its shutter was reset, or a reflection stands in its "
             "columns";
    case DoubtCause::walked_apart:
      return "its dot and another camera's moved apart as the flashes walked, and too few cameras were seen "
             "to say which is wrong: see whether the read direction of each is set right, and look for "
             "reflections of the lamp";
    case DoubtCause::walked_against:
      return "its dot moves the other way than the others' as the flashes walk: set its read direction the "
             "other way round";
    case DoubtCause::stood_in_walk:
      return "its dot stands still while the others' follow the flashes as they walk: look for a reflection "
             "of the lamp in the lamp's own columns, shade it, or turn the camera";
  }
  return {};
}

std::string timing_words(ResetTiming timing) {
  switch (timing) {
    case ResetTiming::none:
      break;
    case ResetTiming::on_target:
      return " at the moment that lands it on the target";
    case ResetTiming::far_side:
      return " at the moment that lets it drift through the tolerance";
    case ResetTiming::teaches:
      return ", which teaches how long its reset takes";
  }
  return {};
}

/// What follows where a camera stands.
std::string after_standing(const Facts& facts, std::size_t camera) {
  const CameraReason& why = facts.decision.cameras[camera].reason;
  const bool reach = facts.decision.goal == AlignGoal::reach;
  const std::string out = reach ? ", further than trims reach" : ", out of tolerance";
  const std::string by = fmt::format(" by {:+.1f} ppm", why.trim.value());
  switch (why.cause) {
    case CameraCause::within:
      return std::string(reach ? ", within reach of its trim" : ", within tolerance") + ": leave it";
    case CameraCause::fixed:
      return out + ", and can't be reset";
    case CameraCause::waits:
      return out + ": waits, the target may yet come to it";
    case CameraCause::by_hand:
      return out + ": reset its shutter by hand";
    case CameraCause::reset:
      return out + ": its shutter is reset" + timing_words(why.timing);
    case CameraCause::untaught:
      return ", out of tolerance: waits until another " + facts.cameras[camera].model +
             " has taught how long a reset takes";
    case CameraCause::in_turn:
      return ", out of tolerance: its turn comes after " + facts.cameras[why.after.value_or(camera)].id +
             "'s";
    case CameraCause::leaving:
      return ", and may leave tolerance in " + words(why.stay) + ": its shutter is reset before" +
             timing_words(why.timing);
    case CameraCause::leaving_by_hand:
      return ", and may leave tolerance in " + words(why.stay) + ": reset its shutter by hand";
    case CameraCause::late:
      return ", which trims take too long for: its shutter is reset" + timing_words(why.timing);
    case CameraCause::slewing:
      return ": comes at full rate, trimmed" + by;
    case CameraCause::settling:
      return ": is stopped on the target, trimmed" + by;
    case CameraCause::locked:
      return ", locked: held there" + by;
    case CameraCause::none:
    case CameraCause::stands:
    case CameraCause::reference:
    case CameraCause::waits_for_others:
    case CameraCause::away:
    case CameraCause::doubted:
    case CameraCause::blind:
    case CameraCause::unreadable:
    case CameraCause::unheard:
    case CameraCause::waits_for_dial:
      break;  // camera_words() has said it
  }
  return {};
}

constexpr const char* kUnheard = "too few cameras agree on how the flashes walk";

std::string camera_words(const Facts& facts, std::size_t camera) {
  const CameraDecision& decision = facts.decision.cameras[camera];
  const std::string& picture = facts.round.cameras[camera].phase.reason;
  const std::string unreadable = "can't be read: see to its view of the lamp and to the strobe (";
  switch (decision.reason.cause) {
    case CameraCause::none:
      return {};
    case CameraCause::reference:
      return "is the reference: the others are brought to its phase";
    case CameraCause::waits_for_others:
      return "its phase is known: waits for the cameras whose phase isn't";
    case CameraCause::away:
      return "sends no frames: switch it on, or plug it in; it goes on by itself";
    case CameraCause::doubted:
      return doubt_words(decision.reason.doubt.value_or(Doubt{}));
    case CameraCause::blind:
      return (facts.options.dial ? "shows no phase: waits until the flashes have walked on ("
                                 : "shows no phase: the strobe's is moved to bring it out (") +
             picture + ")";
    case CameraCause::unreadable:
      return unreadable + picture + ")";
    case CameraCause::unheard:
      return unreadable + kUnheard + ")";
    case CameraCause::waits_for_dial:
      return "waits until the strobe is set";
    default:
      break;
  }
  if (!decision.error) return {};
  return standing(facts, *decision.error) + after_standing(facts, camera);
}

std::string untellable(const Facts& facts) {
  const double known = facts.in_rows(facts.decision.reason.sigma);
  const Tolerance least{Rows(std::ceil(10 * kTellable * known) / 10) * facts.options.row_time};
  return words(facts.options.tolerance, facts.options.row_time) +
         fmt::format(" can't be told: phases are known to {:.2g} rows. Ask for ", known) +
         words(least, facts.options.row_time) + " or more, or let the flash be about a row long";
}

/// Of a tolerance that can't be met for what it takes, and of what could be.
std::string too_costly(const Facts& facts) {
  const AlignOptions& options = facts.options;
  const AlignEffort effort = facts.decision.effort.value_or(AlignEffort{});
  const AlignLimits limits = options.limits.value_or(AlignLimits{});
  std::string text = fmt::format("{} by {} are met with a probability of {:.0f} % within {} resets and ",
                                 words(options.tolerance, options.row_time), name(options.policy),
                                 100 * effort.within, limits.resets) +
                     words(limits.time) +
                     fmt::format(", and {:.0f} % are asked for", 100 * limits.probability);
  if (facts.decision.offers.empty()) return text + "; allow more resets or time";
  text += ". What could be met: ";
  bool first = true;
  for (const AlignOffer& offer : facts.decision.offers) {
    text += (first ? "" : "; ") +
            fmt::format("{} by {} with ", words(offer.tolerance, options.row_time), name(offer.policy)) +
            effort_words(offer.effort) + fmt::format(", at {:.0f} %", 100 * offer.effort.within);
    first = false;
  }
  return text;
}

/// What the first of the cameras without a phase shows that tells why.
std::string why_unseen(const Facts& facts) {
  for (const std::size_t i : facts.decision.reason.cameras) {
    const CameraReason& camera = facts.decision.cameras[i].reason;
    std::string why;
    if (camera.cause == CameraCause::doubted) why = doubt_words(camera.doubt.value_or(Doubt{}));
    if (camera.cause == CameraCause::unheard) why = kUnheard;
    if (camera.cause == CameraCause::unreadable) why = facts.round.cameras[i].phase.reason;
    if (!why.empty()) return why;
  }
  return "check that the lamp is in view, not over-exposed, and flashes once a frame";
}

/// Why a run ends whose cameras lie in tolerance as far as anybody can tell.
std::string unmoved(const Facts& facts) {
  const AlignReason& why = facts.decision.reason;
  std::string text;
  if (!why.unmoved.empty()) {
    text = "no dot of " + facts.ids(why.unmoved) + " was seen at two places of the strobe in " + looks(why) +
           ": check that the lamp is in view and not over-exposed";
  }
  if (why.rough.empty()) return text;
  if (!text.empty()) text += "; ";
  return text + fmt::format(
                    "the phase of {} is known to {:.2f} ms, too roughly to see it follow the "
                    "strobe by {:.2f} ms: ask for a finer tolerance, or give it more of the flash",
                    facts.ids(why.rough), in_milliseconds(why.sigma),
                    in_milliseconds(facts.options.strobe_step));
}

std::string cause_words(const Facts& facts) {
  const AlignReason& why = facts.decision.reason;
  const std::string who = facts.ids(why.cameras);
  switch (why.cause) {
    case AlignCause::none:
      break;
    case AlignCause::untrimmable:
      return "the frame rate of " + who +
             " can't be trimmed: use the timed policy, whose resets reach as far as their latency is steady";
    case AlignCause::untellable:
      return untellable(facts);
    case AlignCause::too_costly:
      return too_costly(facts);
    case AlignCause::stuck:
      return who + " can't be reset and lies out of tolerance: make it the reference, or widen the tolerance";
    case AlignCause::out:
      return plural(why.cameras.size(), "camera") +
             (facts.decision.goal == AlignGoal::reach ? " out of reach" : " out of tolerance");
    case AlignCause::leaving:
      return who + " would leave tolerance before long";
    case AlignCause::within:
      return "every camera lies within tolerance of " + facts.target();
    case AlignCause::locked:
      return "every camera is locked within tolerance of " + facts.target();
    case AlignCause::trimming:
      return staggered(facts.cameras) ? "trims bring every camera to its own instant"
                                      : "trims bring the cameras to the target";
    case AlignCause::waits_for_away:
      return "waits for " + who;
    case AlignCause::looks_again:
      return "looks again for " + who;
    case AlignCause::unseen:
      return "no phase of " + who + " after " + looks(why) +
             " at different phases of the strobe: " + why_unseen(facts);
    case AlignCause::unmoved:
      return unmoved(facts);
    case AlignCause::drift_unknown:
      return "every camera lies within tolerance of " + facts.target() + "; films on until it is known how " +
             who + (why.cameras.size() == 1 ? " drifts" : " drift");
    case AlignCause::dial:
      return dial_words(facts.decision, facts.cameras, facts.options);
  }
  return {};
}

/// What else is to be done about cameras that lie within tolerance.
std::string and_then(const Facts& facts) {
  const AlignReason& why = facts.decision.reason;
  if (why.rounds > 0) return {};  // nothing is: it was given up
  std::vector<std::size_t> still = why.unmoved;
  still.insert(still.end(), why.rough.begin(), why.rough.end());
  if (why.cause != AlignCause::unmoved && !still.empty()) {
    if (facts.options.dial)
      return "; the dot of " + facts.ids(still) + " must be seen to follow the flashes as they walk";
    return fmt::format("; the strobe is moved by {:.2f} ms, which the dot of {} must follow",
                       in_milliseconds(facts.options.strobe_step), facts.ids(still));
  }
  if (!why.first_out || !facts.decision.next_check) return {};
  return "; a take may be " + words(*facts.decision.next_check) + " long, then " +
         facts.cameras[*why.first_out].id + " may have drifted out";
}

std::string verdict_words(const Facts& facts) {
  const int rounds = facts.decision.reason.rounds;
  std::string text = cause_words(facts) + and_then(facts);
  if (rounds == 0) return text;
  return "not aligned after " + plural(static_cast<std::size_t>(rounds), "round") + ": " + text;
}

/// The one thing to do next, by what ended the run.
std::string remedy_words(const Facts& facts) {
  const AlignReason& why = facts.decision.reason;
  switch (why.cause) {
    case AlignCause::untrimmable:
      return "Ask for the timed policy";
    case AlignCause::untellable:
      return "Ask for a wider tolerance, or let the flash be about a row long";
    case AlignCause::too_costly:
      return facts.decision.offers.empty() ? "Allow more resets or time"
                                           : "Ask for a tolerance that can be met: the reason lists them";
    case AlignCause::stuck:
      return "Make that camera the reference, or ask for a wider tolerance";
    case AlignCause::unmoved:
      if (why.unmoved.empty())
        return "Ask for a finer tolerance, or give the cameras named more of the flash";
      return "Check the view that the cameras named have of the lamp, then align again";
    case AlignCause::unseen:
    case AlignCause::looks_again:
    case AlignCause::waits_for_away:
      return "Check the cameras named and the lamp, then align again";
    default:
      return "Check the cameras that are out of tolerance, or ask for a wider one";
  }
}

}  // namespace

std::string words(Seconds time) {
  const double s = time.value();
  if (s < 100) return fmt::format("{:.{}f} s", s, s < 10 ? 1 : 0);
  if (s < 6000) return fmt::format("{:.1f} min", s / 60);
  return fmt::format("{:.1f} h", s / 3600);
}

AlignWords words(const AlignDecision& decision, const AlignRound& round,
                 const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  const Facts facts{decision, round, cameras, options};
  AlignWords all;
  all.reason = verdict_words(facts);
  if (decision.verdict == AlignVerdict::refused || decision.verdict == AlignVerdict::given_up)
    all.remedy = remedy_words(facts);
  for (std::size_t i = 0; i < decision.cameras.size(); ++i) all.cameras.push_back(camera_words(facts, i));
  all.dial = dial_words(decision, cameras, options);
  return all;
}

std::string_view name(AlignVerdict verdict) { return kVerdictNames.second_of(verdict).value_or("unknown"); }

}  // namespace emberlock::smear
