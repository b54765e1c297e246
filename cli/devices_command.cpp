// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/pixel_formats.h"
#include "drivers/camera_thread.h"
#include "drivers/hotplug.h"
#include "drivers/probe.h"
#include "drivers/virtual/virtual_rig.h"
#include "rig/devices/device_list.h"

namespace emberlock::cli {
namespace {

struct ListArguments {
  bool all_modes = false;
  bool json = false;
};

struct ProbeArguments {
  std::string id;
  std::string rig;
  double seconds = 5;
  int resets = 0;
  std::string size;
  std::string format;
  double rate = 0;
  double exposure_ms = 0;
  std::vector<std::string> controls;
  bool json = false;
};

void print_failures(const rig::DeviceList& list) {
  for (const rig::DeviceList::Failure& failure : list.failures)
    std::fprintf(stderr, "emberlock: %s\n", failure.error.message().c_str());
}

void list(const ListArguments& arguments) {
  const rig::DeviceList found = rig::list_devices();
  if (arguments.json) {
    std::printf("%s\n", rig::device_json(found).c_str());
    return;
  }
  print_failures(found);
  std::printf("%s",
              rig::device_table(found, arguments.all_modes ? rig::Detail::all_modes : rig::Detail::best_mode)
                  .c_str());
  if (found.cameras.empty()) {
    std::printf(
        "No camera was found. Is it switched on and plugged in? Are the rules of udev/ installed, and are "
        "you in the "
        "group emberlock? `emberlock doctor` tells. Without any: virtual:11 is a rig of eleven simulated "
        "ones, as "
        "in `emberlock align --rig virtual:11` or `emberlock devices probe virtual-00 --rig virtual:11`.\n");
  }
}

/// Prints devices that are connected or disconnected, until Ctrl-C.
void watch() {
  constexpr Seconds kLook{2};  // interval of searches: network cameras don't announce themselves
  const Interrupt interrupt;
  auto hotplug = drivers::HotplugMonitor::open({"video4linux", "usb", "tty"});
  if (!hotplug) std::fprintf(stderr, "emberlock: %s\n", hotplug.error().message().c_str());
  rig::DeviceList before = rig::list_devices();
  std::printf("%s", rig::device_table(before, rig::Detail::best_mode).c_str());
  std::fflush(stdout);
  SteadyClock clock;
  while (!Interrupt::asked()) {
    if (hotplug) {
      hotplug->next(kLook);
    } else {
      clock.sleep_until(clock.now() + kLook);
    }
    rig::DeviceList after = rig::keep_unseen(before, rig::list_devices());
    const rig::DeviceChanges changed = rig::changes(before, after);
    for (const rig::ListedCamera& camera : changed.went.cameras)
      std::printf("gone: %s\n", camera.found.id.c_str());
    for (const drivers::StrobeFound& port : changed.went.ports) std::printf("gone: %s\n", port.id.c_str());
    if (const std::string came = rig::device_table(changed.came, rig::Detail::best_mode); !came.empty())
      std::printf("came:\n%s", came.c_str());
    std::fflush(stdout);
    before = std::move(after);
  }
}

Result<drivers::CameraRequest> request_from(const ProbeArguments& arguments) {
  drivers::CameraRequest request;
  if (arguments.rate > 0) request.frame_rate = Hertz(arguments.rate);
  if (arguments.exposure_ms > 0) request.exposure = milliseconds(arguments.exposure_ms);
  if (!arguments.format.empty()) request.format = pixel_formats().at(arguments.format);
  for (const std::string& control : arguments.controls) {
    const auto equals = control.find('=');
    if (equals == 0 || equals == std::string::npos) {
      return Error{ErrorKind::bad_input, "not a control: \"" + control + "\"", "--control", "say NAME=VALUE"};
    }
    request.controls[control.substr(0, equals)] = control.substr(equals + 1);
  }
  if (arguments.size.empty()) return request;
  EMBERLOCK_ASSIGN_OR_RETURN(request.size, parse_image_size(arguments.size, "--size"));
  return request;
}

struct Probed {
  std::string where;
  drivers::ProbeFilm film;
  drivers::ProbeVerdict verdict;
};

Result<Probed> probe_virtual(const ProbeArguments& arguments, const drivers::ProbeOptions& options) {
  const auto clock = std::make_shared<SteadyClock>();
  EMBERLOCK_ASSIGN_OR_RETURN(const drivers::VirtualRigOptions drawn,
                             drivers::parse_virtual_rig(arguments.rig));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto rig, drivers::VirtualRig::create(drawn, clock));
  for (int i = 0; i < rig->size(); ++i) {
    if (rig->camera(i).info().id != arguments.id) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(drivers::ProbeFilm film,
                               drivers::film_probe(rig->camera(i), options, *clock, progress_bar("probe")));
    drivers::ProbeVerdict verdict = drivers::assess(film, {});
    return Probed{arguments.rig, std::move(film), std::move(verdict)};
  }
  return Error{ErrorKind::bad_input, "there is no such camera in " + arguments.rig, arguments.id,
               "Its cameras are virtual-00, virtual-01 and so on"};
}

Result<Probed> probe_real(const ProbeArguments& arguments, const drivers::ProbeOptions& options,
                          const rig::DeviceList& there) {
  EMBERLOCK_ASSIGN_OR_RETURN(const drivers::CameraRequest request, request_from(arguments));
  EMBERLOCK_ASSIGN_OR_RETURN(const rig::ListedCamera listed, rig::find_camera(there, arguments.id));
  const auto drivers = rig::camera_drivers();
  const auto driver = std::find_if(drivers.begin(), drivers.end(),
                                   [&](const drivers::CameraDriver& d) { return d.name == listed.driver; });
  EMBERLOCK_ASSIGN_OR_RETURN(auto opened, driver->open(arguments.id, request));
  drivers::CameraThread camera(std::move(opened));
  SteadyClock clock;
  EMBERLOCK_ASSIGN_OR_RETURN(drivers::ProbeFilm film,
                             drivers::film_probe(camera, options, clock, progress_bar("probe")));
  drivers::ProbeVerdict verdict = drivers::assess(film, listed.found.link_megabits);
  return Probed{listed.found.address, std::move(film), std::move(verdict)};
}

nlohmann::ordered_json probe_json(const Probed& probed) {
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const drivers::ProbeFinding& f : probed.verdict.findings) {
    findings.push_back(
        {{"what", f.what}, {"fitness", name(f.fitness)}, {"measured", f.measured}, {"remedy", f.remedy}});
  }
  const drivers::FrameCounts& c = probed.film.counts;
  nlohmann::ordered_json json{{"id", probed.film.info.id},
                              {"fitness", name(probed.verdict.fitness)},
                              {"frame_rate_hz", probed.verdict.rate.value()},
                              {"arrival_jitter_s", probed.verdict.arrival_jitter.value()},
                              {"arrival_worst_s", probed.verdict.arrival_worst.value()},
                              {"counts",
                               {{"delivered", c.delivered},
                                {"damaged", c.damaged},
                                {"camera_gap", c.camera_gap},
                                {"transport", c.transport},
                                {"resend", c.resend},
                                {"underrun", c.underrun},
                                {"queue", c.queue},
                                {"passed_over", c.passed_over}}},
                              {"reset_mean_s", nullptr},
                              {"reset_jitter_s", nullptr},
                              {"findings", std::move(findings)}};
  if (probed.verdict.reset) {
    json["reset_mean_s"] = probed.verdict.reset->mean.value();
    json["reset_jitter_s"] = probed.verdict.reset->sigma.value();
  }
  return json;
}

void print_probe(const Probed& probed) {
  const drivers::CameraInfo& info = probed.film.info;
  std::printf("%s (%s, %s), %d x %d %s\n", info.id.c_str(), info.model.c_str(), probed.where.c_str(),
              info.layout.size.width, info.layout.size.height, std::string(name(info.layout.format)).c_str());
  for (const drivers::ProbeFinding& f : probed.verdict.findings) {
    std::printf("  %-10s %-6s %s\n", f.what.c_str(), std::string(name(f.fitness)).c_str(),
                f.measured.c_str());
    if (!f.remedy.empty()) std::printf("  %-10s %-6s -> %s\n", "", "", f.remedy.c_str());
  }
  std::printf("%s\n", probed.verdict.fitness == drivers::Fitness::good   ? "fit"
                      : probed.verdict.fitness == drivers::Fitness::poor ? "usable; see what is poor"
                                                                         : "not fit as it is");
}

void print_json(const nlohmann::ordered_json& json) {
  std::printf("%s\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

/// Reports whether a strobe is connected to a serial port, and which.
void probe_port(const ProbeArguments& arguments, const drivers::StrobeFound& port) {
  const drivers::StrobeIdentity strobe = or_fail(drivers::identify_strobe(port.id));
  const std::string dialect(drivers::name_of(strobe.dialect));
  if (arguments.json) return print_json({{"id", port.id}, {"dialect", dialect}, {"model", strobe.model}});
  std::printf("%s (%s): a strobe, %s, that speaks %s\n", port.id.c_str(), port.address.c_str(),
              strobe.model.c_str(), dialect.c_str());
}

void probe(const ProbeArguments& arguments) {
  rig::DeviceList there;
  if (arguments.rig.empty()) there = rig::list_devices();
  print_failures(there);
  for (const drivers::StrobeFound& port : there.ports) {
    if (port.id == arguments.id) return probe_port(arguments, port);
  }
  const drivers::ProbeOptions options{Seconds(arguments.seconds), arguments.resets};
  const Probed probed = or_fail(arguments.rig.empty() ? probe_real(arguments, options, there)
                                                      : probe_virtual(arguments, options));
  if (arguments.json) {
    print_json(probe_json(probed));
  } else {
    print_probe(probed);
  }
  if (probed.verdict.fitness == drivers::Fitness::unfit) throw Exit(1);
}

void add_probe(const Verb& devices) {
  auto a = std::make_shared<ProbeArguments>();
  const Verb verb = devices.add_verb(
      "probe",
      "Films for some seconds with one camera and assesses rate, losses by cause, arrival times and "
      "bandwidth. Of a serial port it finds out whether a strobe is connected, and which.");
  verb.add_option("ID", a->id, "The camera or port, as `emberlock devices` names it").require();
  verb.add_option("--seconds", a->seconds, "How long to film").check_range(0.5, 3600.0).show_default();
  verb.add_option("--resets", a->resets, "Then measure the delay of so many resets of its shutter")
      .check_range(0, 1000);
  verb.add_option("--size", a->size, "WIDTHxHEIGHT [the largest]");
  verb.add_option("--rate", a->rate, "Frames per second [the fastest]").check_positive();
  verb.add_option("--format", a->format, "Pixel format [the one that keeps most]")
      .check_choices(names_of(pixel_formats()));
  verb.add_option("--exposure-ms", a->exposure_ms, "Exposure time, ms [the camera's own setting]")
      .check_positive();
  verb.add_option("--control", a->controls, "NAME=VALUE, by the camera's own names; may be repeated");
  verb.add_option("--rig", a->rig, "A virtual rig instead of what is plugged in: virtual:11");
  verb.add_flag("--json", a->json, "One JSON object");
  verb.set_action([a] { probe(*a); });
}

}  // namespace

void add_devices(const Verb& app) {
  auto a = std::make_shared<ListArguments>();
  const Verb verb = app.add_verb(
      "devices",
      "Lists the connected cameras and serial ports, what they can do, and which process holds them.");
  verb.allow_verb();
  verb.add_flag("--modes", a->all_modes, "List every mode of each camera");
  verb.add_flag("--json", a->json, "One JSON object");
  verb.set_action([a, verb] {
    if (!verb.verb_is_given()) list(*a);
  });
  add_probe(verb);
  add_clips(verb);
  verb.add_verb("watch", "Reports devices that are connected or disconnected, until Ctrl-C.")
      .set_action(watch);
}

}  // namespace emberlock::cli
