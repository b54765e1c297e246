// SPDX-License-Identifier: Apache-2.0
#include "session/job_json.h"

#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

using Json = nlohmann::ordered_json;

Json to_json(const SessionCheck& check) {
  Json json{
      {"whole", check.whole()}, {"state", v1::Manifest::State_Name(check.state)}, {"events", check.events}};
  json["cameras"] = Json::array();
  for (const CameraCheck& c : check.cameras) {
    json["cameras"].push_back({{"id", c.camera_id},
                               {"recorded", c.recorded},
                               {"good", c.good},
                               {"bad", c.bad},
                               {"missing", c.missing},
                               {"unindexed", c.unindexed},
                               {"problems", c.problems}});
  }
  json["problems"] = check.problems;
  json["to_do"] = check.to_do;
  json["certified_files"] = check.certified_files;
  json["certified_by"] = check.certified_by;
  return json;
}

Json to_json(const RepairReport& report) {
  Json json{{"changed", report.changed}, {"events_kept", report.events_kept}};
  json["cameras"] = Json::array();
  for (const RepairedCamera& c : report.cameras) {
    json["cameras"].push_back({{"id", c.camera_id},
                               {"kept", c.kept},
                               {"found", c.found},
                               {"lost", c.lost},
                               {"rewritten", c.rewritten}});
  }
  return json;
}

Json to_json(const ExportReport& report) {
  Json json{{"cameras", Json::array()}};
  if (!report.codec.empty()) json["codec"] = report.codec;
  for (const ExportedCamera& c : report.cameras) {
    Json camera{{"id", c.camera_id},
                {"file", c.file},
                {"frames", c.frames},
                {"unreadable", c.unreadable},
                {"gaps", c.gaps}};
    if (!report.codec.empty()) {
      camera["repeated"] = c.repeated;
      camera["frame_rate_hz"] = c.frame_rate.value();
    }
    json["cameras"].push_back(std::move(camera));
  }
  return json;
}

std::string to_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace emberlock::session
