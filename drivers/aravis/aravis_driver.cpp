// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/aravis_driver.h"

#include <mutex>
#include <utility>

#include "drivers/aravis/aravis_camera.h"
#include "drivers/aravis/discovery.h"
#include "drivers/aravis/gvcp.h"
#include "drivers/aravis/link.h"
#include "drivers/aravis/settings.h"

namespace emberlock::drivers {
namespace {

using namespace aravis;

constexpr Seconds kFindDeadline{2.9};
constexpr Seconds kOpenDeadline{5};

/// The results so far; shared with the thread, which continues if it hangs.
struct Findings {
  std::mutex mutex;
  std::vector<CameraFound> found;
};

/// Queries the camera for what discovery doesn't know.
void ask(const DiscoveredCamera& seen, CameraFound& found) {
  if (seen.transport == Transport::gige) {
    if (const auto controller = controller_of(seen.address)) {
      found.holder = controller->holder;
      if (!controller->holder) {
        found.notes.push_back(controller->address.empty()
                                  ? "in use, by this program or another"
                                  : "in use, by this program or another on " + controller->address);
      }
      return;
    }
  }
  const Status asked = inspect(seen, [&found](ArvCamera* camera) {
    for (const Offer& offer : offers(camera, {})) found.modes.push_back(offer.mode);
    found.trigger = trigger_of(camera);
    found.link_megabits = link_megabits_of(camera);
    for (std::string& note : notes_of(camera)) found.notes.push_back(std::move(note));
  });
  if (!asked) found.notes.push_back("it can't be opened: " + asked.error().what);
}

bool find_all(Findings& findings) {
  const auto seen = discover();
  {
    const std::lock_guard lock(findings.mutex);
    for (const DiscoveredCamera& one : seen) {
      CameraFound found;
      found.id = one.id;
      found.model = one.model;
      found.address = one.address;
      found.reset = ShutterReset::on_command;
      findings.found.push_back(std::move(found));
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CameraFound asked;
    {
      const std::lock_guard lock(findings.mutex);
      asked = findings.found[i];
    }
    ask(seen[i], asked);
    const std::lock_guard lock(findings.mutex);
    findings.found[i] = std::move(asked);
  }
  return true;
}

Result<std::vector<CameraFound>> find() {
  const auto findings = std::make_shared<Findings>();
  const auto done = in_background<bool>([findings] { return find_all(*findings); });
  const bool all = done_within(done, kFindDeadline);
  const std::lock_guard lock(findings->mutex);
  if (all) return findings->found;
  auto found = findings->found;
  for (CameraFound& one : found) {
    if (one.modes.empty() && one.notes.empty() && !one.holder)
      one.notes.emplace_back("it didn't answer in time");
  }
  return found;
}

Result<std::unique_ptr<Camera>> open(const std::string& id, const CameraRequest& request) {
  using Linked = Result<std::shared_ptr<Link>>;
  auto opening = in_background<Linked>([id, request] {
    const auto seen = locate(id);
    if (!seen) return Linked(seen.error());
    // Some cameras take long to refuse control.
    if (auto error = held(*seen)) return Linked(*std::move(error));
    return Link::open(*seen, request);
  });
  if (!done_within(opening, kOpenDeadline)) {
    return Error{ErrorKind::device, "it doesn't answer", "camera " + id, "cut its power for some seconds"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(auto link, opening.get());
  return std::unique_ptr<Camera>(std::make_unique<AravisCamera>(id, request, std::move(link)));
}

}  // namespace

CameraDriver aravis_driver() { return {"aravis", find, open}; }

}  // namespace emberlock::drivers
