// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/board_pictures.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <system_error>
#include <tuple>

#include "base/in_parallel.h"
#include "session/media/frame_file.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

constexpr std::array kPictureExtensions = {".png", ".pgm", ".ppm", ".tif", ".tiff", ".jpg", ".jpeg"};

Error bad_pictures(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

bool is_picture(const fs::path& path) {
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::any_of(kPictureExtensions.begin(), kPictureExtensions.end(),
                     [&](const char* known) { return extension == known; });
}

/// Splits a name into its text and the number at its end.
std::pair<std::string, std::string> part_name(const std::string& stem) {
  std::size_t digits = stem.size();
  while (digits > 0 && std::isdigit(static_cast<unsigned char>(stem[digits - 1])) != 0) --digits;
  std::size_t text = digits;
  while (text > 0 &&
         (stem[text - 1] == '_' || stem[text - 1] == '-' || stem[text - 1] == '.' || stem[text - 1] == ' '))
    --text;
  return {stem.substr(0, text), stem.substr(digits)};
}

BoardPicture loose_picture(const fs::path& path) {
  const auto [text, number] = part_name(path.stem().string());
  return {text.empty() ? "camera" : text, number, path};
}

Status list_folder(const fs::path& folder, std::vector<BoardPicture>& pictures) {
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder, ec)) {
    if (!entry.is_directory(ec)) {
      if (is_picture(entry.path())) pictures.push_back(loose_picture(entry.path()));
      continue;
    }
    for (const auto& inner : fs::directory_iterator(entry.path(), ec)) {
      if (inner.is_directory(ec) || !is_picture(inner.path())) continue;
      const std::string stem = inner.path().stem();
      const auto [text, number] = part_name(stem);
      pictures.push_back({entry.path().filename(), number.empty() ? stem : number, inner.path()});
    }
  }
  if (ec)
    return Error{ErrorKind::io, "can't be read: " + ec.message(), folder.string(), "Check its permissions"};
  return {};
}

struct Found {
  ImageSize size;
  std::vector<BoardCorner> corners;
  std::string unreadable;  ///< the reason
  bool mirrored = false;   ///< the board is only in the mirror image
};

std::vector<Found> find_in_all(const std::vector<BoardPicture>& pictures, const BoardSearch& search,
                               const Progress& progress) {
  std::vector<Found> found(pictures.size());
  const Observer observer = [&](double fraction, std::string_view what) {
    tell(progress, fraction, what);
    return true;
  };
  // The parts don't fail: an unreadable picture is reported with the others.
  (void)in_parallel(pictures.size(), observer, [&](std::size_t i, const Observer& part) -> Status {
    const auto picture = session::read_image(pictures[i].path);
    if (picture) {
      found[i].size = picture->layout().size;
      found[i].corners = search.find(picture->view());
      found[i].mirrored =
          found[i].corners.empty() && search.find_mirrored && search.find_mirrored(picture->view());
    } else {
      found[i].unreadable = picture.error().what;
    }
    return observe(part, 1, pictures[i].path.filename().string());
  });
  return found;
}

}  // namespace

Result<std::vector<BoardPicture>> list_board_pictures(const std::vector<fs::path>& inputs) {
  std::vector<BoardPicture> pictures;
  std::error_code ec;
  for (const fs::path& input : inputs) {
    if (fs::is_directory(input, ec)) {
      EMBERLOCK_RETURN_IF_ERROR(list_folder(input, pictures));
    } else if (fs::exists(input, ec)) {
      pictures.push_back(loose_picture(input));
    } else {
      return bad_pictures(input.string(), "isn't there",
                          "Name pictures, or a folder with a subfolder a camera");
    }
  }
  if (pictures.empty()) {
    return bad_pictures(
        inputs.empty() ? "pictures" : inputs.front().string(), "holds no picture",
        "Give PNG, PGM, PPM, TIFF or JPEG: a subfolder a camera, pictures of one instant named alike");
  }
  std::sort(pictures.begin(), pictures.end(), [](const BoardPicture& a, const BoardPicture& b) {
    return std::tie(a.camera, a.instant, a.path) < std::tie(b.camera, b.instant, b.path);
  });
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    const BoardPicture& a = pictures[i - 1];
    const BoardPicture& b = pictures[i];
    if (a.camera != b.camera || a.instant != b.instant) continue;
    return bad_pictures(b.path.string(), "is of the same camera and instant as " + a.path.string(),
                        "Number a camera's pictures, each instant once");
  }
  return pictures;
}

Result<BoardReading> find_boards(const std::vector<BoardPicture>& pictures, const BoardSearch& search,
                                 const Progress& progress) {
  std::vector<Found> found = find_in_all(pictures, search, progress);
  BoardReading reading;
  reading.sightings.board = search.board;
  std::map<std::string, std::size_t> cameras;
  std::map<std::string, std::size_t> instants;
  for (const BoardPicture& picture : pictures) instants.try_emplace(picture.instant);
  for (auto& [name, place] : instants) {
    place = reading.sightings.instants.size();
    reading.sightings.instants.push_back(name);
  }
  std::map<std::string, const BoardPicture*> first_of;
  const BoardPicture* mirrored = nullptr;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const BoardPicture& picture = pictures[i];
    if (!found[i].unreadable.empty()) {
      reading.unused.push_back({picture.path, found[i].unreadable});
      continue;
    }
    auto& all = reading.sightings.cameras;
    const auto [it, first] = cameras.try_emplace(picture.camera, all.size());
    if (first) {
      all.push_back({picture.camera, found[i].size});
      first_of[picture.camera] = &picture;
    }
    const ImageSize size = all[it->second].size;
    if (found[i].size != size) {
      const auto words = [](ImageSize s) {
        return std::to_string(s.width) + " x " + std::to_string(s.height);
      };
      return bad_pictures(picture.path.string(),
                          "has " + words(found[i].size) + " pixels, but " +
                              first_of[picture.camera]->path.string() + " of the same camera has " +
                              words(size),
                          "Calibrate a camera with pictures of one size: that which it records");
    }
    if (found[i].corners.empty()) {
      reading.unused.push_back({picture.path, found[i].mirrored
                                                  ? kMirroredBoard
                                                  : "the " + noun_of(search.board) + " wasn't found"});
      mirrored = found[i].mirrored && !mirrored ? &picture : mirrored;
      continue;
    }
    reading.sightings.sightings.push_back(
        {it->second, instants.at(picture.instant), picture.path.string(), std::move(found[i].corners)});
  }
  if (cameras.empty()) {
    return bad_pictures(pictures.front().path.string(),
                        "can't be read, nor any other picture: " + reading.unused[0].why,
                        "Give PNG, PGM, PPM, TIFF or JPEG pictures");
  }
  if (reading.sightings.sightings.empty() && mirrored)
    return bad_pictures(mirrored->path.string(), kMirroredBoard, kSwitchMirroringOff);
  return reading;
}

}  // namespace emberlock::recon
