// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/file.h"
#include "cli/commands.h"
#include "cli/design_files.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "evaluate/machine_speed.h"
#include "recon/calibrate/rig.h"
#include "report/design_report.h"
#include "rig/doctor/doctor.h"

namespace emberlock::cli {
namespace {

/// The command line as typed.
struct DesignArguments {
  evaluate::DesignRequest request;
  std::string flame;
  std::optional<double> target;
  double tolerance_ms = 0.5;
  double rate = 24;
  double seconds = 10;
  double host_link = 350;
  std::string rig;
  std::string law;
  std::vector<std::string> machines;
  std::string disk = ".";
  std::string out;
  std::uint64_t seed = 1;
  int threads = 0;
  bool check = false;
  bool json = false;
};

Error bad_flame(const std::string& text) {
  return {ErrorKind::bad_input, fmt::format("\"{}\" is not a flame", text), "--flame",
          "Give its height in metres, its upward speed in m/s and its temperature in K: 0.16,2,1800"};
}

Result<evaluate::DesignRequest> request_of(const DesignArguments& a) {
  const auto flame = parse_numbers_of<3>(a.flame);
  if (!flame) return bad_flame(a.flame);
  evaluate::DesignRequest request = a.request;
  request.size = Meters((*flame)[0]);
  request.speed = (*flame)[1];
  request.temperature = Kelvin((*flame)[2]);
  if (a.target) request.target = *a.target;
  request.tolerance = milliseconds(a.tolerance_ms);
  request.rate = Hertz(a.rate);
  request.film = Seconds(a.seconds);
  request.host_link = a.host_link * 1e6;
  EMBERLOCK_RETURN_IF_ERROR(evaluate::check_design(request));
  if (!a.target && a.rig.empty() && !a.check)
    return Error{ErrorKind::bad_input, "nothing says how accurate the rig must be", "--target-error",
                 "Give a held-out error in grey levels, or a rig with --rig for its next camera"};
  return request;
}

/// The rig that stands, if one was given.
Result<std::optional<evaluate::StandingRig>> standing_rig(const std::string& file) {
  if (file.empty()) return std::optional<evaluate::StandingRig>();
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, session::read_rig(file));
  std::vector<recon::CameraModel> cameras;
  for (const auto& [id, camera] : recon::placed_cameras(rig)) cameras.push_back(camera);
  std::optional<Eigen::Vector3d> middle;
  if (rig.has_box()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Box box, recon::box_of(rig.box(), file));
    middle = box.center;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(evaluate::StandingRig standing, evaluate::standing(cameras, middle));
  return std::optional(std::move(standing));
}

/// The law of such flames, from a file, or by rigs simulated on this machine.
void find_law(const DesignArguments& a, report::DesignPage& page) {
  if (!a.law.empty()) {
    page.law = or_fail(read_error_law(a.law));
    return;
  }
  evaluate::Twin twin(a.seed, a.threads);
  page.sweep = evaluate::sweep_rigs();
  page.measured =
      or_fail(evaluate::measure_all(twin, page.sweep, SteadyClock{}, progress_bar("simulated rigs")));
  page.law = or_fail(evaluate::fit_error_law(page.measured));
}

Seconds time_of(const evaluate::PlannedRig& rig, int threads, const char* title) {
  constexpr int kOnce = 1;
  return or_fail(evaluate::time_frame(rig, {recon::Device::cpu, threads}, kOnce, SteadyClock{},
                                      progress_bar(title)))
      .found;
}

/// Here it is measured; elsewhere it is as much longer or shorter as what bench measured of the usual rig.
void measure_minutes(const DesignArguments& a, const std::vector<BenchFile>& others,
                     report::DesignPage& page) {
  const evaluate::DesignedRig& rig = page.design.chosen;
  const double frames = page.request.rate * page.request.film;
  const Seconds here = time_of({rig.cameras, rig.size, a.rate, page.request.bytes_per_pixel, rig.voxels},
                               a.threads, "a frame of this rig");
  const auto add = [&](const std::string& name, double frame) {
    page.machines.push_back({name, frame, frame * frames / 60});
  };
  add("this machine", here.value());
  if (others.empty()) return;
  const Seconds usual = time_of({}, a.threads, "a frame of bench's rig");
  for (const BenchFile& other : others) add(other.name, here.value() * (other.frame / usual));
}

void measure_costs(const DesignArguments& a, const std::vector<BenchFile>& others, report::DesignPage& page) {
  const double disk = or_fail(rig::doctor::write_speed(a.disk, std::uint64_t{64} << 20, Seconds(1)));
  page.recording = or_fail(evaluate::recording_of(page.request, page.design.chosen, disk));
  measure_minutes(a, others, page);
}

/// Predicted and measured errors of rigs that the law wasn't fitted to.
void print_check(const DesignArguments& a, const report::DesignPage& page) {
  evaluate::Twin twin(a.seed, a.threads);
  const std::vector<evaluate::NamedRig> rigs = evaluate::check_rigs();
  const std::vector<evaluate::MeasuredRig> measured =
      or_fail(evaluate::measure_all(twin, rigs, SteadyClock{}, progress_bar("rigs to check by")));
  std::printf("%9s %9s %6s  rig\n", "predicted", "measured", "off");
  double worst = 0;
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    const double said = evaluate::total(evaluate::predict(page.law, rigs[i].rig));
    const double off = said / measured[i].error - 1;
    worst = std::max(worst, std::abs(off));
    std::printf("%9.2f %9.2f %+5.0f%%  %s\n", said, measured[i].error, 100 * off, rigs[i].name.c_str());
  }
  std::printf("Worst: %.0f %%. Each rig of the sweep by a fit to the others: %.0f %% (RMS).\n", 100 * worst,
              100 * page.law.spread);
}

void run_design(const DesignArguments& a) {
  report::DesignPage page;
  page.request = or_fail(request_of(a));
  const std::optional<evaluate::StandingRig> rig = or_fail(standing_rig(a.rig));
  std::vector<BenchFile> others;
  for (const std::string& file : a.machines) others.push_back(or_fail(read_bench_file(file)));
  std::vector<std::filesystem::path> inputs(a.machines.begin(), a.machines.end());
  for (const std::string& file : {a.rig, a.law})
    if (!file.empty()) inputs.emplace_back(file);
  const OutputRequest where{a.out, kDesign, inputs};
  if (!a.out.empty()) or_fail(OutputFolder::check(where));
  find_law(a, page);
  if (a.check) return print_check(a, page);
  if (rig) {
    constexpr std::size_t kPlaces = 5;
    const evaluate::TwinRig twin = twin_of(page.law, page.request, *rig);
    page.one_more = {*rig, predict(page.law, twin), next_cameras(page.law, twin, kPlaces)};
    page.extrapolated = evaluate::list_extrapolated(twin);
  } else {
    page.design = evaluate::design(page.law, page.request);
    page.extrapolated = evaluate::list_extrapolated(page.design.chosen.twin);
    if (page.design.reached) measure_costs(a, others, page);
  }
  if (!a.out.empty()) or_fail(report::write_design(page, where));
  if (a.json)
    std::printf("%s\n", report::design_json(page).dump().c_str());
  else
    std::printf("%s", report::design_summary(page).c_str());
  if (!rig && !page.design.reached)
    fail({ErrorKind::not_converged, fmt::format("no rig reaches {:g} grey levels", page.request.target),
          "--target-error",
          fmt::format("The best is predicted to reach {:.2f}, of which most is {}. Allow as much",
                      page.design.chosen.error(), report::shares_text(page.design.chosen.squares))});
}

void add_assumptions(const Verb& verb, DesignArguments& a) {
  evaluate::DesignRequest& r = a.request;
  verb.add_option("--tolerance", a.tolerance_ms, "Within which the cameras are aligned, ms to either side")
      .show_default();
  verb.add_option("--noise", r.noise, "RMS of a pixel at 4 ms exposure of a flame of 1800 K, grey levels")
      .show_default();
  verb.add_option("--lens", r.lens, "Its field of view, degrees across").show_default();
  verb.add_option("--most-cameras", r.most_cameras, "To consider").show_default();
  verb.add_option("--fps", a.rate, "Frames a second").show_default();
  verb.add_option("--seconds", a.seconds, "Of film, to record and to reconstruct").show_default();
  verb.add_option("--bytes-per-pixel", r.bytes_per_pixel, "As recorded").show_default();
  verb.add_option("--camera-price", r.camera_price, "Euros").show_default();
  verb.add_option("--host-link", a.host_link, "MB/s that a computer takes of all its cameras").show_default();
}

}  // namespace

void add_design(const Verb& app) {
  auto arguments = std::make_shared<DesignArguments>();
  DesignArguments& a = *arguments;
  const Verb verb = app.add_verb(
      "design",
      "Says before you buy how many cameras a flame needs, where they stand, and what it costs; with --rig, "
      "where one more camera helps most. Simulates small rigs, which takes about a minute.");
  verb.add_option("--flame", a.flame,
                  "Its height in metres, upward speed in m/s and temperature in K: 0.16,2,1800")
      .require();
  verb.add_option("--target-error", a.target, "Held-out RMS error to reach, grey levels");
  verb.add_option("--rig", a.rig, "rig.json: says where one more camera of this rig would do most");
  verb.add_option(
      "--law", a.law,
      "report.json of an earlier design: its simulated rigs serve any flame, so none is simulated");
  verb.add_option("--out", a.out, "Folder for report.html and report.json");
  verb.add_option(
          "--machine", a.machines,
          "What `emberlock bench --json` printed on another machine; give the option again for another")
      .take_one_value();
  verb.add_option("--disk", a.disk, "A place on the recordings' disk; what is written there is removed")
      .show_default();
  add_assumptions(verb, a);
  verb.add_option("--seed", a.seed, "Of the simulated flame, its noise and its times").show_default();
  verb.add_threads(a.threads);
  verb.add_flag("--check", a.check, "Measures five rigs that the law wasn't fitted to, beside its word");
  verb.add_flag("--json", a.json, "Prints report.json on stdout");
  verb.set_action([arguments] { run_design(*arguments); });
}

}  // namespace emberlock::cli
