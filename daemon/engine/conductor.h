// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/board.h"
#include "daemon/engine/device_watch.h"
#include "daemon/engine/machine.h"
#include "daemon/engine/overload_watch.h"
#include "daemon/engine/recorder.h"
#include "daemon/engine/words.h"
#include "daemon/hosts/host_parts.h"
#include "daemon/hosts/loan.h"
#include "daemon/live/live_volumes.h"
#include "daemon/reconstruction/child.h"
#include "daemon/work/jobs.h"
#include "daemon/work/upkeep.h"
#include "rig/align/alignment.h"
#include "rig/config/config.h"
#include "rig/devices/geometry.h"
#include "rig/devices/rig.h"
#include "session/store.h"

namespace emberlock::daemon {

/// What a conductor works with; all of it outlives it.
struct ConductorParts {
  rig::Rig& rig;
  const rig::Geometry& geometry;
  const rig::DaemonConfig& config;
  session::SessionStore& store;
  ReconstructionChild& reconstruction;
  LiveVolumes& live;
  Loan& loan;        ///< of the cameras to another host
  HostParts& hosts;  ///< whose cameras are in the rig
  Jobs& jobs;        ///< those in the background stand still while something is recorded
  Board& board;
  UpkeepTold told = {};  ///< what became of a session in the background
};

/// Carries out what the machine orders, with the rig's devices: it aligns, holds the lock, records. One
/// thread; engine.h has one for it, a test on a virtual clock steps it by itself.
class Conductor {
 public:
  /// Starts the cameras, each of which may take seconds, unless `ending` says that nobody needs them any
  /// more. `stop` ends a round of alignment early: somebody asked for something else.
  explicit Conductor(const ConductorParts& parts, rig::StopAsked stop = {},
                     const rig::StopAsked& ending = {});
  Conductor(const Conductor&) = delete;
  Conductor& operator=(const Conductor&) = delete;
  ~Conductor();

  // What clients ask for (api.h).
  Status align(const v1::AlignRequest& request);
  Status stop_sync();
  Status record(const v1::RecordRequest& request);
  Status stop_recording();
  Status reconstruct(const v1::ReconstructRequest& request);
  Status cancel_reconstruction();
  Status acknowledge(const v1::AcknowledgeRequest& request);
  using StrobeAnswer = std::function<void(Result<v1::StrobeState>)>;
  /// The strobe may take seconds: `answer` is called by work() then, or at once. It isn't if the conductor
  /// ends before.
  void read_strobe(StrobeAnswer answer);
  void apply_strobe(const v1::StrobeState& wanted, StrobeAnswer answer);

  // What a leading host asks for (hosts.proto).
  Result<v1::LentCameras> lend(const Borrower& leader);
  Result<std::size_t> lent_camera(const Borrower& leader, const std::string& camera_id);
  Status reset_lent(const Borrower& leader, const v1::ResetRequest& request);
  Status trim_lent(const Borrower& leader, const v1::TrimRequest& request);
  Result<v1::HostPart> record_part(const Borrower& leader, const v1::PartRequest& request);
  Status stop_part(const Borrower& leader, const v1::StopPartRequest& request);
  /// Returns the part of this session that is being recorded for the leader, if one is. Counts as a
  /// heartbeat.
  Result<std::optional<v1::HostPart>> find_running_part(const Borrower& leader,
                                                        const std::string& session_id);

  // What became of a session in the background.
  void transcoded(const std::string& session, const JobResult& result);
  void salvaged(const std::string& session, const JobResult& result);

  /// It shall end: a recording that runs is finished, for which work() goes on to be called, until is_done().
  void end();
  [[nodiscard]] bool is_done() const { return !recorder_; }

  /// One slice of what the phase has to do: a round of filming, or the frames that have come. Returns after
  /// that; idle it has nothing to wait for.
  void work();

  /// Whether there is nothing to do until frames come, or somebody asks for something.
  [[nodiscard]] bool waits() const;
  [[nodiscard]] v1::Phase phase() const { return state_.phase; }
  [[nodiscard]] v1::DaemonStatus status() const;

 private:
  /// What the strobe was asked for, and its settings after that once it has answered.
  struct StrobeCall {
    std::future<Result<drivers::StrobeSettings>> settings;
    bool applies = false;
    StrobeAnswer answer;
  };

  Status happen(const MachineEvent& event);
  [[nodiscard]] Status check_strobe() const;
  void call_strobe(std::optional<drivers::StrobeSettings> wanted, StrobeAnswer answer);
  void take_strobe_answers();
  /// Waits until no call of the strobe is pending.
  void await_strobe();
  /// Stores the settings or the error that a call returned, and raises or clears the strobe's fault.
  Result<v1::StrobeState> update_strobe_state(const Result<drivers::StrobeSettings>& settings);
  Status renew(const v1::AlignRequest& request);
  /// How long a take may be that begins now.
  [[nodiscard]] TakeLength take_length(Seconds asked) const;
  [[nodiscard]] LockLeft lock_left() const;
  /// The strobe flashes during what is recorded: that is what the recording is of.
  [[nodiscard]] bool records_strobe() const { return record_request_.purpose() == "alignment"; }
  Status light_strobe();
  void darken_strobe();
  void darken_after_recording();
  void note(const Remark& remark);
  [[nodiscard]] TimePoint find_dark_instant(TimePoint now);
  void record_opening_events(TimePoint now, const std::optional<v1::DecisionEvent>& lock);
  void carry_out(Action action);
  void begin_alignment();
  void end_alignment();
  void begin_recording();
  Status begin_take(const v1::RecordRequest& request, const std::filesystem::path& folder);
  /// Of this host's recording: what it is of, whose it is, the evidence of the lock.
  [[nodiscard]] v1::Manifest describe_take() const;
  [[nodiscard]] std::optional<v1::DecisionEvent> lock_evidence() const;
  [[nodiscard]] std::optional<v1::DecisionEvent> lock_of_part() const;
  /// What each other host is asked for: leaves in the manifest this host's cameras, and names the others'
  /// parts.
  [[nodiscard]] std::vector<v1::PartRequest> part_requests(
      v1::Manifest& manifest, const std::optional<v1::DecisionEvent>& lock) const;
  void watch_hosts();
  [[nodiscard]] Status check_not_lent() const;
  /// The cameras are the leader's from now on, if they are free or its own.
  Status take_loan(const Borrower& leader);
  /// Another host's name for a session may be taken here.
  [[nodiscard]] Result<std::filesystem::path> path_for_part(const std::string& name) const;
  /// A part that is being recorded.
  [[nodiscard]] v1::HostPart running_part() const;
  [[nodiscard]] bool records_for_another() const { return part_ && recorder_; }
  void describe_hosts(v1::DaemonStatus& status) const;
  void feed_recorder();
  std::vector<drivers::FrameCounts> stop_feeding();
  void begin_finishing();
  void finish_recording();
  void conclude_recording(v1::RecordingStatus status);
  void begin_reconstruction();
  void measure_row_time();
  void film_round();
  void hold();
  void capture();
  void end_recording();
  /// Whether live volumes can be made of what is recorded.
  [[nodiscard]] Status check_live(const v1::LiveRequest& request) const;
  /// Tells them how far the recording is.
  void feed_live();
  [[nodiscard]] bool all_have_come() const;
  void drain();
  void note_trouble(std::size_t camera, const Error& error);
  /// All, where none films; empty where one does.
  [[nodiscard]] std::vector<SilentCamera> silent_cameras() const;
  [[nodiscard]] Seconds longest_silence() const;
  void watch_devices();
  void watch_disk();
  /// Reports what the disk refuses of the recording. Whether it goes on, so that the recording ends.
  bool watch_refusals();
  void watch_load(TimePoint now);
  /// What the room of simulated cameras shows now.
  void set_scene();
  void watch_reconstruction();
  void break_alignment(Why why);
  /// Why alignment failed: a device that is gone, else itself.
  void explain_failure(const Error& error);
  [[nodiscard]] std::vector<drivers::FrameCounts> counts() const;
  /// Of this host's cameras alone.
  [[nodiscard]] std::vector<drivers::FrameCounts> own_counts() const;
  [[nodiscard]] std::vector<v1::CameraStatus::State> camera_states() const;
  /// By camera: why it refuses to film, where something else has it.
  [[nodiscard]] std::vector<std::optional<Error>> camera_refusals() const;
  void remember(const rig::AlignRoundReport& round);
  /// Of the alignment's last round.
  [[nodiscard]] v1::AlignmentStatus::Verdict verdict() const;
  void describe_cameras(v1::DaemonStatus& status) const;
  void describe_frames(v1::CameraStatus& camera) const;
  void describe_alignment(v1::AlignmentStatus& status) const;

  [[nodiscard]] bool real_time() const { return parts_.rig.pace() == rig::Rig::Pace::real_time; }

  ConductorParts parts_;
  rig::AlignRig devices_;
  rig::StopAsked stop_;
  MachineState state_;
  DeviceWatch watch_;
  OverloadWatch overload_;
  TimePoint aligned_at_;  ///< when cameras were last being aligned: resets make rates uneven

  rig::AlignRunOptions align_options_;
  smear::FlameMotion flame_;  ///< as it was told last
  bool tolerance_told_ = false;
  std::unique_ptr<rig::Alignment> alignment_;
  TimePoint align_began_;
  std::deque<v1::RoundPoint> history_;
  std::optional<smear::AlignEffort> foretold_;
  bool check_now_ = false;
  bool expired_ = false;  ///< the lock's end has been told
  bool phase_lost_ =
      false;  ///< a camera went away while it was recorded: what is known of its shutter is void

  std::shared_ptr<Recorder> recorder_;  ///< the cameras' sinks hold it too
  /// The job that finishes recorder_: a slow disk takes minutes. While it runs recorder_ is the job's.
  std::shared_ptr<JobHandle> finishing_;
  std::shared_ptr<v1::RecordingStatus> finished_;  ///< what it brings
  v1::RecordRequest record_request_;
  std::optional<v1::PartRequest> part_;  ///< the recording is for another host
  std::optional<TimePoint> part_ends_;   ///< as that one said
  TimePoint part_heard_;                 ///< when that one last spoke of it
  bool lit_for_recording_ = false;       ///< the strobe flashes for the recording alone
  bool disk_refuses_ = false;            ///< what is recorded, for the moment
  Status begun_;                         ///< how the recording asked for last began
  std::filesystem::path record_folder_;
  std::optional<v1::RecordingStatus> recording_;  ///< the last that ended
  TimePoint record_began_;
  TimePoint record_ended_;
  std::optional<Seconds> spread_;  ///< between two cameras when it began, as the lock knew it
  std::vector<drivers::FrameCounts> counted_before_;  ///< the recording, by camera
  std::optional<TimePoint> live_fed_;
  std::vector<bool> ended_;                                  ///< recordings that are replayed have ends
  std::vector<std::optional<std::uint64_t>> trouble_noted_;  ///< by camera: after so many frames
  v1::ReconstructRequest reconstruct_request_;
  drivers::StrobeSettings strobe_settings_;
  Status strobe_status_;  ///< of its last answer
  std::optional<TimePoint> strobe_asked_;
  std::deque<StrobeCall> strobe_calls_;  ///< unanswered
  v1::StorageStatus storage_;
  std::optional<TimePoint> disk_looked_;
  TimePoint began_;
};

}  // namespace emberlock::daemon
