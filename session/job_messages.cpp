// SPDX-License-Identifier: Apache-2.0
#include "session/job_messages.h"

#include <string>
#include <vector>

namespace emberlock::session {
namespace {

using Texts = google::protobuf::RepeatedPtrField<std::string>;

void put(const std::vector<std::string>& texts, Texts& into) {
  for (const std::string& text : texts) *into.Add() = text;
}

std::vector<std::string> strings(const Texts& texts) { return {texts.begin(), texts.end()}; }

}  // namespace

v1::JobOutcome to_outcome(const SalvageReport& report) {
  v1::JobOutcome outcome;
  outcome.set_ok(true);
  v1::SalvageReport& to = *outcome.mutable_salvage();
  for (const SalvagedCamera& camera : report.cameras) {
    v1::SalvageReport::Camera& one = *to.add_cameras();
    one.set_camera_id(camera.camera_id);
    one.set_kept(camera.kept);
    one.set_lost(camera.lost);
    one.set_found(camera.found);
  }
  to.set_events_kept(report.events_kept);
  to.set_changed(report.changed);
  return outcome;
}

v1::JobOutcome to_outcome(const SessionCheck& check) {
  v1::JobOutcome outcome;
  outcome.set_ok(check.whole());
  v1::VerifyReport& to = *outcome.mutable_verify();
  to.set_state(check.state);
  for (const CameraCheck& camera : check.cameras) {
    v1::VerifyReport::Camera& one = *to.add_cameras();
    one.set_camera_id(camera.camera_id);
    one.set_recorded(camera.recorded);
    one.set_good(camera.good);
    one.set_bad(camera.bad);
    one.set_missing(camera.missing);
    one.set_unindexed(camera.unindexed);
    put(camera.problems, *one.mutable_problems());
  }
  to.set_events(check.events);
  put(check.problems, *to.mutable_problems());
  to.set_to_do(check.to_do);
  to.set_certified_files(check.certified_files);
  to.set_certified_by(check.certified_by);
  return outcome;
}

v1::JobOutcome to_outcome(const RepairReport& report) {
  v1::JobOutcome outcome;
  outcome.set_ok(true);
  v1::RepairReport& to = *outcome.mutable_repair();
  for (const RepairedCamera& camera : report.cameras) {
    v1::RepairReport::Camera& one = *to.add_cameras();
    one.set_camera_id(camera.camera_id);
    one.set_kept(camera.kept);
    one.set_lost(camera.lost);
    one.set_found(camera.found);
    put(camera.rewritten, *one.mutable_rewritten());
  }
  to.set_events_kept(report.events_kept);
  to.set_changed(report.changed);
  return outcome;
}

v1::JobOutcome to_outcome(const ExportReport& report) {
  v1::JobOutcome outcome;
  outcome.set_ok(true);
  v1::ExportReport& to = *outcome.mutable_export_();
  for (const ExportedCamera& camera : report.cameras) {
    v1::ExportReport::Camera& one = *to.add_cameras();
    one.set_camera_id(camera.camera_id);
    one.set_file(camera.file);
    one.set_frames(camera.frames);
    one.set_unreadable(camera.unreadable);
    one.set_gaps(camera.gaps);
    one.set_repeated(camera.repeated);
    one.set_frame_rate_hz(camera.frame_rate.value());
  }
  to.set_codec(report.codec);
  return outcome;
}

SessionCheck from_proto(const v1::VerifyReport& report) {
  SessionCheck check;
  check.state = report.state();
  for (const auto& camera : report.cameras()) {
    check.cameras.push_back({camera.camera_id(), camera.recorded(), camera.good(), camera.bad(),
                             camera.missing(), camera.unindexed(), strings(camera.problems())});
  }
  check.events = report.events();
  check.problems = strings(report.problems());
  check.to_do = report.to_do();
  check.certified_files = report.certified_files();
  check.certified_by = report.certified_by();
  return check;
}

RepairReport from_proto(const v1::RepairReport& report) {
  RepairReport from;
  for (const auto& camera : report.cameras()) {
    from.cameras.push_back(
        {camera.camera_id(), camera.kept(), camera.lost(), camera.found(), strings(camera.rewritten())});
  }
  from.events_kept = report.events_kept();
  from.changed = report.changed();
  return from;
}

ExportReport from_proto(const v1::ExportReport& report) {
  ExportReport from;
  for (const auto& camera : report.cameras()) {
    from.cameras.push_back({camera.camera_id(), camera.file(), camera.frames(), camera.unreadable(),
                            camera.gaps(), camera.repeated(), Hertz(camera.frame_rate_hz())});
  }
  from.codec = report.codec();
  return from;
}

}  // namespace emberlock::session
