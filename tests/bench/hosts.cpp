// SPDX-License-Identifier: Apache-2.0
// How well cameras of several hosts are in sync, against those of one: the same number of simulated cameras
// at one emberlockd, and at one a host, each host in a network namespace of its own and with a clock of its
// own. Needs root.
//   bench_hosts --bin build/release/bin [--hosts 3] [--cameras 6] [--runs 20] [--tolerance 20rows] [--size
//   320x240]
// Each run starts all daemons anew, so that shutters stand anyhow, aligns, and records a second. Prints the
// worst pair as the alignment knows it and as it truly is (lab_hosts.h), and how long the alignment took; of
// all runs the means with their standard errors, and the known worst pair over the true one.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tests/support/lab_hosts.h"

namespace {

using namespace emberlock;
namespace fs = std::filesystem;

struct Arguments {
  std::string bin;
  int hosts = 3;
  int cameras = 6;
  int runs = 20;
  std::string tolerance = "20rows";
  std::string size = "320x240";
};

struct Run {
  bool aligned = false;
  double worst_pair_s = 0;
  double true_s = 0;
  double takes_s = 0;
};

/// Its hosts' cameras are shared out evenly.
std::optional<Run> align_once(const Arguments& a, int hosts, const fs::path& folder) {
  const test::HostNetwork network(hosts);
  if (!network.trouble().empty()) {
    std::fprintf(stderr, "%s\n", network.trouble().c_str());
    return std::nullopt;
  }
  const test::CertificateAuthority authority("who signs hosts");
  const test::LabHost::Programs programs{a.bin + "/emberlockd", a.bin + "/emberlock"};
  const auto make = [&](int number) {
    return std::make_unique<test::LabHost>(test::LabHost::Setup{folder, number, a.cameras / hosts, a.size},
                                           network, authority, programs);
  };
  const auto leader = make(0);
  std::vector<std::unique_ptr<test::LabHost>> others;
  for (int i = 1; i < hosts; ++i) {
    others.push_back(make(i));
    others.back()->lends();
  }
  leader->leads(others);
  leader->start();
  if (!leader->answers("status", "dome")) return std::nullopt;
  for (auto& other : others) other->start();
  const auto status = [&] {
    return nlohmann::json::parse(leader->client("status --json").output, nullptr, false);
  };
  for (bool all = false; !all;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const auto now = status();
    if (!now.is_object()) continue;
    all = true;
    for (const auto& camera : now["cameras"]) all = all && camera["state"] == "FILMING";
  }
  const auto began = std::chrono::steady_clock::now();
  const Shell aligned = leader->client("align --tolerance " + a.tolerance);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  if (aligned.status != 0) {
    std::fprintf(stderr, "%s\n", aligned.output.c_str());
    return Run{};
  }
  const double known = status()["alignment"].value("worst_pair_s", std::nan(""));
  const Shell recorded = leader->client("record take --seconds 1");
  if (recorded.status != 0) {
    std::fprintf(stderr, "%s\n", recorded.output.c_str());
    return std::nullopt;
  }
  std::vector<const test::LabHost*> labs{leader.get()};
  for (const auto& other : others) labs.push_back(other.get());
  return Run{true, known, test::true_worst_pair(labs, "take", Hertz(23.976)).value(), took.count()};
}

struct Mean {
  double mean = 0;
  double error = 0;
};
template <class Of>
Mean mean_of(const std::vector<Run>& runs, const Of& of) {
  Mean m;
  for (const Run& run : runs) m.mean += of(run) / static_cast<double>(runs.size());
  double squares = 0;
  for (const Run& run : runs) squares += std::pow(of(run) - m.mean, 2);
  const auto n = static_cast<double>(runs.size());
  m.error = std::sqrt(squares / (n - 1) / n);
  return m;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Cameras of several hosts against those of one"};
  Arguments a;
  app.add_option("--bin", a.bin)->required();
  app.add_option("--hosts", a.hosts)->check(CLI::Range(2, 6));
  app.add_option("--cameras", a.cameras)->check(CLI::Range(2, 24));
  app.add_option("--runs", a.runs)->check(CLI::Range(2, 10000));
  app.add_option("--tolerance", a.tolerance);
  app.add_option("--size", a.size);
  CLI11_PARSE(app, argc, argv);
  const fs::path folder = fs::temp_directory_path() / ("bench_hosts-" + std::to_string(::getpid()));
  std::vector<std::vector<Run>> all(2);
  std::vector<int> refused(2);
  for (int run = 0; run < a.runs; ++run)
    for (const int which : {0, 1}) {
      const auto done = align_once(a, which == 0 ? 1 : a.hosts, folder);
      fs::remove_all(folder);
      if (!done) return 1;
      refused[static_cast<std::size_t>(which)] += done->aligned ? 0 : 1;
      if (!done->aligned) continue;
      all[static_cast<std::size_t>(which)].push_back(*done);
      std::printf("%d host%s: worst pair %.3f ms, truly %.3f ms, %.1f s\n", which == 0 ? 1 : a.hosts,
                  which == 0 ? "" : "s", 1e3 * done->worst_pair_s, 1e3 * done->true_s, done->takes_s);
      std::fflush(stdout);
    }
  std::printf("given up: %d of %d on 1 host, %d on %d\n", refused[0], a.runs, refused[1], a.hosts);
  if (all[0].size() < 2 || all[1].size() < 2) return 1;
  const auto show = [&](const char* what, const auto& of, const char* unit) {
    const Mean one = mean_of(all[0], of);
    const Mean several = mean_of(all[1], of);
    std::printf("%s: %.3f +- %.3f%s on 1 host, %.3f +- %.3f%s on %d\n", what, one.mean, one.error, unit,
                several.mean, several.error, unit, a.hosts);
  };
  show(
      "worst pair, truly", [](const Run& r) { return 1e3 * r.true_s; }, " ms");
  show(
      "worst pair, known over true", [](const Run& r) { return r.worst_pair_s / r.true_s; }, "");
  show(
      "alignment takes", [](const Run& r) { return r.takes_s; }, " s");
}
