// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/image_size.h"
#include "evaluate/machine_speed.h"
#include "rig/devices/device_list.h"
#include "rig/doctor/doctor.h"

namespace emberlock::cli {
namespace {

using evaluate::FrameTimes;
using nlohmann::ordered_json;

/// The command line as typed.
struct BenchArguments {
  evaluate::PlannedRig rig;
  std::string size = "640x480";
  std::string folder = ".";
  std::string device = "auto";
  int threads = 0;
  bool json = false;
};

/// What was measured.
struct Bench {
  evaluate::MachineSpeed machine;
  std::string no_cuda;  ///< why no GPU was measured; else empty
  rig::DeviceList devices;
  FrameTimes frame;  ///< of the rig asked for, on the quicker device
  bool on_cuda = false;
  evaluate::RigExpectation expected;
};

/// One line of the table: more is better for a rate, less for a time.
struct Line {
  const char* name;
  const char* unit;
  std::optional<double> here;
  double readme;
  bool more_is_better = false;
  [[nodiscard]] double ratio() const { return more_is_better ? *here / readme : readme / *here; }
};

std::vector<Line> table(const evaluate::MachineSpeed& m) {
  const evaluate::MachineSpeed other = evaluate::readme_machine();
  const auto of_cuda = [&](Seconds FrameTimes::*time) -> std::optional<double> {
    if (!m.cuda) return {};
    return (*m.cuda.*time).value();
  };
  return {{"disk", "MB/s", m.disk / 1e6, other.disk / 1e6, true},
          {"CPU: a frame, extinction told", "s", m.cpu.told.value(), other.cpu.told.value()},
          {"CPU: a frame, effects found out", "s", m.cpu.found.value(), other.cpu.found.value()},
          {"GPU: a frame, extinction told", "s", of_cuda(&FrameTimes::told), other.cuda->told.value()},
          {"GPU: a frame, effects found out", "s", of_cuda(&FrameTimes::found), other.cuda->found.value()}};
}

FrameTimes timed(const evaluate::PlannedRig& rig, recon::Device device, const BenchArguments& a,
                 const char* title) {
  constexpr int kRepeats = 2;
  return or_fail(
      evaluate::time_frame(rig, {device, a.threads}, kRepeats, SteadyClock{}, progress_bar(title)));
}

Bench measure(const BenchArguments& a) {
  const evaluate::PlannedRig usual;
  Bench b;
  const recon::Device asked = or_fail(recon::parse_device(a.device));
  const Result<recon::Device> cuda =
      asked == recon::Device::cpu
          ? Result<recon::Device>(Error{ErrorKind::refused, "not asked for", "--device cpu", ""})
          : recon::resolve(asked == recon::Device::cuda ? asked : recon::Device::cuda);
  if (!cuda) b.no_cuda = cuda.error().what;
  if (!cuda && asked == recon::Device::cuda) fail(cuda.error());
  b.machine.disk = or_fail(rig::doctor::write_speed(a.folder, std::uint64_t{256} << 20, Seconds(2)));
  b.devices = rig::list_devices();
  b.machine.cpu = timed(usual, recon::Device::cpu, a, "CPU");
  if (cuda) b.machine.cuda = timed(usual, *cuda, a, "GPU");
  b.on_cuda = b.machine.cuda && b.machine.cuda->found < b.machine.cpu.found;
  b.frame = b.on_cuda ? *b.machine.cuda : b.machine.cpu;
  if (a.rig.cameras != usual.cameras || a.rig.size != usual.size || a.rig.voxels != usual.voxels)
    b.frame = timed(a.rig, b.on_cuda ? *cuda : recon::Device::cpu, a, "your rig");
  b.expected = or_fail(evaluate::expectation(a.rig, b.machine.disk, b.frame));
  return b;
}

void print(const Bench& b, const BenchArguments& a) {
  std::printf("%-33s %12s %12s %7s\n", "ten views of 640 x 480, 128 voxels", "this machine", "README's",
              "times");
  for (const Line& line : table(b.machine)) {
    const std::string readme = fmt::format("{:.3g} {}", line.readme, line.unit);
    const std::string here = line.here ? fmt::format("{:.3g} {}", *line.here, line.unit) : "-";
    const std::string ratio = line.here ? fmt::format("{:.2f}", line.ratio()) : "-";
    std::printf("%-34s %12s %12s %7s\n", line.name, here.c_str(), readme.c_str(), ratio.c_str());
  }
  std::printf("README's machine: %s. More times is faster.\n",
              std::string(evaluate::readme_machine_name()).c_str());
  if (!b.no_cuda.empty()) std::printf("No GPU was measured: %s\n", b.no_cuda.c_str());
  std::printf("Cameras: %zu found%s\n\n", b.devices.cameras.size(),
              b.devices.cameras.empty() ? "; `emberlock doctor` says what may be missing"
                                        : "; `emberlock devices probe ID` measures one");
  const evaluate::PlannedRig& rig = a.rig;
  std::printf("%d cameras of %d x %d at %g frames/s, %g byte(s) a pixel, %d voxels:\n", rig.cameras,
              rig.size.width, rig.size.height, rig.rate, rig.bytes_per_pixel, rig.voxels);
  std::printf("  recording     %.3g MB/s. This disk takes %d such cameras with half as much to spare%s\n",
              b.expected.bytes_per_s / 1e6, b.expected.cameras_recorded,
              b.expected.recorded ? "." : ": too few. Film fewer frames or pixels, or use a faster disk.");
  std::printf("  a frame       %.3g s (extinction told: %.3g s) on the %s\n", b.frame.found.value(),
              b.frame.told.value(), b.on_cuda ? "GPU" : "CPU");
  std::printf("  1 s of film   %.3g min of reconstruction\n", b.expected.seconds_per_second / 60);
}

void print_json(const Bench& b, const BenchArguments& a) {
  ordered_json lines = ordered_json::array();
  for (const Line& line : table(b.machine)) {
    ordered_json entry{{"what", line.name}, {"unit", line.unit}, {"readme", line.readme}};
    entry["here"] = line.here ? ordered_json(*line.here) : ordered_json(nullptr);
    entry["times"] = line.here ? ordered_json(line.ratio()) : ordered_json(nullptr);
    lines.push_back(std::move(entry));
  }
  const evaluate::PlannedRig& rig = a.rig;
  const ordered_json document{{"machine", lines},
                              {"no_gpu", b.no_cuda.empty() ? ordered_json(nullptr) : ordered_json(b.no_cuda)},
                              {"cameras_found", b.devices.cameras.size()},
                              {"rig",
                               {{"cameras", rig.cameras},
                                {"width", rig.size.width},
                                {"height", rig.size.height},
                                {"fps", rig.rate},
                                {"bytes_per_pixel", rig.bytes_per_pixel},
                                {"voxels", rig.voxels}}},
                              {"expected",
                               {{"bytes_per_s", b.expected.bytes_per_s},
                                {"cameras_recorded", b.expected.cameras_recorded},
                                {"recorded", b.expected.recorded},
                                {"device", b.on_cuda ? "cuda" : "cpu"},
                                {"frame_told_s", b.frame.told.value()},
                                {"frame_found_s", b.frame.found.value()},
                                {"seconds_per_second_of_film", b.expected.seconds_per_second}}}};
  std::printf("%s\n", document.dump(-1, ' ', false, ordered_json::error_handler_t::replace).c_str());
}

void bench(BenchArguments& a) {
  a.rig.size = or_fail(parse_image_size(a.size, "--size"));
  or_fail(evaluate::check(a.rig));
  const Bench measured = measure(a);
  if (a.json)
    print_json(measured, a);
  else
    print(measured, a);
}

}  // namespace

void add_bench(const Verb& app) {
  auto arguments = std::make_shared<BenchArguments>();
  BenchArguments& a = *arguments;
  const Verb verb = app.add_verb("bench",
                                 "Measures this machine's CPU, GPU and disk beside the README's, and says "
                                 "what to expect for a rig. Takes 10 s on two cores.");
  verb.add_option("--cameras", a.rig.cameras, "The rig's cameras").show_default();
  verb.add_option("--size", a.size, "Of their pictures, WxH").show_default();
  verb.add_option("--fps", a.rig.rate, "Frames a second").show_default();
  verb.add_option("--bytes-per-pixel", a.rig.bytes_per_pixel,
                  "As recorded: 1 for 8 bits, grey or a Bayer pattern; 2 for more bits; 3 for RGB")
      .show_default();
  verb.add_option("--voxels", a.rig.voxels, "Along the longest edge").show_default();
  verb.add_option("--disk", a.folder, "A place on the recordings' disk; what is written there is removed")
      .show_default();
  verb.add_device(a.device);
  verb.add_threads(a.threads);
  verb.add_flag("--json", a.json, "One JSON object");
  verb.set_action([arguments] { bench(*arguments); });
}

}  // namespace emberlock::cli
