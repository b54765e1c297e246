// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "daemon/api.h"
#include "daemon/work/jobs.h"

namespace emberlock::test {

/// A daemon without devices: it shows what a test puts on its board, remembers what it was asked, and answers
/// what the test says. Set the answers before the first call; calls come from any thread.
class FakeApi : public daemon::Api {
 public:
  daemon::Board& board() override { return board_; }

  Status acknowledge(const v1::AcknowledgeRequest& request) override {
    return ask("acknowledge", request, on_acknowledge);
  }
  Result<v1::ListDevicesResponse> list_devices() override { return ask("list_devices", on_list_devices); }
  Result<v1::StrobeState> strobe() override { return ask("strobe", on_strobe); }
  Result<v1::StrobeState> apply_strobe(const v1::StrobeState& wanted) override {
    return ask("apply_strobe", wanted, on_apply_strobe);
  }
  Status align(const v1::AlignRequest& request) override { return ask("align", request, on_align); }
  Status stop_sync() override { return ask("stop_sync", on_stop_sync); }
  Result<v1::RecordingStatus> record(const v1::RecordRequest& request) override {
    return ask("record", request, on_record);
  }
  Result<v1::RecordingStatus> stop_recording() override { return ask("stop_recording", on_stop_recording); }
  Result<v1::ListSessionsResponse> list_sessions() override { return ask("list_sessions", on_list_sessions); }
  Result<v1::Manifest> session(const v1::SessionRequest& request) override {
    return ask("session", request, on_session);
  }
  Result<std::shared_ptr<daemon::JobHandle>> verify_session(const v1::SessionRequest& request) override {
    return job("verify_session", v1::Job::VERIFY, request);
  }
  Result<std::shared_ptr<daemon::JobHandle>> repair_session(const v1::SessionRequest& request) override {
    return job("repair_session", v1::Job::REPAIR, request);
  }
  Result<std::shared_ptr<daemon::JobHandle>> export_session(const v1::ExportRequest& request) override {
    return job("export_session", v1::Job::EXPORT, request);
  }
  Status cancel_job(const v1::CancelJobRequest& request) override {
    remember("cancel_job " + request.ShortDebugString());
    return jobs_.cancel(request.id());
  }
  Result<v1::ReconstructionStatus> reconstruct(const v1::ReconstructRequest& request) override {
    return ask("reconstruct", request, on_reconstruct);
  }
  Result<v1::ReconstructionStatus> cancel_reconstruction() override {
    return ask("cancel_reconstruction", on_cancel_reconstruction);
  }
  Result<v1::StylizationStatus> edit_reconstruction(const v1::EditRequest& request) override {
    return ask("edit_reconstruction", request, on_edit_reconstruction);
  }
  Result<v1::ReconstructionStatus> finish_reconstruction() override {
    return ask("finish_reconstruction", on_finish_reconstruction);
  }
  std::shared_ptr<const v1::IterationPreview> reconstructed_frame(const v1::FrameRequest& request) override {
    remember("reconstructed_frame " + request.ShortDebugString());
    return on_reconstructed_frame ? on_reconstructed_frame(request) : nullptr;
  }
  Result<v1::ListResultsResponse> list_results() override { return ask("list_results", on_list_results); }
  Result<v1::ArStatus> start_ar(const v1::ArRequest& request) override {
    return ask("start_ar", request, on_start_ar);
  }
  Result<v1::ArStatus> stop_ar() override { return ask("stop_ar", on_stop_ar); }

  void show(v1::Phase phase) {
    v1::DaemonStatus status;
    status.set_phase(phase);
    board_.show(status);
  }

  /// Each call's name, with its request as one line: "align tolerance: \"100rows\"".
  [[nodiscard]] std::vector<std::string> calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

  /// Unset: success, or the empty message.
  std::function<Status(const v1::AcknowledgeRequest&)> on_acknowledge;
  std::function<Result<v1::ListDevicesResponse>()> on_list_devices;
  std::function<Result<v1::StrobeState>()> on_strobe;
  std::function<Result<v1::StrobeState>(const v1::StrobeState&)> on_apply_strobe;
  std::function<Status(const v1::AlignRequest&)> on_align;
  std::function<Status()> on_stop_sync;
  std::function<Result<v1::RecordingStatus>(const v1::RecordRequest&)> on_record;
  std::function<Result<v1::RecordingStatus>()> on_stop_recording;
  std::function<Result<v1::ListSessionsResponse>()> on_list_sessions;
  std::function<Result<v1::Manifest>(const v1::SessionRequest&)> on_session;
  std::function<Result<v1::ReconstructionStatus>(const v1::ReconstructRequest&)> on_reconstruct;
  std::function<Result<v1::ReconstructionStatus>()> on_cancel_reconstruction;
  std::function<Result<v1::StylizationStatus>(const v1::EditRequest&)> on_edit_reconstruction;
  std::function<Result<v1::ReconstructionStatus>()> on_finish_reconstruction;
  std::function<std::shared_ptr<const v1::IterationPreview>(const v1::FrameRequest&)> on_reconstructed_frame;
  std::function<Result<v1::ListResultsResponse>()> on_list_results;
  std::function<Result<v1::ArStatus>(const v1::ArRequest&)> on_start_ar;
  std::function<Result<v1::ArStatus>()> on_stop_ar;
  /// What verify, repair and export do; unset: they are done, and all is well.
  std::function<daemon::JobResult(const Observer&)> on_job;
  /// Why none of them can begin.
  std::optional<Error> on_begin;

  [[nodiscard]] const daemon::Jobs& jobs() const { return jobs_; }

 private:
  void remember(std::string call) {
    const std::lock_guard lock(mutex_);
    calls_.push_back(std::move(call));
  }
  template <class Answer>
  Answer ask(const char* name, const std::function<Answer()>& answer) {
    remember(name);
    return answer ? answer() : empty<Answer>();
  }
  template <class Request, class Answer>
  Answer ask(const std::string& name, const Request& request,
             const std::function<Answer(const Request&)>& answer) {
    const std::string line = request.ShortDebugString();
    remember(line.empty() ? name : name + " " + line);
    return answer ? answer(request) : empty<Answer>();
  }
  template <class Request>
  Result<std::shared_ptr<daemon::JobHandle>> job(const std::string& name, v1::Job::Kind kind,
                                                 const Request& request) {
    remember(name + " " + request.ShortDebugString());
    if (on_begin) return *on_begin;
    return jobs_.add({kind, request.session(), [this](const Observer& observer) -> daemon::JobResult {
                        if (on_job) return on_job(observer);
                        v1::JobOutcome well;
                        well.set_ok(true);
                        return well;
                      }});
  }
  template <class Answer>
  static Answer empty() {
    if constexpr (std::is_same_v<Answer, Status>)
      return Status();
    else
      return std::remove_reference_t<decltype(std::declval<Answer&>().value())>();
  }

  daemon::Board board_;
  mutable std::mutex mutex_;
  std::vector<std::string> calls_;
  daemon::Jobs jobs_;  ///< last: its threads use all of the above
};

/// Answers for a FakeApi. A recording of the name that was asked for.
inline Result<v1::RecordingStatus> recording_of_that_name(const v1::RecordRequest& request) {
  v1::RecordingStatus status;
  status.set_session(request.name());
  return status;
}
/// The third step, if it has the picture "voxels".
inline Result<v1::StylizationStatus> step_with_picture(const v1::EditRequest& request) {
  if (request.picture() != "voxels") return Error{ErrorKind::bad_input, "is missing", "step: picture"};
  v1::StylizationStatus status;
  status.set_steps(3);
  return status;
}
/// The voxels "voxels", of frame 12 only.
inline std::shared_ptr<const v1::IterationPreview> twelfth_frame(const v1::FrameRequest& request) {
  if (request.frame() != 12) return nullptr;
  auto kept = std::make_shared<v1::IterationPreview>();
  kept->mutable_volume()->set_voxels("voxels");
  return kept;
}

/// Jobs, for on_job. This one tells how far it is as often as that, and is done.
inline std::function<daemon::JobResult(const Observer&)> job_that_tells(int times) {
  return [times](const Observer& observer) {
    for (int i = 0; i < times; ++i) observer(0, {});
    return v1::JobOutcome();
  };
}

/// Goes on until nobody listens.
class EndlessJob {
 public:
  [[nodiscard]] bool begun() const { return begun_; }
  [[nodiscard]] bool ended() const { return ended_; }
  daemon::JobResult operator()(const Observer& observer) {
    begun_ = true;
    while (observer(0, {})) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ended_ = true;
    return Error{ErrorKind::refused, "ended early, as asked"};
  }

 private:
  std::atomic<bool> begun_ = false, ended_ = false;
};

}  // namespace emberlock::test
