// SPDX-License-Identifier: Apache-2.0
#include "paper/run_file.h"

#include <cctype>
#include <cmath>
#include <exception>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "recon/export/picture.h"
#include "session/media/frame_file.h"

namespace emberlock::paper {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* kFile = "run.json";
constexpr const char* kFormat = "emberlock evaluation run";

Json json_of(const RunErrors& errors) {
  return {{"input", errors.input}, {"test", errors.test}, {"all", errors.all}, {"volume", errors.volume}};
}
RunErrors errors_from(const Json& json) {
  return {json.at("input"), json.at("test"), json.at("all"), json.at("volume")};
}

Json json_of(const TemperatureSlice& slice) {
  const auto whole = [](const std::vector<float>& kelvin) {
    std::vector<int> out;
    out.reserve(kelvin.size());
    for (const float k : kelvin) out.push_back(static_cast<int>(std::lround(k)));
    return out;
  };
  return {{"width", slice.size.width},
          {"height", slice.size.height},
          {"found", whole(slice.found)},
          {"truth", whole(slice.truth)}};
}
TemperatureSlice slice_from(const Json& json) {
  TemperatureSlice slice{{json.at("width"), json.at("height")}, json.at("found"), json.at("truth")};
  const std::size_t points =
      static_cast<std::size_t>(slice.size.width) * static_cast<std::size_t>(slice.size.height);
  if (slice.size.width < 0 || slice.size.height < 0 || slice.found.size() != points ||
      slice.truth.size() != points)
    throw std::runtime_error("the slice has another size than its values");
  return slice;
}

Json json_of(const MethodRun& run, const std::string& settings) {
  Json points = Json::array();
  for (const RunPoint& p : run.points)
    points.push_back(
        {{"iteration", p.iteration}, {"seconds", p.time.value()}, {"errors", json_of(p.errors)}});
  Json temperature = nullptr;
  if (const auto& t = run.temperature)
    temperature = {{"median", t->median}, {"most", t->most}, {"bias", t->bias}, {"told", t->told}};
  Json pictures = Json::array();
  for (const RunPicture& p : run.pictures) pictures.push_back(p.name);
  return {{"format", kFormat},
          {"version", 1},
          {"settings", settings},
          {"protocol", run.protocol},
          {"case", run.of},
          {"method", run.method},
          {"device", run.device},
          {"failed", run.failed},
          {"seconds", run.time.value()},
          {"iterations", run.iterations},
          {"chose", run.chose},
          {"errors", json_of(run.errors)},
          {"temperature", temperature},
          {"points", points},
          {"passes_failed", run.passes_failed},
          {"slice", run.slice ? json_of(*run.slice) : Json(nullptr)},
          {"pictures", pictures}};
}

MethodRun run_from(const Json& json) {
  MethodRun run;
  run.protocol = json.at("protocol");
  run.of = json.at("case");
  run.method = json.at("method");
  run.device = json.at("device");
  run.failed = json.at("failed");
  run.time = Seconds(json.at("seconds").get<double>());
  run.iterations = json.at("iterations");
  run.chose = json.at("chose");
  run.errors = errors_from(json.at("errors"));
  if (const Json& t = json.at("temperature"); !t.is_null())
    run.temperature = TemperatureErrors{t.at("median"), t.at("most"), t.at("bias"), t.at("told")};
  for (const Json& p : json.at("points"))
    run.points.push_back(
        {p.at("iteration"), Seconds(p.at("seconds").get<double>()), errors_from(p.at("errors"))});
  run.passes_failed = json.at("passes_failed");
  if (const Json& slice = json.at("slice"); !slice.is_null()) run.slice = slice_from(slice);
  for (const Json& name : json.at("pictures")) {
    const auto file = name.get<std::string>();
    if (file.find('/') != std::string::npos) throw std::runtime_error("a picture's name is a path");
    run.pictures.push_back({file, {}});
  }
  return run;
}

}  // namespace

std::string folder_name(const MethodRun& run) {
  std::string name = run.protocol + "." + run.of + "." + run.method + "." + run.device;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-') c = '-';
  return name;
}

Status write_run(const MethodRun& run, const std::string& settings, const std::filesystem::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder out, OutputFolder::create({folder, kEvaluatePaper}));
  for (const RunPicture& picture : run.pictures)
    EMBERLOCK_RETURN_IF_ERROR(recon::write_png(picture.image.view(), out.path() / (picture.name + ".png")));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(out.path() / kFile, run_json(run, settings)));
  return out.commit();
}

std::string run_json(const MethodRun& run, const std::string& settings) {
  return json_of(run, settings).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<MethodRun> parse_run(std::string_view text, const std::string& settings, const std::string& where) {
  const auto refused = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, where, "Give another --out, or remove this folder"};
  };
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kFormat || json.at("version") != 1) return refused("is no run of this version");
    if (json.at("settings") != settings)
      return refused("was made with other settings (" + json.at("settings").get<std::string>() + ")");
    return run_from(json);
  } catch (const std::exception& e) {
    return refused(e.what());
  }
}

Result<MethodRun> read_run(const std::filesystem::path& folder, const std::string& settings) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(folder / kFile));
  EMBERLOCK_ASSIGN_OR_RETURN(MethodRun run, parse_run(text, settings, (folder / kFile).string()));
  for (RunPicture& picture : run.pictures) {
    EMBERLOCK_ASSIGN_OR_RETURN(picture.image, session::read_image(folder / (picture.name + ".png")));
  }
  return run;
}

}  // namespace emberlock::paper
