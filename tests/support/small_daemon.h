// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "daemon/engine/conductor.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::test {

/// Four simulated cameras of 320 x 240 and their strobe, on a clock of their own.
inline rig::DaemonConfig small_config(const std::filesystem::path& folder) {
  rig::DaemonConfig config;
  config.rig.name = "small";
  rig::CameraConfig cameras;
  cameras.count = 4;
  cameras.request.size = ImageSize{320, 240};
  config.rig.cameras.push_back(cameras);
  config.rig.virtual_rig.time = rig::VirtualConfig::Time::fast;
  config.rig.strobe.source = rig::StrobeSource::virtual_;
  config.recording.folder = folder / "sessions";
  config.recording.writer = small_disk_options(session::Encoding::raw_nut);
  config.alignment.tolerance = smear::Tolerance{Rows(30)};
  config.alignment.run.comb_frames = 12;
  return config;
}

/// A conductor with all that it works with, stepped by hand.
struct SmallDaemon {
  explicit SmallDaemon(rig::DaemonConfig setup, rig::RigOptions options = {}, rig::StopAsked stop = {})
      : config(std::move(setup)),
        store(session::SessionStore::open(config.recording.folder, {.min_free_bytes = 0}).value()),
        rig(rig::Rig::open(config.rig, std::move(options)).value()),
        geometry(rig::Geometry::of(config.rig, *rig).value()),
        reconstruction({}, board, jobs),
        live({.program = "no program"}, board),
        loan(rig->size()),
        conductor(std::in_place,
                  daemon::ConductorParts{*rig, geometry, config, store, reconstruction, live, loan, hosts,
                                         jobs, board},
                  std::move(stop)) {}

  /// Works until `done`, or for so many slices.
  bool work_until(const std::function<bool()>& done, int slices = 2000) {
    for (int i = 0; i < slices && !done(); ++i) {
      conductor->work();
      // A thread of its own finishes a recording: the rig's clock must not run on meanwhile.
      if (conductor->phase() == v1::FINISHING)
        wait_until([this] { return !jobs.find(v1::Job::FINISH, conductor->status().recording().session()); });
    }
    return done();
  }
  Result<v1::StrobeState> read_strobe() {
    return strobe_answer([this](const auto& answer) { conductor->read_strobe(answer); });
  }
  Result<v1::StrobeState> apply_strobe(const v1::StrobeState& wanted) {
    return strobe_answer([&](const auto& answer) { conductor->apply_strobe(wanted, answer); });
  }
  bool reach(v1::Phase phase, int slices = 2000) {
    return work_until([&] { return conductor->phase() == phase; }, slices);
  }
  /// Aligns the cameras, until they are locked.
  testing::AssertionResult locks(const v1::AlignRequest& request = {}) {
    const Status asked = conductor->align(request);
    if (!asked.ok()) return testing::AssertionFailure() << asked.error().message();
    if (!reach(v1::LOCKED)) return testing::AssertionFailure() << conductor->status().reason();
    return testing::AssertionSuccess();
  }
  /// Begins to record; without `seconds` until it is stopped.
  Status record(const std::string& name, double seconds = 0, bool unlocked = true) {
    v1::RecordRequest request;
    request.set_name(name);
    request.set_seconds(seconds);
    request.set_unlocked(unlocked);
    return conductor->record(request);
  }
  [[nodiscard]] const v1::Fault* fault(v1::Fault::Kind kind) {
    status = conductor->status();
    for (const v1::Fault& fault : status.faults())
      if (fault.kind() == kind) return &fault;
    return nullptr;
  }

  rig::DaemonConfig config;
  daemon::Board board;
  session::SessionStore store;
  std::unique_ptr<rig::Rig> rig;
  rig::Geometry geometry;
  daemon::ReconstructionChild reconstruction;
  daemon::LiveVolumes live;
  daemon::Loan loan;
  daemon::HostParts hosts;
  daemon::Jobs jobs;
  std::optional<daemon::Conductor> conductor;
  v1::DaemonStatus status;

 private:
  template <class Ask>
  Result<v1::StrobeState> strobe_answer(const Ask& ask) {
    std::optional<Result<v1::StrobeState>> answer;
    ask([&](Result<v1::StrobeState> made) { answer = std::move(made); });
    work_until([&] { return answer.has_value(); });
    return answer.value();
  }
};

}  // namespace emberlock::test
