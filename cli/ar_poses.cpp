// SPDX-License-Identifier: Apache-2.0
#include "cli/ar_poses.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

using From = apply::TrackedPose::From;

/// Of the film's beginning, for the error where the marker is nowhere.
constexpr std::size_t kLookedAt = 8;

Error nowhere(const ArFilm& film, const apply::Marker& marker, const recon::Intrinsics& lens,
              const std::vector<Image>& some) {
  for (const Image& frame : some)
    if (apply::is_mirrored(frame.view(), marker, lens))
      return {ErrorKind::bad_input,
              fmt::format("its frames show {} only in their mirror images", apply::marker_words(marker)),
              film.name(), "Switch the mirroring off that the camera's driver or program does"};
  for (const Image& frame : some) {
    const std::string others = apply::other_markers(frame.view(), lens);
    if (!others.empty())
      return {ErrorKind::bad_input,
              fmt::format("none of its frames shows {}, but {}", apply::marker_words(marker), others),
              film.name(), "Give the marker that lies there as --marker"};
  }
  return {ErrorKind::bad_input, fmt::format("none of its frames shows {}", apply::marker_words(marker)),
          film.name(), "Film it as a whole with its white margin, sharp, and 30 pixels wide or more"};
}

const char* word(From from) {
  switch (from) {
    case From::marker:
      return "marker";
    case From::prediction:
      return "prediction";
    case From::nothing:
      break;
  }
  return "nothing";
}

}  // namespace

std::size_t ArPoses::count(From from) const {
  return static_cast<std::size_t>(std::count_if(
      frames.begin(), frames.end(), [&](const apply::TrackedPose& pose) { return pose.from == from; }));
}

double ArPoses::rms() const {
  double sum = 0;
  for (const apply::TrackedPose& pose : frames)
    if (pose.from == From::marker) sum += pose.rms * pose.rms;
  const std::size_t seen = count(From::marker);
  return seen > 0 ? std::sqrt(sum / static_cast<double>(seen)) : 0;
}

Result<ArPoses> find_poses(ArFilm& film, const apply::Marker& marker, const recon::Intrinsics& lens,
                           const std::array<float, 256>& light) {
  const Progress bar = progress_bar("marker");
  const Interrupt interrupt;
  apply::PoseTrack track(lens);
  std::vector<apply::TrackStep> steps;
  std::vector<Image> some;
  const std::vector<Seconds>& times = film.times();
  for (std::size_t f = 0; f < times.size(); ++f) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, fmt::format("ended early, as asked, before frame {}", f), film.name()};
    Result<Image> frame = film.next();
    if (!frame && frame.error().kind == ErrorKind::out_of_data) break;
    if (!frame) return frame.error();
    tell(bar, static_cast<double>(f) / static_cast<double>(times.size()), fmt::format("frame {}", f));
    steps.push_back(track.see(times[f], apply::find_marker(frame->view(), marker, lens, &light)));
    if (f % std::max<std::size_t>(1, times.size() / kLookedAt) == 0 && some.size() < kLookedAt)
      some.push_back(std::move(*frame));
  }
  ArPoses poses{apply::smooth(steps, lens)};
  if (poses.count(From::marker) == 0) return nowhere(film, marker, lens, some);
  tell(bar, 1, "done");
  return poses;
}

Status write_poses(const std::filesystem::path& path, const ArFilm& film, const apply::Marker& marker,
                   const recon::Intrinsics& lens, const ArPoses& poses) {
  using nlohmann::ordered_json;
  const recon::Distortion& bent = lens.distortion;
  ordered_json frames = ordered_json::array();
  for (std::size_t f = 0; f < poses.frames.size(); ++f) {
    const apply::TrackedPose& pose = poses.frames[f];
    ordered_json frame{{"time_s", film.times()[f].value()}, {"from", word(pose.from)}};
    if (pose.from == From::marker) frame["residual_px"] = pose.rms;
    if (pose.from != From::nothing) {
      frame["shown"] = pose.shown;
      ordered_json rows = ordered_json::array();
      for (int r = 0; r < 3; ++r) {
        const auto& m = pose.camera_from_marker;
        rows.push_back({m.rotation(r, 0), m.rotation(r, 1), m.rotation(r, 2), m.translation[r]});
      }
      frame["camera_from_marker"] = std::move(rows);
    }
    frames.push_back(std::move(frame));
  }
  const ordered_json all{{"format", "emberlock ar poses"},
                         {"version", 1},
                         {"film", film.name()},
                         {"marker", apply::marker_words(marker)},
                         {"lens",
                          {{"width", lens.size.width},
                           {"height", lens.size.height},
                           {"fx", lens.fx},
                           {"fy", lens.fy},
                           {"cx", lens.cx},
                           {"cy", lens.cy},
                           {"k1", bent.k1},
                           {"k2", bent.k2},
                           {"p1", bent.p1},
                           {"p2", bent.p2},
                           {"k3", bent.k3}}},
                         {"residual_px", poses.rms()},
                         {"seen", poses.count(From::marker)},
                         {"predicted", poses.count(From::prediction)},
                         {"without", poses.count(From::nothing)},
                         {"frames", std::move(frames)}};
  return write_file_atomically(path, all.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace emberlock::cli
