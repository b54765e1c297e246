// SPDX-License-Identifier: Apache-2.0
#include "cli/frames_in_turn.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/output_folder.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "cli/reconstruct_files.h"
#include "cli/sequence_state.h"
#include "recon/adjust/picture_error.h"
#include "recon/batch/plan.h"
#include "recon/export/volume_file.h"
#include "recon/export/volume_kind.h"
#include "recon/pipeline/frame_sequence.h"
#include "recon/preprocess/radiance.h"
#include "recon/views/flame_mask.h"
#include "report/sequence_report.h"
#include "session/frame_range.h"
#include "session/media/frame_file.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using report::SequenceFrame;
using report::SequenceTold;

constexpr const char* kTold = "frames.json";
constexpr double kShareOfTelling = 0.05;  ///< at most, of the time that all takes

std::size_t failed(const SequenceTold& told) {
  return static_cast<std::size_t>(std::count_if(told.frames.begin(), told.frames.end(),
                                                [](const SequenceFrame& f) { return !f.error.empty(); }));
}

/// The views whose change over time is looked at: those held out, else the input ones.
std::vector<std::size_t> looked_at(const recon::Scene& scene) {
  std::vector<std::size_t> views;
  for (const recon::ViewRole role : {recon::ViewRole::held_out, recon::ViewRole::input}) {
    for (std::size_t v = 0; v < scene.views.size(); ++v)
      if (scene.views[v].role == role) views.push_back(v);
    if (!views.empty()) break;
  }
  return views;
}

class FramesInTurn {
 public:
  FramesInTurn(const ReconstructArguments& arguments, const std::vector<std::uint64_t>& frames,
               const SequenceWatch& watch)
      : arguments_(arguments), frames_(frames), watch_(watch), out_(arguments.out) {
    if (!arguments_.recording) arguments_.recording = std::make_shared<recon::SharedRecording>();
  }

  Result<SequenceTold> run() {
    std::error_code ec;
    EMBERLOCK_ASSIGN_OR_RETURN(const MadeFolders parents, MadeFolders::create(fs::absolute(out_, ec)));
    EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request()));
    EMBERLOCK_RETURN_IF_ERROR(take_up());
    const Status worked = work();
    const Status written = untold_ ? write() : Status();
    if (!worked) return worked.error();
    if (!written) return written.error();
    return told_;
  }

 private:
  Status work() {
    for (; at_ < frames_.size() && !watch_.stop() && !hopeless(); ++at_) {
      const bool tried = at_ < told_.frames.size();
      const bool done = tried && told_.frames[at_].error.empty();
      if (done && holds_volume(folder_of(frames_[at_]), told_.frames[at_]))
        continue;  // of an earlier run, and still what it would be
      if (done) remove_if_cut(folder_of(frames_[at_]) / "volume.vdb");
      EMBERLOCK_RETURN_IF_ERROR(go_on_behind_those_done());
      watch_.say(label() + (done    ? ", whose volume.vdb is missing or damaged"
                            : tried ? ", which failed before"
                                    : ""));
      EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<Status> ended, reconstruct(frames_[at_]));
      if (!ended) break;  // early: half a frame is none, and done again
      if (!ended->ok()) watch_.say(fmt::format("emberlock: {}: {}", label(), ended->error().message()));
      untold_ = true;
      if (clock_.now() >= write_again_) EMBERLOCK_RETURN_IF_ERROR(write());
    }
    return {};
  }

  [[nodiscard]] fs::path folder_of(std::uint64_t frame) const {
    return out_ / fmt::format("frame-{}", frame);
  }
  [[nodiscard]] OutputRequest request() const { return {out_ / "sequence", kSequence}; }
  [[nodiscard]] std::string label() const {
    return fmt::format("{} {} ({} of {})", arguments_.instants > 1 ? "instant" : "frame", frames_[at_],
                       at_ + 1, frames_.size());
  }
  [[nodiscard]] ReconstructArguments arguments_of(std::uint64_t frame) const {
    return cli::arguments_of(arguments_, frame, folder_of(frame));
  }

  [[nodiscard]] bool hopeless() const {
    return failed(told_) == told_.frames.size() && at_ >= session::kFailuresAtStart;
  }

  /// What the frame came to; nothing where it ended early. Error: a volume that can't be written, which is
  /// nothing of the frame's.
  Result<std::optional<Status>> reconstruct(std::uint64_t frame) {
    SequenceFrame row;
    row.frame = frame;
    const auto solve = [&](const recon::Scene& scene, const recon::ReconstructOptions& options, const Clock&,
                           const Progress& progress, const auto& preview) -> Result<recon::Outcome> {
      if (!sequence_) sequence_.emplace(options, clock_);
      const TimePoint begin = clock_.now();
      EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome outcome, sequence_->next(scene, progress, preview));
      behind_ = frame;
      if (sequence_->decided()) deciding_ = frame;
      row.reconstruction = clock_.now() - begin;
      describe(scene, outcome, row);
      return outcome;
    };
    const Result<Written> written =
        reconstruct_files(arguments_of(frame), {watch_.bar("reconstruct"), watch_.stop}, solve);
    if (!written) {
      if (watch_.stop()) return std::optional<Status>();
      if (behind_ == frame) return written.error();
      row = {};
      row.frame = frame;
      row.error = written.error().message();
      keep(row);
      return std::optional<Status>(written.error());
    }
    row.loading = written->loading;
    row.writing = written->writing;
    row.volume = listed_hash_of_volume(folder_of(frame));
    if (written->outcome.report.stopped) return std::optional<Status>();
    told_.instants = arguments_.instants;
    told_.voxels = written->outcome.report.voxel_choice.voxels;
    keep(row);
    EMBERLOCK_RETURN_IF_ERROR(link(frame));
    return std::optional(watch_.tell(*written, folder_of(frame)));
  }

  /// Frames of an earlier run behind one that failed then hold as long as it fails; once it is a volume they
  /// would start from that, and are done again, unless it is the same volume as before.
  void keep(const SequenceFrame& row) {
    const bool same =
        at_ < told_.frames.size() && !row.volume.empty() && told_.frames[at_].volume == row.volume;
    if (row.error.empty() && !same) told_.frames.resize(at_);
    if (at_ == told_.frames.size()) told_.frames.emplace_back();
    told_.frames[at_] = row;
  }

  /// What is told over time, and what the next frame's change is measured from.
  void describe(const recon::Scene& scene, const recon::Outcome& outcome, SequenceFrame& row) {
    row.start = name(sequence_->started_from());
    row.decided = sequence_->decided();
    row.iterations = outcome.report.iterations;
    row.input_rmse = recon::all_channels(outcome.report.input_rmse);
    if (outcome.report.heldout_rmse) row.heldout_rmse = recon::all_channels(*outcome.report.heldout_rmse);
    row.time = scene.time;
    row.light = recon::light_of(outcome.reconstruction.volume);
    std::vector<Image> renders;
    for (const std::size_t v : looked_at(scene)) renders.push_back(recon::to_rgb8(outcome.renders[v]));
    recon::ShownFrame shown = show(scene, std::move(renders));
    told_.held_out = outcome.report.heldout_rmse.has_value();
    if (told_.held_out) {
      row.psnr = row.ssim = 0;
      for (std::size_t v = 0; v < shown.pictures.size(); ++v) {
        *row.psnr +=
            recon::psnr(shown.pictures[v], shown.renders[v]) / static_cast<double>(shown.pictures.size());
        *row.ssim +=
            recon::ssim(shown.pictures[v], shown.renders[v]) / static_cast<double>(shown.pictures.size());
      }
    }
    if (last_shown_) row.flicker = recon::flicker(*last_shown_, shown);
    last_shown_ = std::move(shown);
  }
  static recon::ShownFrame show(const recon::Scene& scene, std::vector<Image> renders) {
    recon::ShownFrame shown;
    for (const std::size_t v : looked_at(scene)) {
      shown.pictures.push_back(recon::to_rgb8(*scene.views[v].image));
      shown.boxes.push_back(recon::noise_mask(*scene.views[v].image).box);
    }
    shown.renders = std::move(renders);
    return shown;
  }

  // --- going on after an interruption

  /// What an earlier run has done.
  Status take_up() {
    const fs::path path = request().target / kTold;
    if (std::error_code ec; fs::exists(path, ec)) {
      EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path));
      EMBERLOCK_ASSIGN_OR_RETURN(told_, report::parse_sequence(text, path.string()));
      if (failed(told_) == told_.frames.size()) told_ = {};  // nothing of it stays
      if (!told_.frames.empty()) EMBERLOCK_RETURN_IF_ERROR(check_same_run());
    }
    told_.session = arguments_.session;
    told_.options = arguments_.options;
    return {};
  }
  [[nodiscard]] Status check_same_run() const {
    if (told_.instants != arguments_.instants)
      return another(fmt::format("holds a sequence of {} instants a frame period", told_.instants));
    for (std::size_t i = 0; i < told_.frames.size(); ++i)
      if (i >= frames_.size() || told_.frames[i].frame != frames_[i])
        return another("holds a sequence of other frames");
    if (arguments_.session.empty()) return {};  // as a batch, which compares its plan
    if (told_.session.empty()) {
      watch_.say("An earlier version made the frames in " + out_.string() +
                 ": with which options isn't known, they are taken for the same");
      return {};
    }
    if (told_.session != arguments_.session)
      return another(
          fmt::format("holds frames of another session, {}, not {}", told_.session, arguments_.session));
    const std::string other = recon::other_option(told_.options, arguments_.options);
    return other.empty() ? Status() : another("holds frames of other options: " + other);
  }
  [[nodiscard]] Error another(std::string what) const {
    return {ErrorKind::bad_input, std::move(what), out_.string(),
            "Give what that run was given, to go on with it, or another --out, or remove this folder"};
  }
  /// The rest of a volume that was cut would stand in the way of the whole one.
  static void remove_if_cut(const fs::path& volume) {
    std::error_code ec;
    const auto kind = recon::kind_of_volume(volume);
    if (kind && *kind == recon::VolumeKind::cut_short) fs::remove(volume, ec);
  }

  /// The state in which the last volume before the next frame left the sequence.
  Status go_on_behind_those_done() {
    std::vector<std::uint64_t> volumes;
    std::uint64_t deciding = 0;
    for (std::size_t i = 0; i < at_; ++i) {
      const SequenceFrame& f = told_.frames[i];
      if (!f.error.empty()) continue;
      volumes.push_back(f.frame);
      if (f.decided) deciding = f.frame;
    }
    if (volumes.empty()) {
      sequence_.reset();
      last_shown_.reset();
      return {};
    }
    if (behind_ == volumes.back()) return {};
    watch_.say(fmt::format("{} of {} frames are done: going on behind frame {}",
                           told_.frames.size() - failed(told_), frames_.size(), volumes.back()));
    if (!sequence_ || deciding_ != deciding) {
      EMBERLOCK_RETURN_IF_ERROR(decide_again(deciding));
    }
    std::shared_ptr<const recon::Volume> before_last;
    if (volumes.size() > 1) {
      EMBERLOCK_ASSIGN_OR_RETURN(before_last, volume_of(volumes[volumes.size() - 2]));
    }
    EMBERLOCK_ASSIGN_OR_RETURN(auto last, volume_of(volumes.back()));
    sequence_->go_on_behind(std::move(before_last), std::move(last));
    EMBERLOCK_RETURN_IF_ERROR(look_at(volumes.back()));
    behind_ = volumes.back();
    return {};
  }
  [[nodiscard]] Result<std::shared_ptr<const recon::Volume>> volume_of(std::uint64_t frame) const {
    EMBERLOCK_ASSIGN_OR_RETURN(recon::Volume volume, recon::read_volume(folder_of(frame) / "volume.vdb"));
    return std::make_shared<const recon::Volume>(std::move(volume));
  }

  /// What a frame decided for the next ones; it must become the volume that it was.
  Status decide_again(std::uint64_t frame) {
    const ReconstructArguments anew = arguments_of(frame);
    EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions options, options_of(anew));
    if (options.voxels && *options.voxels != told_.voxels)
      return another(fmt::format("was made with {} voxels", told_.voxels));
    options.voxels = told_.voxels;
    options.solve.stop = watch_.stop;
    const Progress progress = watch_.bar(fmt::format("frame {} again", frame));
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(anew, progress));
    sequence_.emplace(options, clock_);
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome, sequence_->next(scene, progress));
    if (outcome.report.stopped) return Error{ErrorKind::refused, "ended early, as asked", out_.string()};
    deciding_ = frame;
    EMBERLOCK_ASSIGN_OR_RETURN(const auto was, volume_of(frame));
    const bool repeats = !options.solve.budget;  // what a clock ends never does
    if (repeats && (was->emission != outcome.reconstruction.volume.emission ||
                    was->extinction != outcome.reconstruction.volume.extinction))
      return another(fmt::format(
          "was made with other options or by another program: frame {}, done again, is not what it was",
          frame));
    return {};
  }

  /// The last frame, as its pictures and its rendered views are.
  Status look_at(std::uint64_t frame) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(arguments_of(frame), {}));
    std::vector<Image> renders;
    for (const std::size_t v : looked_at(scene)) {
      Result<Image> render = session::read_image(folder_of(frame) / "views" / fmt::format("{:04}.png", v));
      if (!render) {  // removed: how the next frame flickers isn't known then
        last_shown_.reset();
        return {};
      }
      renders.push_back(*std::move(render));
    }
    last_shown_ = show(scene, std::move(renders));
    return {};
  }

  // --- what is told of all

  /// Of all frames anew: where they are many it waits for its share of the time. A run that is killed does
  /// again what wasn't told.
  Status write() {
    const TimePoint begin = clock_.now();
    EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(request()));
    EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / kTold, report::sequence_json(told_)));
    EMBERLOCK_RETURN_IF_ERROR(
        write_file_atomically(staging.path() / "frames.csv", report::sequence_csv(told_)));
    EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "report.html",
                                                    report::sequence_html(told_, arguments_.input)));
    EMBERLOCK_RETURN_IF_ERROR(staging.commit());
    untold_ = false;
    const TimePoint end = clock_.now();
    write_again_ = end + (end - begin) * (1 / kShareOfTelling);
    return {};
  }

  /// OUT/volume_NNNN.vdb, as programs open a sequence.
  [[nodiscard]] Status link(std::uint64_t frame) const {
    const fs::path volume = fmt::format("frame-{}/volume.vdb", frame);
    const fs::path path = out_ / fmt::format("volume_{:04}.vdb", frame);
    std::error_code ec;
    if (fs::is_symlink(path, ec) && fs::read_symlink(path, ec) == volume) return {};
    fs::create_symlink(volume, path, ec);
    if (!ec) return {};
    return Error{ErrorKind::io, "can't link to " + volume.string() + ": " + ec.message(), path.string(),
                 "Move what is there away, or give an --out on a file system that has symbolic links"};
  }

  ReconstructArguments arguments_;
  const std::vector<std::uint64_t>& frames_;
  const SequenceWatch& watch_;
  fs::path out_;
  SteadyClock clock_;
  std::optional<recon::FrameSequence> sequence_;
  std::optional<recon::ShownFrame> last_shown_;
  std::optional<std::uint64_t> behind_;    ///< the last frame that sequence_ and last_shown_ know
  std::optional<std::uint64_t> deciding_;  ///< the one that sequence_ has its decisions of
  SequenceTold told_;                      ///< from at_ on, of an earlier run
  std::size_t at_ = 0;                     ///< the frame that is looked at, of frames_
  bool untold_ = false;                    ///< told_ holds what isn't written
  TimePoint write_again_{};                ///< not before
};

Status conclude(const SequenceTold& told, std::size_t frames, const fs::path& out) {
  for (const std::string& words : report::sequence_words(told))
    std::fprintf(stderr, "%-16s %s\n", "sequence", words.c_str());
  const std::size_t not_tried = frames - told.frames.size();
  if (failed(told) == 0 && not_tried == 0) {
    std::fprintf(stderr, "%-16s %s\n", "look at", (out / "sequence" / "report.html").c_str());
    return {};
  }
  const bool hopeless = failed(told) == told.frames.size() && told.frames.size() >= session::kFailuresAtStart;
  return Error{ErrorKind::refused,
               fmt::format("of {} frames {} failed and {} were not tried", frames, failed(told), not_tried),
               out.string(),
               not_tried > 0 && !hopeless
                   ? "The same command goes on where it ended, and tries again what failed"
                   : "Each of them is told above; where its cause is gone, the same command tries it again"};
}

}  // namespace

Result<SequenceTold> frames_in_turn(const ReconstructArguments& arguments,
                                    const std::vector<std::uint64_t>& frames, const SequenceWatch& watch) {
  return FramesInTurn(arguments, frames, watch).run();
}

void reconstruct_in_turn(const ReconstructArguments& arguments, const std::vector<std::uint64_t>& frames) {
  const SequenceWatch watch{
      Interrupt::asked, [](const std::string& words) { std::fprintf(stderr, "%s\n", words.c_str()); },
      progress_bar,
      [&](const Written& written, const fs::path& out) {
        return cli::conclude(written, {arguments.input, out.string(), arguments.by_daemon.json});
      }};
  const SequenceTold told = or_fail(frames_in_turn(arguments, frames, watch));
  or_fail(conclude(told, frames.size(), arguments.out));
}

}  // namespace emberlock::cli
