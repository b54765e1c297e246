// SPDX-License-Identifier: Apache-2.0
#include "paper/evaluate_paper.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/output_folder.h"
#include "base/version.h"
#include "evaluate/option_range.h"
#include "paper/known_gas.h"
#include "paper/methods.h"
#include "paper/run_file.h"
#include "recon/preprocess/radiance.h"

namespace emberlock::paper {
namespace {

namespace fs = std::filesystem;
constexpr double kGasShare = 0.1;  // of the progress

/// One method on one case, before it is run.
struct Planned {
  const Protocol* protocol;
  const Case* of;
  Method method;
  recon::ComputeOptions compute;
};

class Evaluation {
 public:
  Evaluation(PaperEvaluation& done, fs::path folder, const Clock& clock, const Observer& observer)
      : done_(done), folder_(std::move(folder)), clock_(clock), observer_(observer) {}

  Status plan() {
    const recon::Device asked = done_.options.compute.device;
    recon::Device gpu = asked;
    if (asked == recon::Device::automatic && recon::resolve(recon::Device::cuda).ok() &&
        !recon::kGpuInSoftware)
      gpu = recon::Device::cuda;
    if (gpu == recon::Device::cuda) {
      EMBERLOCK_ASSIGN_OR_RETURN(gpu, recon::resolve(gpu));
    }
    for (const Protocol& protocol : done_.protocols)
      for (const Case& of : protocol.cases)
        for (const std::string_view name : protocol.methods) {
          if (!wanted(name)) continue;
          EMBERLOCK_ASSIGN_OR_RETURN(const Method method, find_method(name));
          recon::ComputeOptions compute = done_.options.compute;
          compute.device = recon::Device::cpu;
          plan_.push_back({&protocol, &of, method, compute});
          if (gpu != recon::Device::cuda || !runs_on_gpu(name)) continue;
          compute.device = gpu;
          plan_.push_back({&protocol, &of, method, compute});
        }
    if (!plan_.empty()) return {};
    return Error{ErrorKind::bad_input, "none of these methods takes part in these tables", "--methods",
                 "Choose others, or other tables by --only"};
  }

  Status run() {
    for (std::size_t i = 0; i < plan_.size(); ++i) {
      EMBERLOCK_RETURN_IF_ERROR(observe(
          observer_, share(i), fmt::format("run {} of {}: {}", i + 1, plan_.size(), words(plan_[i]))));
      EMBERLOCK_RETURN_IF_ERROR(run(plan_[i], i));
    }
    return {};
  }

 private:
  [[nodiscard]] bool wanted(std::string_view method) const {
    const auto& names = done_.options.methods;
    return names.empty() || std::find(names.begin(), names.end(), method) != names.end();
  }
  static bool runs_on_gpu(std::string_view method) {
    return method == kPapersMethod || method == kDefaultMethod;
  }
  static std::string words(const Planned& p) {
    return fmt::format("{}, {}", p.of->name, p.method.facts.name);
  }
  [[nodiscard]] double share(std::size_t done) const {
    return kGasShare + (1 - kGasShare) * static_cast<double>(done) / static_cast<double>(plan_.size());
  }
  [[nodiscard]] std::string settings() const {
    return fmt::format("{} cells, {} voxels, {}, seed {}, {}, version {}", *done_.options.cells,
                       *done_.options.voxels, done_.options.extent == Extent::full ? "full" : "quick",
                       done_.options.seed, done_.options.machine, version());
  }

  /// The gas of a subject: kept, from a file, or simulated.
  Result<const KnownGas*> gas_of(Subject subject, std::size_t at) {
    std::optional<KnownGas>& gas = gas_[static_cast<std::size_t>(subject)];
    if (gas) return &*gas;
    const fs::path file =
        folder_ / "truth" / fmt::format("{}-{}", name(subject), *done_.options.cells) / "truth.vdb";
    if (std::error_code ec; fs::exists(file, ec)) {
      EMBERLOCK_ASSIGN_OR_RETURN(gas, read_gas(subject, file, done_.options.compute));
      return &*gas;
    }
    const double from = at == 0 ? 0 : share(at);
    const Observer part = part_of(observer_, from, at == 0 ? kGasShare : from);
    EMBERLOCK_ASSIGN_OR_RETURN(gas, simulate_gas(subject, *done_.options.cells, done_.options.compute, part));
    EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder out, OutputFolder::create({file.parent_path(), kEvaluatePaper}));
    EMBERLOCK_RETURN_IF_ERROR(write_gas(*gas, out.path() / file.filename()));
    EMBERLOCK_RETURN_IF_ERROR(out.commit());
    return &*gas;
  }

  Status run(const Planned& planned, std::size_t at) {
    EMBERLOCK_ASSIGN_OR_RETURN(const KnownGas* gas, gas_of(planned.protocol->subject, at));
    if (planned.of->optics == Optics::papers) {
      if (!papers_) {
        EMBERLOCK_ASSIGN_OR_RETURN(papers_,
                                   as_the_paper_renders(*gas, *done_.options.voxels, done_.options.compute));
      }
      gas = &*papers_;
    }
    if (filmed_of_ != planned.of) {
      scene_ = film(*gas, *planned.of, done_.options.seed, done_.options.compute);
      filmed_of_ = planned.of;
      keep_pictures(planned);
    }
    MethodRun key;
    key.protocol = planned.protocol->name;
    key.of = planned.of->name;
    key.method = planned.method.facts.name;
    key.device = recon::name(planned.compute.device);
    const fs::path folder = folder_ / "runs" / folder_name(key);
    if (std::error_code ec; fs::exists(folder, ec)) {
      EMBERLOCK_ASSIGN_OR_RETURN(MethodRun before, read_run(folder, settings()));
      ++done_.taken_up;
      done_.runs.push_back(std::move(before));
      return {};
    }
    RunSettings run_settings{*done_.options.voxels, done_.options.seed, planned.compute, {}};
    bool asked = false;
    run_settings.stop = [&] {
      asked = asked || (observer_ && !observer_(share(at), words(planned)));
      return asked;
    };
    EMBERLOCK_ASSIGN_OR_RETURN(MethodRun run, run_method(*planned.protocol, *planned.of, planned.method, *gas,
                                                         scene_, run_settings, clock_));
    EMBERLOCK_RETURN_IF_ERROR(write_run(run, settings(), folder));
    done_.runs.push_back(std::move(run));
    return {};
  }

  void keep_pictures(const Planned& planned) {
    FilmedCase filmed{std::string(planned.protocol->name), planned.of->name, {}};
    int inputs = 0;
    int tests = 0;
    for (std::size_t v = 0; v < scene_.views.size(); ++v) {
      const bool input = scene_.views[v].role == recon::ViewRole::input;
      if ((input ? inputs++ : tests++) >= 2) continue;
      filmed.pictures.push_back(
          {fmt::format("{}-{}", input ? "input" : "test", v), recon::to_rgb8(*scene_.views[v].image)});
    }
    done_.filmed.push_back(std::move(filmed));
  }

  PaperEvaluation& done_;
  fs::path folder_;
  const Clock& clock_;
  const Observer& observer_;
  std::vector<Planned> plan_;
  std::array<std::optional<KnownGas>, 2> gas_;
  std::optional<KnownGas> papers_;  // the flame
  const Case* filmed_of_ = nullptr;
  recon::Scene scene_;
};

}  // namespace

Result<PaperEvaluation> evaluate_paper(const PaperOptions& options, const fs::path& folder,
                                       const Clock& clock, const Observer& observer) try {
  const TimePoint begin = clock.now();
  PaperEvaluation done;
  done.options = options;
  const bool full = options.extent == Extent::full;
  done.options.cells = options.cells.value_or(full ? PaperOptions::kCells : PaperOptions::kQuickCells);
  done.options.voxels = options.voxels.value_or(full ? PaperOptions::kVoxels : PaperOptions::kQuickVoxels);
  EMBERLOCK_RETURN_IF_ERROR(evaluate::in_range("--voxels", *done.options.voxels, 8, 256));
  EMBERLOCK_ASSIGN_OR_RETURN(done.protocols, choose_protocols(options.only, options.extent));
  for (const std::string& method : options.methods)
    if (const Result<Method> found = find_method(method); !found.ok()) return found.error();
  Evaluation evaluation(done, folder, clock, observer);
  EMBERLOCK_RETURN_IF_ERROR(evaluation.plan());
  EMBERLOCK_RETURN_IF_ERROR(evaluation.run());
  if (std::all_of(done.runs.begin(), done.runs.end(),
                  [](const MethodRun& run) { return !run.failed.empty(); }))
    return Error{ErrorKind::not_converged, "no method made anything of its pictures", folder.string(),
                 done.runs.front().failed};
  done.total = clock.now() - begin;
  return done;
} catch (const recon::DeviceError& error) {
  return error.error();
}

}  // namespace emberlock::paper
