// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "apply/stylize.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/sha256.h"
#include "cli/certificate_options.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/line_reader.h"
#include "cli/outputs.h"
#include "cli/progress_stream.h"
#include "cli/reconstruct_arguments.h"
#include "cli/stylize_stream.h"
#include "recon/export/picture.h"
#include "recon/preprocess/radiance.h"
#include "report/reconstruct_report.h"
#include "report/volume_axes.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct StylizeArguments {
  ReconstructArguments reconstruct;
  std::string edits, out, colours;
  std::optional<int> passes;
  bool live = false;
  bool previews = false;
  std::string view;  ///< of the previews
};

constexpr int kPassesAfterAnEdit = 60;
constexpr const char* kObjects = "objects";  // of a result

/// A run of a stylization: its steps from a file, or live, and what is shown of it.
class StylizeRun {
 public:
  StylizeRun(const StylizeArguments& arguments, apply::EditFile edits, apply::Stylization& stylization,
             const fs::path& folder, std::size_t view)
      : a_(arguments),
        edits_(std::move(edits)),
        stylization_(stylization),
        folder_(folder),
        view_(view),
        end_(edits_.passes) {}

  /// Until the file's passes are done, or after the last live edit.
  Status go() {
    const Progress bar = progress_bar("stylize");
    if (a_.live) lines_.emplace(STDIN_FILENO);
    while (!Interrupt::asked()) {
      EMBERLOCK_RETURN_IF_ERROR(take_from_file());
      if (a_.live) take_lines();
      if (stylization_.passes() >= end_) {
        if (!lines_ || lines_->ended()) break;
        lines_->wait(Seconds(0.1));
        continue;
      }
      EMBERLOCK_RETURN_IF_ERROR(pass());
      if (!a_.live)
        tell(bar, static_cast<double>(stylization_.passes()) / std::max(1, end_),
             fmt::format("pass {}", stylization_.passes()));
    }
    return {};
  }

 private:
  Status take_from_file() {
    const std::vector<apply::Step>& steps = edits_.steps;
    for (; next_ < steps.size() && steps[next_].pass <= stylization_.passes(); ++next_)
      EMBERLOCK_RETURN_IF_ERROR(stylization_.apply(steps[next_].operation));
    return {};
  }
  void take_lines() {
    for (const std::string& line : lines_->take()) {
      auto operation = apply::parse_operation(line, "a line of the input", fs::current_path());
      const Status taken =
          operation ? stylization_.apply(std::move(operation).value()) : Status(operation.error());
      ++taken_;
      if (taken.ok())
        end_ = std::max(end_, stylization_.passes() + a_.passes.value_or(kPassesAfterAnEdit));
      else
        std::fprintf(stderr, "emberlock: line %d is left out: %s\n", taken_, taken.error().message().c_str());
    }
  }
  Status pass() {
    EMBERLOCK_RETURN_IF_ERROR(stylization_.pass());
    std::string preview;
    if (a_.previews) {
      EMBERLOCK_ASSIGN_OR_RETURN(preview, write_preview());
    }
    if (!a_.live) return {};
    nlohmann::ordered_json told = {
        {"pass", stylization_.passes()}, {"residual", stylization_.residual()}, {"lines", taken_}};
    if (a_.previews) told["preview"] = preview;
    std::puts(told.dump().c_str());
    std::fflush(stdout);
    return {};
  }
  Result<std::string> write_preview() const {
    constexpr int kWidest = 320;
    const recon::RadianceImage seen = stylization_.preview(stylization_.shown(), view_, kWidest);
    const fs::path file = folder_ / "previews" / fmt::format("{:04}.png", stylization_.passes());
    EMBERLOCK_RETURN_IF_ERROR(recon::write_png(recon::to_rgb8(seen).view(), file));
    return file.string();
  }

  const StylizeArguments& a_;
  apply::EditFile edits_;
  apply::Stylization& stylization_;
  fs::path folder_;
  std::size_t view_;
  int end_;               // passes in all, as far as it is known
  std::size_t next_ = 0;  // of the file's steps
  int taken_ = 0;         // lines
  std::optional<LineReader> lines_;
};

/// Copies the objects' pictures into the result, unless they are there, and has the steps name them there.
Status keep_objects(apply::EditFile& edits, const fs::path& folder) {
  std::error_code ec;
  std::set<fs::path> kept;
  const auto keep = [&](fs::path& file, const std::string& hash, const char* what) -> Status {
    const bool there = file.parent_path() == folder / kObjects;
    const fs::path name = there ? file.filename() : fs::path(hash + what + file.extension().string());
    if (!there) {
      fs::create_directories(folder / kObjects, ec);
      fs::copy_file(file, folder / kObjects / name, fs::copy_options::overwrite_existing, ec);
      if (ec) return Error{ErrorKind::io, "can't be copied: " + ec.message(), file.string()};
    }
    file = fs::path(kObjects) / name;
    kept.insert(folder / file);
    return {};
  };
  for (apply::Step& step : edits.steps) {
    auto* const object = std::get_if<apply::ObjectEdit>(&step.operation);
    if (object == nullptr) continue;
    EMBERLOCK_RETURN_IF_ERROR(keep(object->file, object->hash, ""));
    if (object->mask) EMBERLOCK_RETURN_IF_ERROR(keep(*object->mask, object->hash, "-mask"));
  }
  // Those of steps that were refused.
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / kObjects, ec))
    if (!kept.contains(entry.path())) fs::remove(entry.path(), ec);
  if (kept.empty()) fs::remove(folder / kObjects, ec);
  return {};
}

/// The view of the previews: the one that was asked for, or that the first step edits, or the first.
Result<std::size_t> view_shown(const StylizeArguments& a, const apply::EditFile& edits,
                               const recon::Scene& scene) {
  std::string name = a.view;
  for (const apply::Step& step : edits.steps)
    if (const std::string* const of = apply::view_of(step.operation); name.empty() && of != nullptr)
      name = *of;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (name.empty() || scene.views[v].name == name) return v;
  return Error{ErrorKind::bad_input, "there is no view \"" + name + "\"", "--view",
               "Give a view's name, such as " + scene.views.front().name};
}

Result<apply::EditFile> edits_asked_for(const StylizeArguments& a) {
  apply::EditFile edits;
  if (!a.edits.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(edits, apply::read_edits(a.edits));
  }
  if (a.colours == "flame") edits.colours = apply::Colours::flame;
  if (a.colours == "captured") edits.colours = apply::Colours::captured;
  if (!edits.steps.empty() && a.passes)
    edits.passes = edits.steps.back().pass + *a.passes;
  else if (a.passes)
    edits.passes = *a.passes;
  return edits;
}

/// With the file's voxels, unless it leaves them open.
Result<recon::ReconstructOptions> options_with(const StylizeArguments& a, const apply::EditFile& edits) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions options, options_of(a.reconstruct));
  if (!edits.voxels) return options;
  if (options.voxels && options.voxels != edits.voxels)
    return Error{ErrorKind::bad_input, fmt::format("the edits were made of {} voxels", *edits.voxels),
                 "--voxels", "Leave it away"};
  options.voxels = edits.voxels;
  return options;
}

/// The edited pictures, numbered as the views are.
Status write_edited(const recon::Scene& captured, const recon::Scene& edited, const fs::path& folder) {
  std::error_code ec;
  for (std::size_t v = 0; v < edited.views.size(); ++v) {
    if (edited.views[v].image == captured.views[v].image) continue;
    fs::create_directory(folder, ec);
    EMBERLOCK_RETURN_IF_ERROR(recon::write_png(recon::to_rgb8(*edited.views[v].image).view(),
                                               folder / fmt::format("{:04}.png", v)));
  }
  return {};
}

/// What came out, certified with the steps that made it.
Result<recon::Report> write(const StylizeArguments& a, const recon::Scene& captured,
                            apply::Stylization& stylization, recon::Certification certification,
                            OutputFolder& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome outcome, stylization.outcome());
  std::optional<recon::TemperatureField> temperature;
  temperature.swap(outcome.temperature);  // whose errors the page would tell
  const std::string page = report::reconstruct_html(stylization.scene(), outcome);
  temperature.swap(outcome.temperature);
  apply::EditFile record = stylization.record();
  EMBERLOCK_RETURN_IF_ERROR(keep_objects(record, folder.path()));
  const std::string edits = apply::to_json(record);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder.path() / "edits.json", edits));
  v1::HashedFile& steps = *certification.certificate.add_made_from();
  steps.set_file("edits.json");
  steps.set_bytes(edits.size());
  steps.set_sha256(sha256(edits));
  EMBERLOCK_RETURN_IF_ERROR(recon::write_outcome_files(outcome, folder.path(), page, certification));
  EMBERLOCK_RETURN_IF_ERROR(write_edited(captured, stylization.scene(), folder.path() / "edited"));
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  std::FILE* const to = a.live ? stderr : stdout;
  std::fprintf(to, "%-16s %d, %zu steps\n", "passes", record.passes, record.steps.size());
  const recon::ChannelRmse& rmse = outcome.report.input_rmse;
  std::fprintf(to, "%-16s %.2f %.2f %.2f grey levels (R, G, B), of the edited pictures\n", "input views",
               rmse[0], rmse[1], rmse[2]);
  std::fprintf(to, "%-16s %s\n", "written to", a.out.c_str());
  return std::move(outcome.report);
}

/// Goes on behind `from`, by a file, by lines, or as another program says on stdin, which is told on
/// `stream`.
Status edit(const StylizeArguments& a, const apply::EditFile& edits, const recon::Scene& scene,
            const recon::Report& from, apply::Stylization& stylization, const fs::path& folder,
            ProgressStream* stream) {
  std::error_code ec;
  if (stream != nullptr) {
    fs::create_directories(folder / kObjects, ec);
    const recon::TracePoint last = from.trace.empty() ? recon::TracePoint() : from.trace.back();
    return StylizeStream(stylization, scene, last, a.passes.value_or(kPassesAfterAnEdit), folder / kObjects,
                         *stream)
        .run(STDIN_FILENO);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t view, view_shown(a, edits, scene));
  if (a.previews) fs::create_directory(folder / "previews", ec);
  return StylizeRun(a, edits, stylization, folder, view).go();
}

/// `stream`: of the program that asks; null: none does.
Status stylize(const StylizeArguments& a, ProgressStream* stream) {
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::EditFile edits, edits_asked_for(a));
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions options, options_with(a, edits));
  OutputRequest request{a.out, kStylize, inputs_of(a.reconstruct)};
  if (!a.edits.empty()) request.inputs.emplace_back(a.edits);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  Progress bar = progress_bar("reconstruct");
  if (stream != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device device, recon::resolve(options.solve.compute.device));
    stream->loading(device);
    bar = [stream](double fraction, std::string_view doing) { stream->progress(fraction, doing); };
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(a.reconstruct, bar));
  EMBERLOCK_RETURN_IF_ERROR(apply::check_edits(edits, scene, a.edits));
  EMBERLOCK_ASSIGN_OR_RETURN(Certified certified, certify(a.reconstruct, bar, Interrupt::asked));
  if (stream == nullptr) EMBERLOCK_RETURN_IF_ERROR(view_shown(a, edits, scene));
  const Interrupt interrupt;
  options.solve.stop = Interrupt::asked;
  const SteadyClock clock;
  std::function<void(const recon::Preview&)> preview;
  if (stream != nullptr)
    preview = [&](const recon::Preview& state) { stream->iteration(state, scene, options.solve.compute); };
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome begun, recon::reconstruct(scene, options, clock, bar, preview));
  begun.report.input = a.reconstruct.input;
  begun.report.up = report::shown_axes(scene.views).up_axis();
  EMBERLOCK_ASSIGN_OR_RETURN(
      const std::unique_ptr<apply::Stylization> stylization,
      apply::Stylization::begin(scene, begun, options.solve, edits.colours, recon::response_for({}, scene)));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  EMBERLOCK_RETURN_IF_ERROR(edit(a, edits, scene, begun.report, *stylization, folder.path(), stream));
  if (stream != nullptr) stream->progress(1, "writing the result");
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Report report,
                             write(a, scene, *stylization, std::move(certified.certification), folder));
  if (stream != nullptr) stream->written(report, a.out);
  return {};
}

void stylize_command(const StylizeArguments& a) {
  if (!a.reconstruct.progress_fd) return or_fail(stylize(a, nullptr));
  ProgressStream stream = or_fail(ProgressStream::open(*a.reconstruct.progress_fd));
  const Status done = stylize(a, &stream);
  if (done.ok()) return;
  stream.failed(done.error());
  fail(done.error());
}

}  // namespace

void add_stylize(const Verb& app) {
  auto arguments = std::make_shared<StylizeArguments>();
  StylizeArguments& a = *arguments;
  const Verb verb =
      app.add_verb("stylize", "Goes on with a reconstruction while its pictures and its volume are edited");
  verb.add_option("SCENE", a.reconstruct.input, "transforms.json, or a recorded session's folder").require();
  verb.add_option("--out", a.out,
                  "Folder for what reconstruct writes, the steps as edits.json, and edited pictures")
      .require();
  verb.add_option("--edits", a.edits,
                  "The steps, as apply/edit_file.h describes them, or an edits.json to be replayed");
  verb.add_flag(
      "--live", a.live,
      "Read further steps from stdin, a JSON object a line, that take effect before the next pass; "
      "a line of JSON on stdout tells of each pass, and where its preview is. Ends after the end of stdin");
  verb.add_option("--passes", a.passes,
                  "After the last step [the file's number in all, or 60]; live: after each")
      .check_range(0, 1000000);
  verb.add_option("--colours", a.colours,
                  "flame: green tells a temperature, and that the colour; captured: as reconstructed [the "
                  "file's, or flame]")
      .check_choices({"flame", "captured"});
  verb.add_flag("--previews", a.previews, "A picture after every pass, OUT/previews/0001.png and so on");
  verb.add_option("--progress-fd", a.reconstruct.progress_fd,
                  "For programs: take steps from stdin and tell of everything on this descriptor "
                  "(emberlock/v1/child.proto); end when the parent ends")
      .check_not_negative()
      .exclude("--edits")
      .exclude("--live")
      .exclude("--previews");
  verb.add_option("--view", a.view, "The view that previews show [the first that is edited]");
  verb.add_option("--rig", a.reconstruct.rig, "Sessions only: rig.json of `calibrate cameras`");
  verb.add_option("--box", a.reconstruct.box, "cx,cy,cz,sx,sy,sz: the volume's centre and size in metres");
  verb.add_option("--voxels", a.reconstruct.voxels, "Along the longest edge [the edits', or as reconstruct]");
  add_solve_options(verb, a.reconstruct);
  add_frame_options(verb, a.reconstruct);
  add_picture_options(verb, a.reconstruct);
  add_certificate_options(verb, a.reconstruct.certificate);
  verb.set_action([arguments, app] {
    arguments->reconstruct.certificate.program = app.version();
    if (arguments->reconstruct.last_frame)
      fail({ErrorKind::bad_input, "one frame is edited at a time", "--frames", "Give --frame"});
    stylize_command(*arguments);
  });
}

}  // namespace emberlock::cli
