// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/discovery.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <string_view>

#include <fmt/format.h>

#include "drivers/aravis/gvcp.h"

namespace emberlock::drivers::aravis {
namespace {

using Now = std::chrono::steady_clock;

/// Guards the library's lists. Never destroyed, because a hanging call may outlast main().
struct Guarded {
  std::mutex mutex;
  std::vector<DiscoveredCamera> seen;             ///< by the last discovery
  std::map<std::string, DiscoveredCamera> known;  ///< last known data of every camera, by id
  Now::time_point seen_at;
};
Guarded& guarded() {
  static auto* const one = new Guarded;
  return *one;
}

std::string text(const char* s) { return s == nullptr ? "" : s; }

/// Makes an id a valid folder name.
std::string fit(std::string id) {
  for (char& c : id) {
    const auto u = static_cast<unsigned char>(c);
    if (!std::isalnum(u) && std::string_view(" ._:-").find(c) == std::string_view::npos) c = '_';
  }
  return id;
}

std::vector<DiscoveredCamera> ask_library() {
  arv_update_device_list();
  std::vector<DiscoveredCamera> seen;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const std::string protocol = text(arv_get_device_protocol(i));
    if (protocol != "GigEVision" && protocol != "USB3Vision") continue;
    DiscoveredCamera one;
    one.physical_id = fit(text(arv_get_device_physical_id(i)));
    const std::string serial = fit(text(arv_get_device_serial_nbr(i)));
    one.id = serial.empty() ? one.physical_id : serial;
    one.model = text(arv_get_device_vendor(i)) + " " + text(arv_get_device_model(i));
    one.address = text(arv_get_device_address(i));
    one.transport = protocol == "GigEVision" ? Transport::gige : Transport::usb3;
    one.library_id = text(arv_get_device_id(i));
    seen.push_back(std::move(one));
  }
  std::sort(seen.begin(), seen.end(),
            [](const DiscoveredCamera& a, const DiscoveredCamera& b) { return a.id < b.id; });
  return seen;
}

bool shows(const std::vector<DiscoveredCamera>& seen, const std::string& id) {
  return std::any_of(seen.begin(), seen.end(), [&](const DiscoveredCamera& one) { return one.id == id; });
}

/// The camera with this id. Error device: none or several; lists the cameras found.
Result<DiscoveredCamera> choose(const std::vector<DiscoveredCamera>& seen, const std::string& id) {
  std::vector<DiscoveredCamera> fitting;
  std::string there;
  for (const DiscoveredCamera& one : seen) {
    if (one.id == id || one.physical_id == id) fitting.push_back(one);
    there += (there.empty() ? "" : ", ") + one.id + " (" + one.model + ")";
  }
  if (fitting.size() == 1) return fitting.front();
  const std::string where = "camera " + id;
  if (!fitting.empty()) {
    return Error{ErrorKind::device, std::to_string(fitting.size()) + " cameras have this serial number",
                 where, "open it by its MAC: " + fitting[0].physical_id + ", " + fitting[1].physical_id};
  }
  return Error{ErrorKind::device, "no GigE Vision or USB3 Vision camera with this id answers", where,
               there.empty()
                   ? "none answers at all: check power, cable, and that its network is this machine's"
                   : "there are " + there};
}

/// Whether the same GigE camera answers at the same address.
bool is_where_it_was(const DiscoveredCamera& before) {
  if (before.transport != Transport::gige) return false;
  const auto identity = identity_at(before.address);
  return identity && fit(identity->serial.empty() ? identity->mac : identity->serial) == before.id;
}

Result<ObjectPtr<ArvCamera>> open_locked(const DiscoveredCamera& seen) {
  ErrorSlot error;
  ObjectPtr<ArvCamera> camera(arv_camera_new(seen.library_id.c_str(), error.out()));
  if (camera == nullptr) {
    return error.error(ErrorKind::device, "camera " + seen.id, "check that its network is this machine's");
  }
  return camera;
}

}  // namespace

std::vector<DiscoveredCamera> discover(const std::string& wanted) {
  const auto asked_at = Now::now();
  Guarded& library = guarded();
  const std::lock_guard lock(library.mutex);
  const bool fresh = library.seen_at > asked_at && (wanted.empty() || shows(library.seen, wanted));
  if (!fresh) {
    library.seen = ask_library();
    library.seen_at = Now::now();
    for (const DiscoveredCamera& one : library.seen) library.known[one.id] = one;
  }
  return library.seen;
}

Result<DiscoveredCamera> locate(const std::string& id) {
  std::optional<DiscoveredCamera> known;
  {
    const std::lock_guard lock(guarded().mutex);
    const auto it = guarded().known.find(id);
    if (it != guarded().known.end()) known = it->second;
  }
  if (known && is_where_it_was(*known)) {
    known->library_id = known->address;
    return *known;
  }
  return choose(discover(id), id);
}

std::optional<Error> held(const DiscoveredCamera& seen) {
  if (seen.transport != Transport::gige) return {};
  const auto controller = controller_of(seen.address);
  if (!controller) return {};
  const std::string where = "camera " + seen.id;
  if (controller->holder) {
    return Error{ErrorKind::device,
                 fmt::format("{} (process {}) has it", controller->holder->program, controller->holder->pid),
                 where, "close that program, then try again"};
  }
  return Error{ErrorKind::device,
               "another program controls it" +
                   (controller->address.empty() ? "" : ", on the machine " + controller->address),
               where, "close that program; control that it left behind ends some seconds later"};
}

Result<ObjectPtr<ArvCamera>> open_discovered(const DiscoveredCamera& seen) {
  const std::lock_guard lock(guarded().mutex);
  return open_locked(seen);
}

Status inspect(const DiscoveredCamera& seen, const std::function<void(ArvCamera*)>& question) {
  const std::lock_guard lock(guarded().mutex);
  EMBERLOCK_ASSIGN_OR_RETURN(const auto camera, open_locked(seen));
  question(camera.get());
  return {};
}

}  // namespace emberlock::drivers::aravis
