// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string_view>
#include <thread>

#include "base/result.h"
#include "daemon/api.h"
#include "daemon/ar/live_ar.h"
#include "daemon/engine/conductor.h"
#include "daemon/hosts/host_parts.h"
#include "daemon/hosts/lending_server.h"
#include "daemon/hosts/loan.h"
#include "daemon/work/jobs.h"
#include "daemon/work/upkeep.h"

namespace emberlock::daemon {

/// The daemon behind its servers: a conductor on a thread of its own, which alone touches the devices, and
/// what clients ask of it. Any thread may call the Api, and what a host that leads may ask.
class Engine final : public Api, public Lender {
 public:
  /// Sees every frame that no flame is put into, by its camera's id, on that camera's thread: it must return
  /// at once.
  using OnFrame = std::function<void(const std::string& camera_id, const Frame& frame)>;

  /// Opens the sessions' folder and the rig, which takes no second. What a killed recorder left is salvaged
  /// and, where that is configured, what is uncompressed is compressed, both in the background. Devices that
  /// aren't there don't keep it from starting. `board` outlives it. Errors: bad_input and io.
  static Result<std::unique_ptr<Engine>> start(const rig::DaemonConfig& config, Board& board,
                                               OnFrame on_frame = {}, rig::RigOptions rig_options = {});
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Whether the thread went round lately, every camera either films, or is known not to, and no job hangs
  /// that isn't tolerated (jobs.h): what the watchdog asks.
  [[nodiscard]] bool alive() const;

  /// It shall end. Returns at once: a recording that runs is finished first, as its frames wait in memory;
  /// all other jobs are cancelled. From now on whatever is asked is refused.
  void end();
  /// Whether it has, waiting so long for it at most.
  [[nodiscard]] bool ended(Seconds wait);
  /// The job that finishes a recording, while it runs.
  [[nodiscard]] std::optional<v1::Job> finishing() const;

  [[nodiscard]] Board& board() override { return board_; }
  Status acknowledge(const v1::AcknowledgeRequest& request) override;
  Result<v1::ListDevicesResponse> list_devices() override;
  Result<v1::StrobeState> strobe() override;
  Result<v1::StrobeState> apply_strobe(const v1::StrobeState& wanted) override;
  Status align(const v1::AlignRequest& request) override;
  Status stop_sync() override;
  Result<v1::RecordingStatus> record(const v1::RecordRequest& request) override;
  Result<v1::RecordingStatus> stop_recording() override;
  Result<v1::ListSessionsResponse> list_sessions() override;
  Result<v1::Manifest> session(const v1::SessionRequest& request) override;
  Result<std::shared_ptr<JobHandle>> verify_session(const v1::SessionRequest& request) override;
  Result<std::shared_ptr<JobHandle>> repair_session(const v1::SessionRequest& request) override;
  Result<std::shared_ptr<JobHandle>> export_session(const v1::ExportRequest& request) override;
  /// Where a session's exported videos lie, if it was exported. Any thread. Error bad_input: an invalid name,
  /// or a symbolic link in the path.
  [[nodiscard]] Result<std::filesystem::path> video_folder(std::string_view session) const;
  Status cancel_job(const v1::CancelJobRequest& request) override;
  Result<v1::ReconstructionStatus> reconstruct(const v1::ReconstructRequest& request) override;
  Result<v1::ReconstructionStatus> cancel_reconstruction() override;
  Result<v1::StylizationStatus> edit_reconstruction(const v1::EditRequest& request) override;
  Result<v1::ReconstructionStatus> finish_reconstruction() override;
  std::shared_ptr<const v1::IterationPreview> reconstructed_frame(const v1::FrameRequest& request) override;
  Result<v1::ListResultsResponse> list_results() override { return ar_->results(); }
  Result<v1::ArStatus> start_ar(const v1::ArRequest& request) override;
  Result<v1::ArStatus> stop_ar() override { return ar_->stop(); }

  Result<v1::LentCameras> lend(const Borrower& leader) override;
  Status hear(const Borrower& leader) override;
  Result<std::shared_ptr<LentFrames>> watch(const Borrower& leader,
                                            const v1::FramesRequest& request) override;
  Status reset(const Borrower& leader, const v1::ResetRequest& request) override;
  Status trim(const Borrower& leader, const v1::TrimRequest& request) override;
  Result<v1::HostPart> record_part(const Borrower& leader, const v1::PartRequest& request) override;
  Status stop_part(const Borrower& leader, const v1::StopPartRequest& request) override;
  Result<v1::HostPart> part(const Borrower& leader, const v1::FindPartRequest& request) override;

 private:
  enum class Urgency {
    waits,       ///< until the round that is filmed is over
    interrupts,  ///< it ends the round
  };

  Engine(const rig::DaemonConfig& config, Board& board, session::SessionStore store,
         std::unique_ptr<rig::Rig> rig, rig::Geometry geometry, std::shared_ptr<LiveAr> ar,
         HostParts::Hosts hosts);
  void take_up_work();
  [[nodiscard]] UpkeepTold told();
  /// Refused while it is salvaged.
  Result<std::filesystem::path> path_of(const std::string& session) const;
  void run();
  void show(const Conductor& conductor);
  void refuse_calls();
  /// On the thread: a camera's layout changes as it comes back.
  Result<ArCamera> find_ar_camera(const std::string& id);
  void post(std::function<void(Conductor&)> call);
  /// Has it done on the thread, and waits for that.
  template <class Answer>
  Answer on_thread(Urgency urgency, std::function<Answer(Conductor&)> call);
  /// Has it begun on the thread, and waits until it calls `done`, on the thread too.
  template <class Answer>
  Answer await_answer(Urgency urgency,
                      std::function<void(Conductor&, std::function<void(Answer)> done)> begin);

  const rig::DaemonConfig config_;
  Board& board_;
  session::SessionStore store_;
  std::unique_ptr<rig::Rig> rig_;
  rig::Geometry geometry_;
  Loan loan_;
  HostParts hosts_;
  ReconstructionChild reconstruction_;
  LiveVolumes live_;
  std::shared_ptr<LiveAr> ar_;  ///< the cameras' threads have it too

  std::mutex mutex_;
  std::condition_variable asked_;
  std::condition_variable shown_;  ///< a status was published
  std::deque<std::function<void(Conductor&)>> calls_;
  std::atomic<int> urgent_ = 0;
  std::atomic<bool> ending_ = false;
  bool refuses_ = false;  ///< what is asked, as it is ending
  bool over_ = false;     ///< the thread has nothing more to do
  std::atomic<v1::Phase> phase_ = v1::PHASE_UNSPECIFIED;
  std::atomic<std::int64_t> went_round_ns_ = 0;

  struct CameraProgress {
    std::uint64_t frames = 0;
    TimePoint at;
  };
  mutable std::mutex progress_mutex_;
  mutable std::vector<CameraProgress> progress_;  ///< by camera, as alive() saw it
  Jobs jobs_;
  std::thread thread_;  ///< last: it uses all of the above
};

template <class Answer>
Answer Engine::await_answer(Urgency urgency,
                            std::function<void(Conductor&, std::function<void(Answer)> done)> begin) {
  auto promise = std::make_shared<std::promise<Answer>>();
  std::future<Answer> answer = promise->get_future();
  const bool urgent = urgency == Urgency::interrupts;
  if (urgent) ++urgent_;
  post([this, urgent, promise = std::move(promise), begin = std::move(begin)](Conductor& conductor) {
    if (urgent) --urgent_;
    begin(conductor, [this, promise, &conductor](Answer made) {
      show(conductor);  // the status holds the result before the caller has its answer
      promise->set_value(std::move(made));
    });
  });
  try {
    return answer.get();
  } catch (const std::future_error&) {
    return Error{ErrorKind::refused, "it is shutting down", "emberlockd", "Start it again"};
  }
}

template <class Answer>
Answer Engine::on_thread(Urgency urgency, std::function<Answer(Conductor&)> call) {
  return await_answer<Answer>(
      urgency, [call = std::move(call)](Conductor& conductor, const auto& done) { done(call(conductor)); });
}

}  // namespace emberlock::daemon
