// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/result.h"
#include "daemon/board.h"
#include "daemon/work/job.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

/// What clients ask of the daemon, whichever way they come: a method for each rpc of services.proto that
/// isn't a plain stream (those are the board's). Any thread may call; calls may take seconds (devices, queues
/// that drain), so servers make them on threads of their own. Errors: `refused` for what can't be done in the
/// present phase, else as base/result.h has them.
class Api {
 public:
  virtual ~Api() = default;
  [[nodiscard]] virtual Board& board() = 0;

  virtual Status acknowledge(const v1::AcknowledgeRequest& request) = 0;
  virtual Result<v1::ListDevicesResponse> list_devices() = 0;
  virtual Result<v1::StrobeState> strobe() = 0;
  virtual Result<v1::StrobeState> apply_strobe(const v1::StrobeState& wanted) = 0;
  virtual Status align(const v1::AlignRequest& request) = 0;
  virtual Status stop_sync() = 0;
  virtual Result<v1::RecordingStatus> record(const v1::RecordRequest& request) = 0;
  virtual Result<v1::RecordingStatus> stop_recording() = 0;
  virtual Result<v1::ListSessionsResponse> list_sessions() = 0;
  virtual Result<v1::Manifest> session(const v1::SessionRequest& request) = 0;
  // These begin jobs; none waits for its end.
  virtual Result<std::shared_ptr<JobHandle>> verify_session(const v1::SessionRequest& request) = 0;
  virtual Result<std::shared_ptr<JobHandle>> repair_session(const v1::SessionRequest& request) = 0;
  virtual Result<std::shared_ptr<JobHandle>> export_session(const v1::ExportRequest& request) = 0;
  virtual Status cancel_job(const v1::CancelJobRequest& request) = 0;
  virtual Result<v1::ReconstructionStatus> reconstruct(const v1::ReconstructRequest& request) = 0;
  virtual Result<v1::ReconstructionStatus> cancel_reconstruction() = 0;
  virtual Result<v1::StylizationStatus> edit_reconstruction(const v1::EditRequest& request) = 0;
  virtual Result<v1::ReconstructionStatus> finish_reconstruction() = 0;
  /// Null: the frame isn't done, or no longer held.
  virtual std::shared_ptr<const v1::IterationPreview> reconstructed_frame(
      const v1::FrameRequest& request) = 0;
  virtual Result<v1::ListResultsResponse> list_results() = 0;
  virtual Result<v1::ArStatus> start_ar(const v1::ArRequest& request) = 0;
  virtual Result<v1::ArStatus> stop_ar() = 0;
};

}  // namespace emberlock::daemon
