// SPDX-License-Identifier: Apache-2.0
#include "rig/align/record.h"

#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/file.h"
#include "base/nesting.h"
#include "drivers/replay/record.h"
#include "drivers/replay/replay.h"
#include "rig/align/decision_proto.h"
#include "rig/align/settings_proto.h"

namespace emberlock::rig {
namespace {

/// Answers as the clock of the recorded run did: once for each change of the strobe, reset and trim.
class RecordedAnswers final : public Clock {
 public:
  explicit RecordedAnswers(const std::vector<v1::Event>& events) {
    for (const v1::Event& event : events) {
      if (event.has_strobe() || event.has_reset() || event.has_trim())
        answers_.push_back({event.monotonic_ns()});
    }
  }
  /// Behind the last answer the replay has left the recorded course, which the devices report.
  [[nodiscard]] TimePoint now() const override {
    return next_ < answers_.size() ? answers_[next_++] : TimePoint{};
  }
  void sleep_until(TimePoint /*t*/) override {}

 private:
  std::vector<TimePoint> answers_;
  mutable std::size_t next_ = 0;
};

/// Whether a note holds an alignment's settings as JSON, as versions before 0.2.0 recorded them.
bool holds_settings(const std::string& note) {
  if (!check_json_nesting(note, "note").ok()) return false;
  const auto json = nlohmann::json::parse(note, nullptr, false);
  return json.is_object() && json.contains("align");
}

Result<AlignRunOptions> recorded_options(const session::SessionReader& session) {
  for (const v1::Event& event : session.events()) {
    if (event.has_settings()) return align_options(event.settings());
    if (event.has_note() && holds_settings(event.note()))
      return Error{ErrorKind::bad_input, "a version before 0.2.0 recorded this alignment",
                   session.folder().string(), "replay it with the version that recorded it"};
  }
  return Error{ErrorKind::bad_input, "holds no alignment's settings", session.folder().string(),
               "replay a recording that `emberlock align --record` made"};
}

/// Whether a round reads and decides what was recorded, in codes and numbers, bit for bit.
bool same_as_recorded(const v1::DecisionEvent& recorded, const AlignRoundReport& report) {
  return recorded.SerializeAsString() == to_proto(report).SerializeAsString();
}

/// Compares the decisions of a replay with the recorded ones, in order.
class DecisionCheck {
 public:
  explicit DecisionCheck(const session::SessionReader& session) : folder_(session.folder().string()) {
    for (const v1::Event& event : session.events()) {
      if (event.has_decision()) recorded_.push_back(event.decision());
    }
  }
  void round(const AlignRoundReport& report) {
    const std::size_t i = rounds_++;
    if (!different_ && (i >= recorded_.size() || !same_as_recorded(recorded_[i], report)))
      different_ = rounds_;
  }
  /// Every recorded decision was met: the run ended here, by its verdict or because it was stopped.
  [[nodiscard]] bool complete() const { return rounds_ >= recorded_.size(); }
  [[nodiscard]] Status verdict() const {
    if (!different_ && rounds_ == recorded_.size()) return {};
    return Error{ErrorKind::device,
                 "the decision of round " + std::to_string(different_.value_or(rounds_ + 1)) +
                     " differs from the recorded one",
                 folder_, "replay with the version that recorded the session"};
  }

 private:
  std::string folder_;
  std::vector<v1::DecisionEvent> recorded_;
  std::size_t rounds_ = 0;
  std::optional<std::size_t> different_;
};

}  // namespace

Result<AlignRunResult> record_align(const std::filesystem::path& folder, AlignRig rig,
                                    const AlignRunOptions& options, const AlignObserver& observer,
                                    const Progress& progress, const StopAsked& stop) {
  v1::Manifest manifest;
  manifest.set_purpose("alignment");
  manifest.set_created_utc(utc_now());
  manifest.set_session_id("alignment-" + manifest.created_utc());
  for (const drivers::Camera* camera : rig.cameras)
    *manifest.add_cameras() = drivers::to_proto(camera->info());
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionWriter session,
                             session::SessionWriter::create(folder, std::move(manifest)));
  // Encoded and written on threads of its own. A replay needs every frame.
  session::AsyncWriter writer(std::move(session), {.when_full = session::WhenFull::wait});
  rig.recorder = &writer;
  v1::Event settings;
  settings.set_monotonic_ns(rig.clock->now().ns);
  *settings.mutable_settings() = to_proto(options);
  EMBERLOCK_RETURN_IF_ERROR(writer.append(settings));
  Result<AlignRunResult> result = run_align(rig, options, observer, progress, stop);
  // A run that failed leaves a readable recording too; its own error is the one to report.
  const auto finished = writer.finish();
  if (result.ok() && !finished.ok()) return finished.error();
  return result;
}

Result<AlignRunResult> replay_align(const std::filesystem::path& folder, const AlignObserver& observer,
                                    const Progress& progress, std::uint64_t* seed) {
  EMBERLOCK_ASSIGN_OR_RETURN(const drivers::ReplayRig replay, drivers::ReplayRig::open(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const AlignRunOptions options, recorded_options(*replay.session));
  if (seed) *seed = options.seed;
  RecordedAnswers clock(replay.session->events());
  AlignRig rig{{}, replay.strobe.get(), &clock, nullptr};
  for (const auto& camera : replay.cameras) rig.cameras.push_back(camera.get());

  DecisionCheck check(*replay.session);
  const auto both = [&](const AlignRoundReport& report) {
    check.round(report);
    if (observer) observer(report);
  };
  EMBERLOCK_ASSIGN_OR_RETURN(AlignRunResult result,
                             run_align(rig, options, both, progress, [&] { return check.complete(); }));
  EMBERLOCK_RETURN_IF_ERROR(check.verdict());
  return result;
}

Result<std::vector<std::optional<smear::ResetDelay>>> read_delays(const std::filesystem::path& file,
                                                                  const AlignRig& rig) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file));
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, file.string(),
                 "delete the file: the next run learns the delays again"};
  };
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, file.string()));
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return refuse("is not a JSON object of cameras");
  std::vector<std::optional<smear::ResetDelay>> delays;
  for (const drivers::Camera* camera : rig.cameras) {
    const std::string& id = camera->info().id;
    delays.emplace_back();
    if (!json.contains(id)) continue;
    const auto& known = json[id];
    const auto field = [&](const char* key) {
      return known.is_object() && known.contains(key) && known[key].is_number() ? known[key].get<double>()
                                                                                : -1;
    };
    const smear::ResetDelay delay{Seconds(field("mean_s")), Seconds(field("sigma_s"))};
    if (delay.mean < Seconds(0) || delay.sigma <= Seconds(0)) {
      return refuse("camera " + id + " lacks a mean_s >= 0 or a sigma_s > 0");
    }
    delays.back() = delay;
  }
  return delays;
}

Status write_delays(const std::filesystem::path& file, const AlignRig& rig,
                    const std::vector<std::optional<smear::ResetDelay>>& delays) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < delays.size(); ++i) {
    if (!delays[i]) continue;
    json[rig.cameras[i]->info().id] = {{"mean_s", delays[i]->mean.value()},
                                       {"sigma_s", delays[i]->sigma.value()}};
  }
  return write_file_atomically(file, json.dump(2) + "\n");
}

}  // namespace emberlock::rig
