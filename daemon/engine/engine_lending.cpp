// SPDX-License-Identifier: Apache-2.0
// What a host that leads asks of this one.
#include "base/clock.h"
#include "daemon/engine/engine.h"

namespace emberlock::daemon {

Result<v1::LentCameras> Engine::lend(const std::string& leader) {
  return on_thread<Result<v1::LentCameras>>(Urgency::waits,
                                            [leader](Conductor& c) { return c.lend(leader); });
}

void Engine::hear(const std::string& leader) { loan_.hear(leader, SteadyClock().now()); }

Result<std::shared_ptr<LentFrames>> Engine::watch(const v1::FramesRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t camera,
                             on_thread<Result<std::size_t>>(Urgency::waits, [request](Conductor& c) {
                               return c.lent_camera(request.leader(), request.camera_id());
                             }));
  return loan_.watch(camera);
}

Status Engine::reset(const v1::ResetRequest& request) {
  return on_thread<Status>(Urgency::waits, [request](Conductor& c) { return c.reset_lent(request); });
}

Status Engine::trim(const v1::TrimRequest& request) {
  return on_thread<Status>(Urgency::waits, [request](Conductor& c) { return c.trim_lent(request); });
}

Result<v1::HostPart> Engine::record_part(const v1::PartRequest& request) {
  return on_thread<Result<v1::HostPart>>(Urgency::waits,
                                         [request](Conductor& c) { return c.record_part(request); });
}

Status Engine::stop_part(const v1::StopPartRequest& request) {
  return on_thread<Status>(Urgency::waits, [request](Conductor& c) { return c.stop_part(request); });
}

Result<v1::HostPart> Engine::part(const v1::FindPartRequest& request) {
  return on_thread<Result<v1::HostPart>>(Urgency::waits, [request](Conductor& c) { return c.part(request); });
}

}  // namespace emberlock::daemon
