// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_readings.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/nesting.h"
#include "session/media/frame_file.h"
#include "session/reader.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

using PlanJson = nlohmann::json;

constexpr std::size_t kLargestPlan = std::size_t{16} << 20;

Error bad_plan(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<PatchPlace> parse_place(const PlanJson& json, const std::string& where) {
  constexpr int kMost = 65536;
  std::array<int, 4> v = {};
  const bool shaped =
      json.is_array() && json.size() == 4 && std::all_of(json.begin(), json.end(), [](const PlanJson& n) {
        return n.is_number_integer() && n >= 0 && n <= kMost;
      });
  if (shaped)
    std::transform(json.begin(), json.end(), v.begin(), [](const PlanJson& n) { return n.get<int>(); });
  if (!shaped || v[2] < 1 || v[3] < 1)
    return bad_plan(where, "is no rectangle of whole pixels", "Give [x, y, width, height]");
  return PatchPlace{v[0], v[1], v[2], v[3]};
}

Result<std::map<std::string, ColourPlan::Places>> parse_places(const PlanJson& json,
                                                               const std::string& where) {
  std::map<std::string, ColourPlan::Places> out;
  if (!json.is_object()) return bad_plan(where, "is no object", "Give rectangles by patch, by camera");
  for (const auto& [owner, places] : json.items()) {
    const std::string of_owner = fmt::format("{}.{}", where, owner);
    if (!places.is_object()) return bad_plan(of_owner, "is no object", "Give rectangles by patch");
    for (const auto& [patch, place] : places.items()) {
      EMBERLOCK_ASSIGN_OR_RETURN(out[owner][patch],
                                 parse_place(place, fmt::format("{}.{}", of_owner, patch)));
    }
  }
  return out;
}

Result<std::array<double, 3>> parse_radiance(const PlanJson& json, const std::string& where) {
  std::array<double, 3> out = {};
  const auto good = [](const PlanJson& n) {
    return n.is_number() && n.get<double>() > 0 && n.get<double>() < 1e9;
  };
  if (good(json)) {
    out.fill(json.get<double>());
    return out;
  }
  if (!json.is_array() || json.size() != 3 || !std::all_of(json.begin(), json.end(), good))
    return bad_plan(where, "is no radiance", "Give a number above 0, or three: [R, G, B]");
  for (std::size_t c = 0; c < 3; ++c) out[c] = json[c].get<double>();
  return out;
}

Result<std::map<std::string, std::map<std::string, std::size_t>>> parse_frames(const PlanJson& json,
                                                                               const std::string& where) {
  std::map<std::string, std::map<std::string, std::size_t>> out;
  if (!json.is_object()) return bad_plan(where, "is no object", "Give frames by name, by camera");
  for (const auto& [camera, frames] : json.items()) {
    const std::string of_camera = fmt::format("{}.{}", where, camera);
    if (!frames.is_object()) return bad_plan(of_camera, "is no object", "Give frames by name");
    for (const auto& [name, frame] : frames.items()) {
      if (!frame.is_number_unsigned())
        return bad_plan(fmt::format("{}.{}", of_camera, name), "is no frame", "Count frames from 0");
      out[camera][name] = frame.get<std::size_t>();
    }
  }
  return out;
}

enum class Purpose { dark, flat, target };
struct PicturePath {
  fs::path path;
  Purpose purpose = Purpose::target;
  std::string light;
  std::optional<double> exposure;
};

/// Interprets a file's name; nullopt for other files.
std::optional<PicturePath> by_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  PicturePath out{path, Purpose::target, {}, {}};
  if (stem.rfind("dark", 0) == 0) {
    out.purpose = Purpose::dark;
  } else if (stem.rfind("flat", 0) == 0) {
    out.purpose = Purpose::flat;
  } else if (stem.rfind("target", 0) != 0) {
    return std::nullopt;
  }
  std::size_t at = stem.find('_');
  while (at != std::string::npos) {
    const std::size_t next = stem.find('_', at + 1);
    const std::string word = stem.substr(at + 1, next == std::string::npos ? next : next - at - 1);
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (word.size() > 1 && end == word.c_str() + word.size() - 1 && *end == 's' && number > 0 &&
        std::isfinite(number))
      out.exposure = number;
    else
      out.light += (out.light.empty() ? "" : "_") + word;
    at = next;
  }
  return out;
}

/// Reads one camera's pictures into `readings`.
class CameraPictures {
 public:
  CameraPictures(const ColourPlan& plan, const fs::path& folder, ColourReadings& readings)
      : plan_(plan), folder_(folder), readings_(readings), index_(readings.cameras.size()) {
    readings_.cameras.push_back({folder.filename().string(), {}, 1.0 / 255, {}});
  }

  Status add(const PicturePath& picture, const Image& image) {
    ColourCamera& camera = readings_.cameras[index_];
    if (camera.size == ImageSize{}) {
      camera.size = image.layout().size;
      camera.step = 1.0 / image.layout().white();
      layout_ = image.layout();
    } else if (image.layout() != layout_) {
      return bad_plan(
          picture.path.string(),
          fmt::format("is {} x {} ({}), other pictures of camera {} are {} x {} ({})",
                      image.layout().size.width, image.layout().size.height, name(image.layout().format),
                      camera.id, camera.size.width, camera.size.height, name(layout_.format)),
          "Take all pictures of a camera with the settings it films with");
    }
    if (picture.purpose == Purpose::dark) return add_dark(image);
    if (picture.purpose == Purpose::flat) return add_flat(image, picture);
    return add_target(image, picture);
  }

  void finish() {
    if (!dark_.empty()) readings_.cameras[index_].dark = read_dark(dark_);
  }

 private:
  Status add_dark(const Image& image) {
    constexpr std::size_t kMost = 16;
    if (dark_.size() < kMost) dark_.push_back(image);
    return {};
  }
  Status add_flat(const Image& image, const PicturePath& picture) {
    for (PatchReading& patch : flat_patches(image.view(), picture_name(picture)))
      keep(std::move(patch), picture);
    readings_.flats.push_back(recon::read_flat(image.view()));
    readings_.flats.back().camera = index_;
    return {};
  }
  Status add_target(const Image& image, const PicturePath& picture) {
    const auto own = plan_.pictures.find(picture_name(picture));
    const auto usual = plan_.patches.find(folder_.filename().string());
    if (own == plan_.pictures.end() && usual == plan_.patches.end()) {
      return bad_plan("colour.json: patches." + folder_.filename().string(), "is absent",
                      "Say where this camera's pictures show the patches");
    }
    for (const auto& [patch, place] : own != plan_.pictures.end() ? own->second : usual->second) {
      if (place.x + place.width > image.layout().size.width ||
          place.y + place.height > image.layout().size.height) {
        return bad_plan(picture.path.string(), "patch " + patch + " lies outside the picture",
                        "Correct its rectangle in colour.json");
      }
      PatchReading reading = read_patch(image.view(), place);
      reading.patch = patch;
      keep(std::move(reading), picture);
    }
    return {};
  }
  void keep(PatchReading reading, const PicturePath& picture) {
    reading.camera = index_;
    reading.light = picture.light;
    reading.picture = picture_name(picture);
    reading.exposure = picture.exposure.value_or(1);
    readings_.patches.push_back(std::move(reading));
  }
  [[nodiscard]] std::string picture_name(const PicturePath& picture) const {
    return folder_.filename().string() + "/" + picture.path.filename().string();
  }

  const ColourPlan& plan_;
  fs::path folder_;
  ColourReadings& readings_;
  std::size_t index_;
  ImageLayout layout_;
  std::vector<Image> dark_;
};

Result<std::vector<PicturePath>> pictures_in(const fs::path& folder) {
  std::vector<PicturePath> out;
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder, ec)) {
    if (!entry.is_regular_file()) continue;
    if (auto picture = by_name(entry.path())) out.push_back(std::move(*picture));
  }
  if (ec) return Error{ErrorKind::io, ec.message(), folder.string(), "Check that it can be read"};
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return out;
}

/// Otherwise a picture without an exposure in its name would count as one second.
Status check_exposures(const std::vector<PicturePath>& pictures) {
  const PicturePath* told = nullptr;
  const PicturePath* silent = nullptr;
  for (const PicturePath& p : pictures)
    if (p.purpose == Purpose::target) (p.exposure ? told : silent) = &p;
  if (told == nullptr || silent == nullptr) return {};
  return bad_plan(silent->path.string(),
                  "doesn't tell its exposure, and " + told->path.filename().string() + " does",
                  "Name every target picture's exposure, as target_LIGHT_0.01s.png, or none's");
}

Status read_session(const ColourPlan& plan, const fs::path& folder, ColourReadings& readings) {
  const fs::path path = folder / plan.session;
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader session, session::SessionReader::open(path));
  for (const auto& [camera, frames] : plan.frames) {
    const std::string where = "colour.json: frames." + camera;
    const bool twice = std::any_of(readings.cameras.begin(), readings.cameras.end(),
                                   [&, &id = camera](const ColourCamera& c) { return c.id == id; });
    if (twice) return bad_plan(where, "has a folder of pictures too", "Give a camera's pictures in one way");
    const auto& streams = session.manifest().cameras();
    const auto stream = std::find_if(streams.begin(), streams.end(),
                                     [&, &id = camera](const auto& s) { return s.camera_id() == id; });
    if (stream == streams.end())
      return bad_plan(where, path.string() + " has no such camera", "Name the session's cameras");
    const auto index = static_cast<std::size_t>(stream - streams.begin());
    std::vector<PicturePath> pictures;
    for (const auto& [name, frame] : frames) {
      auto picture = by_name(folder / camera / (name + ".frame"));
      if (!picture)
        return bad_plan(fmt::format("{}.{}", where, name), "is neither dark, flat nor target",
                        "Name it as pictures are named");
      pictures.push_back(*std::move(picture));
    }
    EMBERLOCK_RETURN_IF_ERROR(check_exposures(pictures));
    CameraPictures into(plan, folder / camera, readings);
    auto picture = pictures.begin();
    for (const auto& [name, number] : frames) {
      if (number >= session.stamps(index).size()) {
        return bad_plan(fmt::format("{}.{}", where, name),
                        fmt::format("there are {} frames", session.stamps(index).size()),
                        "Count frames from 0");
      }
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, session.read(index, number));
      EMBERLOCK_RETURN_IF_ERROR(into.add(*picture++, *frame.image));
    }
    into.finish();
  }
  return {};
}

}  // namespace

Result<ColourPlan> parse_colour_plan(std::string_view text, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  const PlanJson json = PlanJson::parse(text, nullptr, false);
  if (!json.is_object())
    return bad_plan(where, "is no JSON object", "See `emberlock calibrate colour --help`");
  ColourPlan plan;
  for (const auto& [key, value] : json.items()) {
    const std::string field = fmt::format("{}: {}", where, key);
    if (key == "patches") {
      EMBERLOCK_ASSIGN_OR_RETURN(plan.patches, parse_places(value, field));
    } else if (key == "pictures") {
      EMBERLOCK_ASSIGN_OR_RETURN(plan.pictures, parse_places(value, field));
    } else if (key == "radiance") {
      if (!value.is_object()) return bad_plan(field, "is no object", "Give radiances by patch");
      for (const auto& [patch, radiance] : value.items()) {
        EMBERLOCK_ASSIGN_OR_RETURN(plan.radiance[patch],
                                   parse_radiance(radiance, fmt::format("{}.{}", field, patch)));
      }
    } else if (key == "frames") {
      EMBERLOCK_ASSIGN_OR_RETURN(plan.frames, parse_frames(value, field));
    } else if (key == "session" && value.is_string()) {
      plan.session = value.get<std::string>();
    } else {
      return bad_plan(field, "is no key of colour.json, or no text",
                      "Keys are patches, pictures, radiance, frames and session");
    }
  }
  if (plan.frames.empty() != plan.session.empty())
    return bad_plan(where, "has frames without session, or session without frames", "Give both, or neither");
  return plan;
}

Result<ColourReadings> read_colour_folder(const fs::path& folder, const Progress& progress) {
  std::error_code ec;
  if (!fs::is_directory(folder, ec))
    return bad_plan(folder.string(), "is no folder",
                    "Name the folder that holds colour.json and a folder for each camera");
  const fs::path plan_path = folder / "colour.json";
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(plan_path, kLargestPlan));
  EMBERLOCK_ASSIGN_OR_RETURN(const ColourPlan plan, parse_colour_plan(text, plan_path.string()));
  std::set<fs::path> cameras;
  for (const auto& entry : fs::directory_iterator(folder, ec))
    if (entry.is_directory()) cameras.insert(entry.path());
  ColourReadings readings;
  std::size_t done = 0;
  for (const fs::path& camera : cameras) {
    tell(progress, static_cast<double>(done++) / static_cast<double>(cameras.size()),
         "reading " + camera.filename().string());
    EMBERLOCK_ASSIGN_OR_RETURN(const auto pictures, pictures_in(camera));
    if (pictures.empty()) continue;
    EMBERLOCK_RETURN_IF_ERROR(check_exposures(pictures));
    CameraPictures into(plan, camera, readings);
    for (const PicturePath& picture : pictures) {
      EMBERLOCK_ASSIGN_OR_RETURN(const Image image, session::read_image(picture.path));
      EMBERLOCK_RETURN_IF_ERROR(into.add(picture, image));
    }
    into.finish();
  }
  if (!plan.frames.empty()) EMBERLOCK_RETURN_IF_ERROR(read_session(plan, folder, readings));
  if (readings.cameras.empty()) {
    return bad_plan(folder.string(), "no camera's folder holds a target*, flat* or dark* picture",
                    "Give each camera a folder with its pictures in it");
  }
  readings.radiance = plan.radiance;
  tell(progress, 1, "done");
  return readings;
}

}  // namespace emberlock::recon
