// SPDX-License-Identifier: Apache-2.0
#include "cli/batch_run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/output_folder.h"
#include "cli/batch_progress.h"
#include "cli/batch_result.h"
#include "cli/commands.h"
#include "cli/frames_in_turn.h"
#include "cli/interrupt.h"
#include "cli/sequence_state.h"
#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"
#include "recon/batch/pulse.h"
#include "recon/pipeline/reconstruct.h"
#include "session/frame_range.h"
#include "session/reader.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using recon::BatchPlan;
using recon::Ledger;

constexpr const char* kGoesOn = "The same command goes on where it ended, on any number of ranks";
constexpr std::uint64_t kMostFramesOfBatch = 100'000;
constexpr const char* kMarkOfTelling = "told";  ///< in the ledger, where the report of all is written
constexpr const char* kOfSlurm = "slurm";       ///< `batch submit` puts it beside the ledger

/// The processors that this process may run on.
int allowed_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return ::sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

class BatchRank {
 public:
  BatchRank(const BatchArguments& arguments, const recon::Rank& rank)
      : arguments_(arguments), rank_(rank), out_(arguments.reconstruct.out) {
    arguments_.reconstruct.recording = std::make_shared<recon::SharedRecording>();
  }

  Status run() {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string device, choose_device());
    me_ = recon::Worker::here(rank_.number, device);
    EMBERLOCK_RETURN_IF_ERROR(agree_on_plan());
    for (const recon::Chunk& chunk : recon::chunks_of(plan_)) chunks_.emplace(chunk.name, chunk);
    std::vector<std::string> names;
    for (const auto& [name, chunk] : chunks_) names.push_back(name);
    ledger_.emplace(ledger_of(out_), std::move(names), me_.name());
    EMBERLOCK_RETURN_IF_ERROR(ledger_->restore_folders());
    EMBERLOCK_ASSIGN_OR_RETURN(pulse_, recon::Pulse::start(ledger_->folder() / "workers", me_,
                                                           Seconds(arguments_.patience_s), clock_));
    if (rank_.number == 0) {
      EMBERLOCK_RETURN_IF_ERROR(try_again_what_failed());
      progress_.emplace(*ledger_, plan_);
    }
    const Status worked = work_until_settled();
    const Status told = is_mine_to_tell() ? tell_of_all() : Status();
    if (!worked) {
      Error why = worked.error();
      why.remedy += std::string(why.remedy.empty() ? "" : ". ") + kGoesOn;
      return why;
    }
    return Interrupt::asked() && !ledger_->settled() ? Status(ended_early()) : told;
  }

 private:
  [[nodiscard]] Error ended_early() const {
    return {ErrorKind::refused, "ended early, as asked", out_.string(), kGoesOn};
  }

  // --- before the work

  /// Told to the solver, too.
  Result<std::string> choose_device() {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments_.reconstruct));
    EMBERLOCK_ASSIGN_OR_RETURN(
        const recon::Device device,
        recon::device_of(rank_, options.solve.compute.device, std::getenv("SLURM_GPUS_PER_TASK") != nullptr));
    arguments_.reconstruct.device = recon::name(device);
    if (arguments_.reconstruct.threads == 0)
      arguments_.reconstruct.threads = recon::threads_of(
          rank_, static_cast<int>(std::max(1L, ::sysconf(_SC_NPROCESSORS_ONLN))), allowed_cores());
    return arguments_.reconstruct.device;
  }

  /// The ledger's plan, made by the first rank where there is none.
  Status agree_on_plan() {
    EMBERLOCK_ASSIGN_OR_RETURN(const BatchPlan wanted, asked_plan(arguments_));
    const fs::path ledger = ledger_of(out_);
    EMBERLOCK_ASSIGN_OR_RETURN(std::optional<std::string> planned, wait_for_plan(ledger));
    if (!planned && Interrupt::asked()) return ended_early();
    if (!planned) {
      EMBERLOCK_RETURN_IF_ERROR(make_plan(wanted));
      EMBERLOCK_ASSIGN_OR_RETURN(planned, Ledger::read_plan(ledger));
    }
    if (!planned) return Error{ErrorKind::io, "its plan is gone", ledger.string()};
    EMBERLOCK_ASSIGN_OR_RETURN(plan_, recon::parse_plan(*planned, (ledger / "plan.json").string()));
    return recon::same_run(plan_, wanted, out_.string());  // it may have been made since wanted looked
  }

  /// Ranks behind the first wait for it to plan, unless it takes too long for one that lives.
  [[nodiscard]] Result<std::optional<std::string>> wait_for_plan(const fs::path& ledger) const {
    const Seconds patience(rank_.number == 0 ? 0 : 120);
    for (const TimePoint begin = clock_.now();;) {
      EMBERLOCK_ASSIGN_OR_RETURN(std::optional<std::string> plan, Ledger::read_plan(ledger));
      if (plan || Interrupt::asked() || clock_.now() - begin >= patience) return plan;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  Status make_plan(BatchPlan plan) {
    std::error_code ec;
    for (fs::directory_iterator it(out_, ec), end; !ec && it != end; it.increment(ec)) {
      const std::string name = it->path().filename().string();
      if (name != kOfSlurm && !name.starts_with("."))
        return Error{ErrorKind::bad_input, "holds \"" + name + "\", and no batch", out_.string(),
                     "Give a new --out, or move away what is there"};
    }
    if (plan.chunk == 0) plan.chunk = recon::usual_chunk(plan.frames.size());
    ReconstructArguments first = arguments_.reconstruct;
    first.frame = plan.frames.front();
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(first));
    if (options.voxels) {
      plan.voxels = *options.voxels;
    } else {
      const Progress progress = progress_bar("plan");
      EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(first, progress));
      EMBERLOCK_ASSIGN_OR_RETURN(const recon::VoxelChoice choice,
                                 recon::plan_voxels(scene, options, clock_, progress));
      plan.voxels = choice.voxels;
      for (const std::string& words : choice.words) say("voxels", words);
    }
    EMBERLOCK_ASSIGN_OR_RETURN(MadeFolders made, MadeFolders::create(fs::absolute(out_, ec)));
    std::vector<std::string> names;
    for (const recon::Chunk& chunk : recon::chunks_of(plan)) names.push_back(chunk.name);
    EMBERLOCK_RETURN_IF_ERROR(Ledger::create(ledger_of(out_), me_.name(), to_json(plan), names));
    made.keep();
    return {};
  }

  /// Chunks that were given up, or hold frames that failed or whose volume is no longer there.
  Status try_again_what_failed() {
    std::error_code ec;
    ledger_->forget_losses();
    fs::remove(ledger_->folder() / kMarkOfTelling, ec);
    for (const auto& [name, chunk] : chunks_) {
      const bool again = ledger_->done(name) ? !chunk_holds(ledger_->result(name), chunk.frames.size())
                                             : ledger_->given_up(name);
      if (again) EMBERLOCK_RETURN_IF_ERROR(ledger_->reopen(name));
    }
    return {};
  }

  // --- the work

  Status work_until_settled() {
    while (!Interrupt::asked()) {
      EMBERLOCK_ASSIGN_OR_RETURN(
          const auto claim, ledger_->take([&](const std::string& worker) { return pulse_->life_of(worker); },
                                          static_cast<std::size_t>(rank_.number)));
      if (claim) {
        if (!claim->from.empty())
          say("taken over", fmt::format("frames {}, of {}", claim->chunk, claim->from));
        EMBERLOCK_RETURN_IF_ERROR(work_on(*claim));
      } else if (ledger_->settled()) {
        break;
      } else {
        EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::string> missing, ledger_->restore_missing());
        for (const std::string& chunk : missing)
          say("again", fmt::format("frames {}: their result was removed", chunk));
        if (missing.empty()) wait_idly();
      }
    }
    return {};
  }

  /// Somebody works on the last ones, and might die.
  void wait_idly() {
    const TimePoint until = clock_.now() + recon::idle_wait(rank_, Seconds(arguments_.patience_s));
    do {
      if (progress_) progress_->show();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    } while (clock_.now() < until && !Interrupt::asked());
  }

  Status work_on(const Ledger::Claim& claim) {
    const recon::Chunk& chunk = chunks_.at(claim.chunk);
    const Result<bool> whole = reconstruct(claim, chunk);
    if (!whole || !*whole) {
      EMBERLOCK_RETURN_IF_ERROR(ledger_->give_back(claim));
      // Done by whoever took this rank for dead, who cleared this attempt away: no error of this one.
      return whole || Interrupt::asked() || ledger_->done(chunk.name) ? Status() : Status(whole.error());
    }
    EMBERLOCK_RETURN_IF_ERROR(ledger_->finish(claim));
    return link_volumes(out_, chunk);
  }

  /// Whether all of the chunk's frames came to something.
  Result<bool> reconstruct(const Ledger::Claim& claim, const recon::Chunk& chunk) {
    ReconstructArguments arguments = arguments_.reconstruct;
    arguments.out = claim.work.string();
    arguments.voxels = std::to_string(plan_.voxels);
    const SequenceWatch watch{Interrupt::asked, [](const std::string&) {},
                              [this](const std::string&) -> Progress {
                                if (!progress_) return {};
                                return [this](double, std::string_view) { progress_->show(); };
                              },
                              [](const Written&, const fs::path&) { return Status(); }};
    std::error_code ec;
    const bool goes_on = !fs::is_empty(claim.work, ec);
    Result<report::SequenceTold> told = frames_in_turn(arguments, chunk.frames, watch);
    if (!told && told.error().kind == ErrorKind::bad_input && goes_on) {  // such as by another device
      say("anew", fmt::format("frames {}: {}", chunk.name, told.error().message()));
      Ledger::empty(claim);
      told = frames_in_turn(arguments, chunk.frames, watch);
    }
    if (!told) return told.error();
    if (Interrupt::asked() && told->frames.size() < chunk.frames.size()) return false;
    for (const report::SequenceFrame& frame : told->frames) {
      if (!frame.error.empty()) say("failed", fmt::format("frame {}: {}", frame.frame, frame.error));
      // Whoever took this rank for dead has taken its first frames away.
      if (frame.error.empty() && !fs::exists(volume_in(claim.work, frame.frame), ec)) return false;
    }
    EMBERLOCK_RETURN_IF_ERROR(sign(claim.work, me_));
    return true;
  }

  // --- behind it

  /// Of all that is done one rank tells: the first that lives. Of a run that ended early the first one.
  [[nodiscard]] bool is_mine_to_tell() const {
    if (rank_.number == 0 || !ledger_->settled()) return rank_.number == 0;
    if (std::error_code ec; fs::exists(ledger_->folder() / kMarkOfTelling, ec)) return false;
    for (const auto& [name, worker] : recon::workers_in(ledger_->folder() / "workers"))
      if (worker.rank < rank_.number && pulse_->life_of(name) == recon::Life::alive) return false;
    return true;
  }

  Status tell_of_all() {
    EMBERLOCK_ASSIGN_OR_RETURN(const report::BatchTold told, told_of(*ledger_, plan_));
    for (const auto& [name, chunk] : chunks_) {
      if (!ledger_->done(name)) continue;
      EMBERLOCK_RETURN_IF_ERROR(link_volumes(out_, chunk));
    }
    EMBERLOCK_RETURN_IF_ERROR(write_batch_report(told, out_, arguments_.reconstruct.input));
    for (const std::string& words : batch_words(told)) say("batch", words);
    for (const std::string& words : sequence_words(told.sequence)) say("sequence", words);
    say("look at", (out_ / "sequence" / "report.html").string());
    if (!ledger_->settled()) return {};
    EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(ledger_->folder() / kMarkOfTelling, ""));
    ledger_->tidy();
    for (const auto& [name, worker] : recon::workers_in(ledger_->folder() / "workers")) {
      std::error_code ec;
      if (pulse_->life_of(name) != recon::Life::alive) fs::remove(ledger_->folder() / "workers" / name, ec);
    }
    if (told.volumes() == told.planned()) return {};
    return Error{ErrorKind::refused,
                 fmt::format("of {} frames {} failed and {} were given up", told.planned(), told.failed(),
                             told.planned() - told.failed() - told.volumes()),
                 out_.string(),
                 "Each of them is told above; where its cause is gone, the same command tries it again"};
  }

  void say(const char* what, const std::string& words) const {
    const std::string who = rank_.count > 1 ? fmt::format("rank {}: ", rank_.number) : "";
    std::fprintf(stderr, "%-16s %s%s\n", what, who.c_str(), words.c_str());
  }

  BatchArguments arguments_;
  recon::Rank rank_;
  fs::path out_;
  SteadyClock clock_;
  recon::Worker me_;
  BatchPlan plan_;
  std::map<std::string, recon::Chunk> chunks_;
  std::optional<Ledger> ledger_;
  std::unique_ptr<recon::Pulse> pulse_;
  std::optional<BatchProgress> progress_;  ///< of the first rank
};

}  // namespace

Result<BatchPlan> asked_plan(const BatchArguments& arguments) {
  const ReconstructArguments& asked = arguments.reconstruct;
  EMBERLOCK_RETURN_IF_ERROR(options_of(asked));
  EMBERLOCK_RETURN_IF_ERROR(check_apart(asked.out, {asked.input}));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto session, session::SessionReader::open(asked.input));
  const session::FrameRange range{asked.frame.value_or(0), asked.last_frame.value_or(0), asked.every};
  const std::uint64_t recorded = session.camera_count() == 0 ? 0 : session.stamps(0).size();
  BatchPlan plan;
  EMBERLOCK_ASSIGN_OR_RETURN(plan.frames,
                             session::frames_of(range, recorded, asked.range, kMostFramesOfBatch));
  plan.session = identity_of(session);
  plan.input = asked.input;
  plan.options = arguments.options;
  plan.chunk = arguments.chunk;
  const fs::path ledger = ledger_of(asked.out);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<std::string> planned, Ledger::read_plan(ledger));
  if (planned) {
    EMBERLOCK_ASSIGN_OR_RETURN(const BatchPlan is,
                               recon::parse_plan(*planned, (ledger / "plan.json").string()));
    EMBERLOCK_RETURN_IF_ERROR(recon::same_run(is, plan, asked.out));
  }
  return plan;
}

void run_batch_rank(const BatchArguments& arguments, const recon::Rank& rank) {
  const Interrupt interrupt(Interrupt::Heeds::termination_too);
  or_fail(BatchRank(arguments, rank).run());
}

}  // namespace emberlock::cli
