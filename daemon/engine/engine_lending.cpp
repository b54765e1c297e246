// SPDX-License-Identifier: Apache-2.0
// What a host that leads asks of this one.
#include <optional>

#include "base/clock.h"
#include "daemon/engine/engine.h"
#include "daemon/engine/finished_part.h"

namespace emberlock::daemon {

Result<v1::LentCameras> Engine::lend(const Borrower& leader) {
  return on_thread<Result<v1::LentCameras>>(Urgency::waits,
                                            [leader](Conductor& c) { return c.lend(leader); });
}

Status Engine::hear(const Borrower& leader) {
  EMBERLOCK_RETURN_IF_ERROR(loan_.hear(leader, SteadyClock().now()));
  return {};
}

Result<std::shared_ptr<LentFrames>> Engine::watch(const Borrower& leader, const v1::FramesRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t camera,
                             on_thread<Result<std::size_t>>(Urgency::waits, [leader, request](Conductor& c) {
                               return c.lent_camera(leader, request.camera_id());
                             }));
  return loan_.watch(camera);
}

Status Engine::reset(const Borrower& leader, const v1::ResetRequest& request) {
  return on_thread<Status>(Urgency::waits,
                           [leader, request](Conductor& c) { return c.reset_lent(leader, request); });
}

Status Engine::trim(const Borrower& leader, const v1::TrimRequest& request) {
  return on_thread<Status>(Urgency::waits,
                           [leader, request](Conductor& c) { return c.trim_lent(leader, request); });
}

Result<v1::HostPart> Engine::record_part(const Borrower& leader, const v1::PartRequest& request) {
  return on_thread<Result<v1::HostPart>>(
      Urgency::waits, [leader, request](Conductor& c) { return c.record_part(leader, request); });
}

Status Engine::stop_part(const Borrower& leader, const v1::StopPartRequest& request) {
  return on_thread<Status>(Urgency::waits,
                           [leader, request](Conductor& c) { return c.stop_part(leader, request); });
}

Result<v1::HostPart> Engine::part(const Borrower& leader, const v1::FindPartRequest& request) {
  using Running = std::optional<v1::HostPart>;
  EMBERLOCK_ASSIGN_OR_RETURN(const Running running,
                             on_thread<Result<Running>>(Urgency::waits, [leader, request](Conductor& c) {
                               return c.find_running_part(leader, request.session_id());
                             }));
  if (running) return *running;
  return find_finished_part(store_, request);
}

}  // namespace emberlock::daemon
