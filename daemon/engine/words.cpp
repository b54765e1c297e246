// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/words.h"

#include <utility>
#include <variant>

#include <fmt/format.h>

#include "smear_sync/align/align_words.h"

namespace emberlock::daemon {
namespace {

constexpr const char* kFreeSpace = "Free space, or record to another disk";

std::string or_else(const std::string& said, const char* usual) { return said.empty() ? usual : said; }

std::string sentence(Why why) {
  switch (why) {
    case Why::nothing_asked:
      return "nothing is asked for";
    case Why::measuring_row_time:
      return "measuring the cameras' row time";
    case Why::filming_strobe:
      return "filming the strobe";
    case Why::stopped:
      return "stopped by the operator";
    case Why::cancelled:
      return "cancelled";
    case Why::devices_back:
      return "all devices are there again: aligning anew";
    case Why::checking_lock:
      return "checking the lock after the recording";
    case Why::renewing_lock:
      return "renewing the lock";
    case Why::replay_over:
      return "the recording that is replayed has ended";
    case Why::shutting_down:
      return "emberlockd is shutting down";
    case Why::camera_away:
      return "waiting for a camera that went away";
    case Why::strobe_away:
      return "waiting for the strobe";
    case Why::camera_was_away:
      return "a camera went away meanwhile";
    case Why::phase_unknown:
      return "a camera went away: its shutter's phase is unknown";
    case Why::may_have_drifted:
      return "a camera may have drifted out of tolerance while this was recorded";
    case Why::camera_lost:
      return "the camera went away";
    case Why::camera_hangs:
      return "the camera doesn't answer any more";
    case Why::no_camera_left:
      return "no camera is left";
    case Why::leader_gone:
      return "nothing is heard of the host that leads";
  }
  return {};
}

const char* silence(v1::CameraStatus::State state) {
  switch (state) {
    case v1::CameraStatus::LOST:
      return "went away";
    case v1::CameraStatus::QUARANTINED:
      return "doesn't answer";
    case v1::CameraStatus::ENDED:
      return "has replayed its recording to the end";
    default:
      return "was stopped";
  }
}

/// ": left went away"; nothing where some film.
std::string and_why(const std::vector<SilentCamera>& cameras) {
  return cameras.empty() ? "" : ": " + words(cameras);
}

const char* overloaded(Bottleneck what) {
  switch (what) {
    case Bottleneck::processor:
      return "the processor can't keep up with the cameras";
    case Bottleneck::disk:
      return "the disk can't keep up with the cameras";
    case Bottleneck::bus:
      return "the bus or network between cameras and computer can't keep up";
  }
  return "";
}

const char* relief(Bottleneck what) {
  switch (what) {
    case Bottleneck::processor:
      return "End other programs, record raw (encoding in [recording]), or film with fewer or smaller "
             "pictures; "
             "the cameras are well";
    case Bottleneck::disk:
      return "Record to a faster disk, compressed (encoding in [recording]), or film with fewer or smaller "
             "pictures; the cameras are well";
    case Bottleneck::bus:
      return "Spread the cameras over more USB controllers or network ports, or film with fewer or smaller "
             "pictures; see to cables and switches";
  }
  return "";
}

std::string words_of_refusal(const DiskRefused& refused) {
  return refused.error.what + (refused.retried ? "; writing is tried again every second" : "");
}

struct ReasonSentence {
  std::string operator()(Why why) const { return sentence(why); }
  std::string operator()(const Error& error) const { return error.message(); }
  std::string operator()(const RecordingOf& it) const { return "recording " + it.session; }
  std::string operator()(const ReconstructionOf& it) const { return it.session + " is being reconstructed"; }
  std::string operator()(const AlignmentSays& it) const { return it.text; }
  std::string operator()(const TimeOver& it) const {
    return fmt::format("{:g} s are over", it.length.value());
  }
  std::string operator()(const NoFrames& it) const {
    return fmt::format("no frame has come from any camera for {:.0f} s{}", it.silence.value(),
                       and_why(it.cameras));
  }
  std::string operator()(const DiskRefused& it) const { return "the disk refused: " + words_of_refusal(it); }
  std::string operator()(const Outcome& it) const {
    if (it.code != Outcome::Code::nothing) return it.verdict;
    return "not one frame came from any camera" + and_why(it.cameras);
  }
  std::string operator()(const ClockMoved& it) const {
    return fmt::format("the wall clock was moved by {:+.1f} s", it.by.value());
  }
  std::string operator()(const RoomLeft& it) const {
    return fmt::format("the disk has room for {:.1f} minutes", it.time.value() / 60);
  }
  std::string operator()(const Overload& it) const {
    if (it.lost == 0) return overloaded(it.what);
    return fmt::format("{}: {} of {} frames were lost within {:.0f} s", overloaded(it.what), it.lost, it.made,
                       it.span.value());
  }
  std::string operator()(const ReconstructionDone& it) const { return "done: the result is in " + it.result; }
  std::string operator()(const ReconstructionFailed& it) const { return it.text; }
  std::string operator()(const HostPartIs& it) const {
    const std::string part = "the part of host " + it.part.host();
    if (it.part.state() == v1::HostPart::MISSING) return part + " is missing: " + it.part.why();
    if (it.part.state() == v1::HostPart::SHORT) return part + " isn't whole: " + it.part.why();
    return it.part.state() == v1::HostPart::WHOLE
               ? fmt::format("{} is whole: {} frames there, {} lost", part, it.part.frames(), it.part.lost())
               : part + " is being recorded";
  }
};

std::string remedy_of_lost_lock(const Reason& reason) {
  const Why* why = std::get_if<Why>(&reason);
  if (why == nullptr) return "Wait: the cameras are being aligned again";
  if (*why == Why::phase_unknown || *why == Why::may_have_drifted)
    return "Stop the recording to check the cameras";
  return "It is locked again by itself once the device is back";
}

/// What whoever refused says.
std::string own_remedy(const Reason& reason) {
  if (const auto* refused = std::get_if<DiskRefused>(&reason)) return refused->error.remedy;
  if (const auto* alignment = std::get_if<AlignmentSays>(&reason)) return alignment->remedy;
  const Error* error = std::get_if<Error>(&reason);
  return error == nullptr ? "" : error->remedy;
}

std::string with_subject(const std::string& subject, const std::string& text) {
  return subject.empty() ? text : subject + ": " + text;
}

struct RefusalWords {
  std::string what;
  std::string remedy;
};

std::string lasting(Seconds time) { return smear::words(time); }

RefusalWords too_long(const TakeLength& take) {
  const Seconds sure = take.sure.value_or(Seconds(0));
  if (sure <= Seconds(0)) return {"the lock is being checked", "ask again in a second or two"};
  const std::string what =
      fmt::format("the lock surely holds for {}, and {} are asked for", lasting(sure), lasting(take.asked));
  if (take.renewed && *take.renewed >= take.asked)
    return {what, fmt::format("renew the lock first, which then holds for about {}, or ask for an unlocked "
                              "recording",
                              lasting(*take.renewed))};
  if (take.renewed && *take.renewed > sure)
    return {what,
            fmt::format("renew the lock first and record {} at most, allow a wider tolerance, or ask for "
                        "an unlocked recording",
                        lasting(*take.renewed))};
  return {what,
          "wait until drifts are known better, allow a wider tolerance, or ask for an unlocked recording"};
}

RefusalWords refusal_words(const MachineRefusal& refusal) {
  using Code = MachineRefusal::Code;
  switch (refusal.code) {
    case Code::recording_runs:
      return {"a recording runs", "stop it first"};
    case Code::is_recorded:
      return {refusal.session + " is being recorded", "stop it first"};
    case Code::renewing_lock:
      return {"cameras are being reset before they leave tolerance", "ask again in a second or two"};
    case Code::aligning:
      return {"the cameras are being aligned", "wait until they are locked, or stop that"};
    case Code::not_locked:
      return {"the cameras aren't locked", "align them, or ask for an unlocked recording"};
    case Code::nothing_recorded:
      return {"nothing is being recorded", "begin a recording first"};
    case Code::is_reconstructed:
      return {words(ReconstructionOf{refusal.session}), "wait for it, or cancel it"};
    case Code::nothing_reconstructed:
      return {"nothing is being reconstructed", "start one first"};
    case Code::no_such_fault:
      return {fmt::format("there is no fault {}", refusal.fault), "list them with `emberlock status`"};
    case Code::take_too_long:
      return too_long(refusal.take);
  }
  return {};
}

}  // namespace

std::string words(const Reason& reason) { return std::visit(ReasonSentence{}, reason); }

std::string words(const std::vector<SilentCamera>& cameras) {
  std::string text;
  for (const SilentCamera& camera : cameras)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", camera.id, silence(camera.state));
  return text;
}

std::string words(const Remark& remark) {
  using Code = Remark::Code;
  const std::string& subject = remark.subject;
  const std::string why = words(remark.reason);
  switch (remark.code) {
    case Code::recording:
      return "recording " + subject;
    case Code::recording_ends:
      return fmt::format("recording {} ends: {}", subject, why);
    case Code::recorded:
    case Code::not_salvaged:
      return with_subject(subject, why);
    case Code::not_handed_on:
      return fmt::format("{} {} not handed on, as {}. Start it later: emberlock reconstruct \"{}\" --daemon",
                         subject, std::holds_alternative<Why>(remark.reason) ? "is" : "was", why, subject);
    case Code::replay_over:
      return subject + ": the recording that it replays is over";
    case Code::flashes_show:
      return "The strobe is set by hand: switch it off while the flame is recorded, or its flashes are too.";
    case Code::locked:
      return "Locked: " + why;
    case Code::aligning_in_time:
      return "Aligning anew before the lock is lost: " + why;
    case Code::reconstructing:
      return "reconstructing " + subject;
    case Code::reconstruction_ended: {
      const Error* error = std::get_if<Error>(&remark.reason);
      return fmt::format("reconstruction of {}: {}", subject, error == nullptr ? why : error->what);
    }
    case Code::not_compressed:
      return subject + " stays uncompressed: " + why;
    case Code::compressed:
      return subject + ": compressed and verified";
    case Code::fault:
      return with_subject(subject, words(remark.kind, remark.reason));
    case Code::fault_over:
      return "Over: " + with_subject(subject, words(remark.kind, remark.reason));
  }
  return {};
}

Error words(const MachineRefusal& refusal) {
  RefusalWords said = refusal_words(refusal);
  return {ErrorKind::refused, std::move(said.what), "emberlockd", said.remedy};
}

std::string words(v1::Fault::Kind kind, const Reason& reason) {
  if (const auto* refused = std::get_if<DiskRefused>(&reason)) return words_of_refusal(*refused);
  const Error* error = std::get_if<Error>(&reason);
  if (error == nullptr) return words(reason);
  switch (kind) {  // whom it concerns is told beside it
    case v1::Fault::STROBE_SILENT:
    case v1::Fault::DISK_FAILED:
    case v1::Fault::RECONSTRUCTION_FAILED:
      return error->what;
    case v1::Fault::SALVAGE_FAILED:
      return "it wasn't finished, and can't be salvaged: " + error->message();
    default:
      return error->message();
  }
}

std::string remedy(v1::Fault::Kind kind, const Reason& reason) {
  std::string own = own_remedy(reason);
  switch (kind) {
    case v1::Fault::CAMERA_LOST:
      if (std::holds_alternative<Error>(reason))  // it is there, and refuses
        return or_else(own, "It is taken up by itself once it is free");
      return "See to its cable and its power: it is taken up again by itself";
    case v1::Fault::CAMERA_HANGS:
      return "Unplug it and plug it in again; if that doesn't help, restart emberlockd";
    case v1::Fault::ALL_CAMERAS_LOST:
      return "See to the hub, the switch or the power that they share";
    case v1::Fault::STROBE_SILENT:
      return or_else(own, "See to its power and its cable: it is asked again every second");
    case v1::Fault::NOT_ALIGNED:
      return or_else(own, "Check the cameras named, then align again");
    case v1::Fault::LOCK_LOST:
      return remedy_of_lost_lock(reason);
    case v1::Fault::FRAMES_LOST:
      return "The recording is whole but for these. See which cause, and whether it comes again";
    case v1::Fault::COUNTS_MISMATCH:
      return "What was written is kept. Verify the session, then repair it";
    case v1::Fault::DISK_LOW:
      return std::holds_alternative<Error>(reason) ? or_else(own, kFreeSpace) : kFreeSpace;
    case v1::Fault::DISK_FAILED:
      return or_else(own, "What was written until then is kept");
    case v1::Fault::CLOCK_STEPPED:
      return "See to what sets it (timedatectl). No frame is lost or misplaced: they are ordered "
             "by a clock that can't be moved; the times of day in a recording that runs are off by that "
             "from here on";
    case v1::Fault::TRANSCODE_FAILED:
      return "The recording stays as it was written, uncompressed";
    case v1::Fault::RECONSTRUCTION_FAILED:
      return or_else(own, "The recording is unharmed. Try again, or with --device cpu or cuda");
    case v1::Fault::SALVAGE_FAILED:
      return or_else(own, "What was written is kept. `emberlock sessions repair` tries again");
    case v1::Fault::OVERLOADED: {
      const auto* overload = std::get_if<Overload>(&reason);
      return relief(overload == nullptr ? Bottleneck::processor : overload->what);
    }
    case v1::Fault::PART_WANTING: {
      const auto* is = std::get_if<HostPartIs>(&reason);
      return is != nullptr && is->part.state() == v1::HostPart::SHORT
                 ? "What was recorded there is kept: see to that host before the next take"
                 : "See to that host and to the network: it records on by itself, and is asked until its "
                   "part is "
                   "known";
    }
    case v1::Fault::NOTHING_RECORDED:
      return "See to the cameras, and record again once `emberlock status` says that they film";
    default:
      return {};
  }
}

std::string remedy(const Fault& fault) {
  return with_subject(fault.key.subject, remedy(fault.key.kind, fault.reason));
}

v1::Fault to_proto(const Fault& fault) {
  v1::Fault shown;
  shown.set_id(fault.id);
  shown.set_kind(fault.key.kind);
  shown.set_light(fault.light);
  shown.set_subject(fault.key.subject);
  shown.set_what(words(fault.key.kind, fault.reason));
  shown.set_remedy(remedy(fault.key.kind, fault.reason));
  shown.set_since_utc(fault.since_utc);
  shown.set_over(fault.over);
  return shown;
}

std::string words(NextStep step, const std::string& camera) {
  switch (step) {
    case NextStep::align:
      return "Align the cameras";
    case NextStep::record:
      return "Record";
    case NextStep::stop_recording:
      return "Stop the recording when the flame is over";
    case NextStep::press_shutter:
      return "Press the shutter of " + camera;
  }
  return {};
}

std::string words(NextStep step, const LockLeft& left) {
  std::string text = words(step);
  if (!left.sure) return text;
  if (step == NextStep::record && *left.sure <= Seconds(0)) return "Wait: the lock is being checked";
  if (step == NextStep::stop_recording) {
    return *left.sure > Seconds(0) ? text + fmt::format(", within {}: then {} may leave tolerance",
                                                        lasting(*left.sure), left.leaves_first)
                                   : text + fmt::format(": {} may have left tolerance", left.leaves_first);
  }
  text += fmt::format(": a take may be {} long", lasting(*left.sure));
  if (left.likely && *left.likely > 1.1 * *left.sure)
    text += fmt::format(", most likely {}", lasting(*left.likely));
  return text + fmt::format(", then {} leaves tolerance", left.leaves_first);
}

std::string words(const FramesMissed& missed) {
  return fmt::format("{} frame{} lost within {:.0f} s", missed.lost, missed.lost == 1 ? " was" : "s were",
                     missed.span.value());
}

std::string words(const RateOff& rate) {
  return fmt::format("{:.1f} frames a second come, {:.1f} are asked for", rate.comes.value(),
                     rate.asked.value());
}

std::string words(v1::CameraStatus::State state) {
  switch (state) {
    case v1::CameraStatus::LOST:
      return "went away, is being looked for";
    case v1::CameraStatus::QUARANTINED:
      return "doesn't answer";
    case v1::CameraStatus::ENDED:
      return "the recording that it replays is over; restart emberlockd to begin it anew";
    default:
      return "films";
  }
}

std::string words(const StrobeDial& dial, std::optional<Hertz> rate) {
  if (!rate) return "is set by hand; the alignment says what to set";
  return fmt::format("is set by hand: set it to {} flashes a minute ({:.3f} Hz)", dial.per_minute(*rate),
                     rate->value());
}

std::string words(const std::string& session, const v1::SalvageReport& report) {
  std::uint64_t kept = 0;
  std::uint64_t gone = 0;
  for (const v1::SalvageReport::Camera& camera : report.cameras()) {
    kept += camera.kept();
    gone += camera.lost();
  }
  return fmt::format(
      "{} was not finished. It has been salvaged: {} frames of {} cameras are kept; the pixels of {} more "
      "never reached the disk",
      session, kept, report.cameras_size(), gone);
}

}  // namespace emberlock::daemon
