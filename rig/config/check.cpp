// SPDX-License-Identifier: Apache-2.0
#include "rig/config/check.h"

#include <algorithm>
#include <charconv>
#include <set>

#include <fmt/format.h>

namespace emberlock::rig::config {
namespace {

constexpr int kMostVirtual = 64;

/// The position of a key or section in the file, or of the section that contains it.
toml::source_region place(const toml::table& root, const std::string& path) {
  if (const toml::node* node = root.at_path(path).node()) return node->source();
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? root.source() : place(root, path.substr(0, dot));
}

bool fit_for_a_folder(const std::string& id) {
  constexpr std::string_view kOthers = " ._:-";
  return id.find_first_not_of('.') != std::string::npos &&
         std::all_of(id.begin(), id.end(), [&](unsigned char c) {
           return (c < 128 && std::isalnum(c) != 0) ||
                  kOthers.find(static_cast<char>(c)) != std::string_view::npos;
         });
}

bool is_real(CameraSource source) {
  return source == CameraSource::v4l2 || source == CameraSource::aravis || source == CameraSource::ptp;
}

/// The host of HOST:PORT or [HOST]:PORT; nullopt for other text.
std::optional<std::string> host_of(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  std::uint16_t port = 0;
  const char* const end = address.data() + address.size();
  const auto [stop, failed] = std::from_chars(address.data() + colon + 1, end, port);
  if (failed != std::errc{} || stop != end) return std::nullopt;
  std::string host = address.substr(0, colon);
  if (host.front() == '[' && host.back() == ']' && host.size() > 2) return host.substr(1, host.size() - 2);
  return host.find(':') == std::string::npos ? std::optional(host) : std::nullopt;
}

void check_camera(const ConfigCheck& t, const CameraConfig& camera, const std::string& path,
                  std::set<std::pair<CameraSource, std::string>>& ids) {
  const bool remote = camera.source == CameraSource::remote;
  if (remote && !host_of(camera.host)) {
    t.problem(place(t.root, path + ".host"),
              camera.host.empty() ? "the camera has no host" : "\"" + camera.host + "\" is no address",
              "say host = \"HOST:PORT\", where its emberlockd lends it");
  }
  if ((is_real(camera.source) || remote) && camera.id.empty()) {
    t.problem(place(t.root, path), "the camera has no id", "say id = as `emberlock devices` names it");
  }
  if (!camera.id.empty() && !fit_for_a_folder(camera.id)) {
    t.problem(place(t.root, path + ".id"), "the id is no name for a folder",
              "give letters, digits, space and . _ : -");
  }
  // A session knows cameras by their ids alone.
  const bool twice = std::any_of(ids.begin(), ids.end(), [&](const auto& other) {
    return other.second == camera.id &&
           (other.first == camera.source || remote || other.first == CameraSource::remote);
  });
  if (twice && remote) {
    t.problem(place(t.root, path + ".id"), "two cameras have the id \"" + camera.id + "\"",
              "give the one that is simulated another id; of two hosts' equal ids one can't be in the rig");
  } else if (!ids.insert({camera.source, camera.id}).second) {
    t.problem(place(t.root, path + ".id"), "two cameras of one driver have the id \"" + camera.id + "\"",
              "give each its own id, or several alike by count");
  }
  if (camera.rows && camera.shifts && *camera.shifts < *camera.rows) {
    t.problem(place(t.root, path + ".shifts"), "shifts are fewer than rows",
              fmt::format("give {} at least", *camera.rows));
  }
}

void check_light(const ConfigCheck& t) {
  const RigConfig& rig = t.config.rig;
  if (rig.virtual_rig.time == VirtualConfig::Time::fast) {
    t.problem(place(t.root, "rig.virtual.light"), "several daemons share no time that runs faster than real",
              "say time = \"real\", or leave out light");
  }
  if (rig.strobe.source != StrobeSource::virtual_ && rig.strobe.source != StrobeSource::none) {
    t.problem(place(t.root, "rig.virtual.light"), "only a virtual strobe can be shared",
              "say driver = \"virtual\" in [rig.strobe], or no strobe to read another daemon's");
  }
}

void check_rig(const ConfigCheck& t) {
  const RigConfig& rig = t.config.rig;
  std::set<std::pair<CameraSource, std::string>> ids;
  int virtual_cameras = 0;
  bool real = rig.strobe.source == StrobeSource::serial;
  bool replay = rig.strobe.source == StrobeSource::replay;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraConfig& camera = rig.cameras[i];
    check_camera(t, camera, fmt::format("rig.camera[{}]", i), ids);
    if (camera.source == CameraSource::virtual_) virtual_cameras += camera.count;
    real = real || is_real(camera.source) || camera.source == CameraSource::remote;
    replay = replay || camera.source == CameraSource::replay;
  }
  const auto own = [](const CameraConfig& camera) { return camera.source != CameraSource::remote; };
  if (!rig.cameras.empty() && std::none_of(rig.cameras.begin(), rig.cameras.end(), own)) {
    t.problem(place(t.root, "rig.camera"), "all cameras are other hosts'",
              "lead from a host that has one of them");
  }
  if (virtual_cameras > kMostVirtual) {
    t.problem(place(t.root, "rig.camera"), fmt::format("there are {} virtual cameras", virtual_cameras),
              fmt::format("give {} at most", kMostVirtual));
  }
  if (real && rig.virtual_rig.time == VirtualConfig::Time::fast) {
    t.problem(place(t.root, "rig.virtual.time"), "real devices don't film faster than real time",
              "say time = \"real\", or take them out of the rig");
  }
  if (!rig.virtual_rig.light.empty()) check_light(t);
  if (replay && rig.replay_session.empty()) {
    t.problem(place(t.root, "rig.replay"), "there is nothing to replay",
              "say session = \"FOLDER\" in [rig.replay]");
  }
  if (rig.strobe.source == StrobeSource::serial && rig.strobe.id.empty()) {
    t.problem(place(t.root, "rig.strobe"), "the strobe has no id",
              "say id = as `emberlock devices` names the serial port");
  }
  const Seconds watchdog = rig.strobe.request.options.watchdog;
  if (watchdog > Seconds(0) && watchdog < Seconds(0.1)) {
    t.problem(place(t.root, "rig.strobe.watchdog_s"), "watchdog_s is shorter than commands take",
              "give 0 (never) or a number from 0.1 to 600");
  }
}

void check_hosts(const ConfigCheck& t) {
  const HostsConfig& hosts = t.config.hosts;
  const auto& cameras = t.config.rig.cameras;
  const bool lends = !hosts.listen.empty();
  const bool leads = std::any_of(cameras.begin(), cameras.end(),
                                 [](const CameraConfig& c) { return c.source == CameraSource::remote; });
  if (lends && !host_of(hosts.listen)) {
    t.problem(place(t.root, "hosts.listen"), "\"" + hosts.listen + "\" is no address",
              "give HOST:PORT, as 0.0.0.0:7143");
  }
  if (lends && leads) {
    t.problem(place(t.root, "hosts.listen"), "a host that has other hosts' cameras lends none",
              "leave listen out, or the cameras of driver \"remote\"");
  }
  if (!lends && !leads) return;
  const char* who = lends ? "listen" : "driver \"remote\"";
  for (const auto& [path, key] : {std::pair(&hosts.certificate, "certificate"), std::pair(&hosts.key, "key"),
                                  std::pair(&hosts.authority, "authority")}) {
    if (path->empty())
      t.problem(place(t.root, "hosts.listen"), fmt::format("{} needs {}", who, key),
                fmt::format("give {} in [hosts]", key));
  }
}

bool is_local(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

void check_server(const ConfigCheck& t) {
  const ServerConfig& server = t.config.server;
  const auto host = [&](const std::string& address, const char* key) {
    auto found = address.empty() ? std::nullopt : host_of(address);
    if (!found && !address.empty()) {
      t.problem(place(t.root, key), "\"" + address + "\" is no address", "give HOST:PORT, as 127.0.0.1:7140");
    }
    return found;
  };
  const auto needs = [&](const char* key, const char* who, const std::filesystem::path& path,
                         const char* what) {
    if (!path.empty()) return;
    t.problem(place(t.root, key), fmt::format("{} needs {}", who, what),
              fmt::format("give {} in [server]", what));
  };
  const auto needs_tls_and_token = [&](const char* key, const char* who) {
    needs(key, who, server.tls_certificate, "tls_certificate");
    needs(key, who, server.tls_key, "tls_key");
    needs(key, who, server.token_file, "token_file");
  };
  if (host(server.listen, "server.listen")) needs_tls_and_token("server.listen", "listen");
  const auto http = host(server.http_listen, "server.http_listen");
  if (http && !is_local(*http)) needs_tls_and_token("server.http_listen", "http_listen beyond localhost");
}

}  // namespace

void check_consistency(const ConfigCheck& check) {
  check_rig(check);
  check_server(check);
  check_hosts(check);
}

}  // namespace emberlock::rig::config
