// SPDX-License-Identifier: Apache-2.0
#include "rig/sample/sample.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/in_parallel.h"
#include "base/random.h"
#include "base/time_point.h"
#include "recon/calibrate/carried_board.h"
#include "recon/export/picture.h"
#include "recon/synthetic/flame.h"
#include "rig/devices/stage.h"
#include "rig/sample/hand_film.h"
#include "session/video_writer.h"
#include "smear_sync/clocks/frame_code.h"

namespace emberlock::rig {
namespace {

namespace fs = std::filesystem;

constexpr Hertz kFilmRate(24000.0 / 1001);
constexpr Hertz kFlashRate(24.2);  // about 1 % beside the cameras' rate: the dots walk
constexpr Hertz kCombRate(300);
constexpr int kCombFrames = 48;
constexpr Seconds kFirstFrame(0.5);
constexpr Seconds kStrobeOff(10.5);
constexpr Seconds kFlameOn(11.0);
constexpr Seconds kApart = milliseconds(0.4);  // cameras that somebody aligned: at most so far from the first
constexpr int kLatestStart = 12;               // frames after the first camera
constexpr int kKeyInterval = 12;               // frames, as in cameras' own films
constexpr int kBoards = 30;
constexpr double kPictureNoise = 0.7;  // grey levels
constexpr int kFlameVoxels = 96;
constexpr double kBoxEdge = 0.15;  // metres; all cameras see it whole
constexpr Meters kFlameHeight(0.13);
constexpr Seconds kReadTime = milliseconds(39.36);  // of all rows: the comb's dots then stand between rows

enum SampleStream : std::uint64_t { kLensStream = 1, kBoardStream = 2, kStartStream = 3, kNoiseStream = 4 };

Status check(const SampleOptions& o) {
  const auto out_of_range = [](const char* option, const char* range) {
    return Error{ErrorKind::bad_input, "out of range", option, std::string("Choose ") + range};
  };
  if (o.cameras < 3 || o.cameras > 10) return out_of_range("--cameras", "3 to 10");
  if (o.image.width < 160 || o.image.width > 1280 || o.image.height < 120 || o.image.height > 720 ||
      o.image.width % 2 != 0 || o.image.height % 2 != 0)
    return out_of_range("--image", "even sides from 160x120 to 1280x720");
  if (o.flame_frames < 1 || o.flame_frames > 240) return out_of_range("--frames", "1 to 240");
  return {};
}

/// What is filmed. The world of the ring has the flame at its origin and z up.
struct Scenery {
  std::vector<recon::CameraModel> ring;
  std::vector<recon::Rigid3> ring_from_board;  ///< by instant; the first board is the calibrated world
};

recon::CameraModel in_world(const recon::CameraModel& camera, const recon::Rigid3& ring_from_world) {
  const recon::Rigid3& c = camera.camera_from_world;
  return {camera.intrinsics, {c.rotation * ring_from_world.rotation, c * ring_from_world.translation}};
}

int count_seen(const Scenery& scenery, const recon::Board& board, const recon::Rigid3& pose) {
  return static_cast<int>(std::count_if(
      scenery.ring.begin(), scenery.ring.end(),
      [&](const recon::CameraModel& camera) { return !recon::seen_corners(camera, board, pose).empty(); }));
}

Scenery draw_scenery(const SampleOptions& options, const recon::Board& board) {
  RandomStream lenses(options.seed, kLensStream);
  Scenery scenery{recon::ring_cameras(options.cameras, options.image, lenses), {}};
  // The cameras stand 36 degrees apart; the first board looks at the middle of them.
  const double arc = std::numbers::pi / 5 * (options.cameras - 1);
  scenery.ring_from_board.push_back(recon::upright_board(board, arc / 2));
  RandomStream random(options.seed, kBoardStream);
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));  // all sides alike
  for (int i = 0; static_cast<int>(scenery.ring_from_board.size()) < kBoards && i < 100 * kBoards; ++i) {
    const recon::Rigid3 pose = recon::carried_board(board, golden_angle * i, random);
    if (count_seen(scenery, board, pose) >= 2) scenery.ring_from_board.push_back(pose);
  }
  return scenery;
}

Status write_boards(const SampleOptions& options, const Scenery& scenery, const recon::Board& board,
                    const fs::path& folder, const Observer& observer) {
  std::error_code error;
  for (std::size_t c = 0; c < scenery.ring.size(); ++c)
    fs::create_directories(folder / fmt::format("board/camera-{}", c), error);
  const auto photograph = [&](std::size_t instant, const Observer& part) -> Status {
    const recon::Rigid3& pose = scenery.ring_from_board[instant];
    for (std::size_t c = 0; c < scenery.ring.size(); ++c) {
      if (recon::seen_corners(scenery.ring[c], board, pose).empty()) continue;
      Image picture = recon::board_picture(scenery.ring[c], board, pose);
      RandomStream noise(random_bits(options.seed, kNoiseStream, instant), c);
      auto* pixels = picture.row_as<std::uint8_t>(0);
      for (std::size_t i = 0; i < picture.bytes().size(); ++i)
        pixels[i] = static_cast<std::uint8_t>(
            std::clamp(std::lround(pixels[i] + noise.normal(0, kPictureNoise)), 0L, 255L));
      const fs::path file = folder / fmt::format("board/camera-{}/{:02}.png", c, instant);
      EMBERLOCK_RETURN_IF_ERROR(recon::write_png(picture.view(), file));
      EMBERLOCK_RETURN_IF_ERROR(observe(part,
                                        static_cast<double>(c + 1) / static_cast<double>(scenery.ring.size()),
                                        "photographing the board"));
    }
    return {};
  };
  return in_parallel(scenery.ring_from_board.size(), observer, photograph);
}

/// Cameras that were aligned once, so their read phases begin nearly together, and then filmed: started by
/// hand, whole frames apart.
HandFilm draw_film(const SampleOptions& options, const Stage& stage) {
  drivers::VirtualRigDraw draw;
  draw.cameras = options.cameras;
  draw.seed = options.seed;
  draw.layout = {options.image, PixelFormat::rgb8, 8};
  draw.rate = kFilmRate;
  draw.row_time = kReadTime / Rows(options.image.height);
  HandFilm film{drivers::draw_virtual_rig(draw), {}};
  film.strobe = {.output = drivers::StrobeOutput::flashing,
                 .rate = kFlashRate,
                 .code = smear::flash_pattern(smear::FrameCode{}).value()};
  film.strobe_off = kStrobeOff;
  recon::FlameOptions flame;
  flame.seed = options.seed;
  flame.height = kFlameHeight;
  film.later =
      LaterScene{kFlameOn, drivers::flame_scene(std::make_shared<FlameLight>(stage, flame, kFlameVoxels))};
  RandomStream random(options.seed, kStartStream);
  for (int c = 0; c < options.cameras; ++c) {
    drivers::VirtualCameraOptions& camera = film.rig.cameras[static_cast<std::size_t>(c)];
    camera.id = fmt::format("camera-{}", c);
    camera.first_phase = Seconds(0);
    const int later = c == 0 ? 0 : static_cast<int>(random.uniform(0, kLatestStart + 1));
    const Seconds apart(c == 0 ? 0 : random.uniform(-kApart.value(), kApart.value()));
    film.starts.push_back(kFirstFrame + later * period(kFilmRate) + apart);
  }
  return film;
}

/// Films into `folder`/ID.mp4, so many frames with each camera; by camera, when its frames were read.
Result<std::vector<std::vector<TimePoint>>> write_films(const HandFilm& film, const std::vector<int>& frames,
                                                        const fs::path& folder, const Observer& observer) {
  std::error_code error;
  fs::create_directories(folder, error);
  std::vector<std::unique_ptr<session::VideoWriter>> videos;
  for (const drivers::VirtualCameraOptions& camera : film.rig.cameras) {
    EMBERLOCK_ASSIGN_OR_RETURN(
        auto video,
        session::VideoWriter::create(folder / (camera.id + ".mp4"), camera.layout, kFilmRate, kKeyInterval));
    videos.push_back(std::move(video));
  }
  std::vector<std::vector<TimePoint>> reads(videos.size());
  const auto take = [&](std::size_t c, const Frame& frame, TimePoint read) -> Result<double> {
    reads[c].push_back(read);
    EMBERLOCK_RETURN_IF_ERROR(videos[c]->show(*frame.image));
    const double filmed = static_cast<double>(reads[c].size()) / static_cast<double>(frames[c]);
    if (filmed >= 1) {
      EMBERLOCK_RETURN_IF_ERROR(videos[c]->close());
    }
    return filmed;
  };
  EMBERLOCK_RETURN_IF_ERROR(film_by_hand(film, take, observer));
  return reads;
}

/// The first camera alone, under the comb.
HandFilm comb_of(const HandFilm& film) {
  HandFilm comb{film.rig, film.strobe};
  comb.rig.cameras.resize(1);
  comb.strobe.rate = kCombRate;
  comb.strobe.code.clear();
  return comb;
}

/// Until the flame has burnt for its frames; the first camera's film begins first.
std::vector<int> film_lengths(const HandFilm& film, int flame_frames) {
  const Seconds end = kFlameOn + flame_frames * period(kFilmRate);
  std::vector<int> frames;
  for (const Seconds start : film.starts)
    frames.push_back(static_cast<int>(std::lround((end - start) / period(kFilmRate))));
  return frames;
}

/// What is true of the films, at the first frame of the flame.
void fill_truth(const HandFilm& film, const std::vector<std::vector<TimePoint>>& reads, Sample& sample) {
  const auto lit = std::find_if(reads[0].begin(), reads[0].end(),
                                [](TimePoint read) { return read >= TimePoint{} + kFlameOn; });
  const TimePoint flame = lit == reads[0].end() ? reads[0].back() : *lit;
  const auto place = [&](std::size_t c) {
    const auto nearest = std::min_element(reads[c].begin(), reads[c].end(), [&](TimePoint a, TimePoint b) {
      return abs(a - flame) < abs(b - flame);
    });
    return static_cast<int>(nearest - reads[c].begin());
  };
  const Seconds reference = film.rig.cameras[0].timing.frame_period;
  for (std::size_t c = 0; c < reads.size(); ++c) {
    SampleCamera& camera = sample.cameras[c];
    const smear::CcdTiming& timing = film.rig.cameras[c].timing;
    camera.id = film.rig.cameras[c].id;
    camera.film = "films/" + camera.id + ".mp4";
    camera.frames = static_cast<int>(reads[c].size());
    camera.frame_offset = place(c) - place(0);
    camera.late = reads[c][static_cast<std::size_t>(place(c))] - flame;
    camera.drift = PartsPerMillion((reference / timing.frame_period - 1) * 1e6);
    camera.row_time = timing.row_time;
  }
}

nlohmann::ordered_json camera_json(const SampleCamera& camera) {
  const recon::Intrinsics& lens = camera.model.intrinsics;
  const recon::Rigid3& pose = camera.model.camera_from_world;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (int r = 0; r < 3; ++r)
    rows.push_back({pose.rotation(r, 0), pose.rotation(r, 1), pose.rotation(r, 2), pose.translation(r)});
  const Eigen::Vector3d center = camera.model.center();
  const recon::Distortion& d = lens.distortion;
  return {{"id", camera.id},
          {"film", camera.film},
          {"frames", camera.frames},
          {"frame_offset", camera.frame_offset},
          {"late_ms", in_milliseconds(camera.late)},
          {"drift_ppm", camera.drift.value()},
          {"row_time_us", camera.row_time.value() * 1e6},
          {"fx", lens.fx},
          {"fy", lens.fy},
          {"cx", lens.cx},
          {"cy", lens.cy},
          {"distortion", {d.k1, d.k2, d.p1, d.p2, d.k3}},
          {"center_m", {center.x(), center.y(), center.z()}},
          {"camera_from_world", rows}};
}

std::string truth_json(const Sample& sample) {
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const SampleCamera& camera : sample.cameras) cameras.push_back(camera_json(camera));
  const Eigen::Vector3d& center = sample.box.center;
  const Eigen::Vector3d& size = sample.box.size;
  const nlohmann::ordered_json truth = {
      {"flash_rate_hz", sample.flash_rate.value()},
      {"comb_rate_hz", sample.comb_rate.value()},
      {"strobe_off_s", (kStrobeOff - kFirstFrame).value()},
      {"flame_lit_s", (kFlameOn - kFirstFrame).value()},
      {"board", recon::board_words(sample.board)},
      {"world", sample.world},
      {"box",
       {{"center_m", {center.x(), center.y(), center.z()}}, {"size_m", {size.x(), size.y(), size.z()}}}},
      {"flame",
       {{"seed", sample.options.seed},
        {"height_m", kFlameHeight.value()},
        {"rise_speed_m_s", recon::FlameOptions().rise_speed},
        {"extinction_per_m", recon::FlameOptions().extinction.value()}}},
      {"cameras", cameras}};
  return truth.dump(2) + "\n";
}

}  // namespace

Result<Sample> make_sample(const SampleOptions& options, const fs::path& folder, const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Board board, recon::parse_board("chessboard:9x6:18mm"));
  const Scenery scenery = draw_scenery(options, board);
  const recon::Rigid3 ring_from_world = scenery.ring_from_board.front();
  Sample sample{options, kFlashRate, kCombRate, board, "00", {}, {}};
  sample.box = {ring_from_world.inverse().translation, Eigen::Vector3d::Constant(kBoxEdge)};
  for (const recon::CameraModel& camera : scenery.ring) {
    sample.cameras.emplace_back();
    sample.cameras.back().model = in_world(camera, ring_from_world);
  }
  EMBERLOCK_RETURN_IF_ERROR(write_boards(options, scenery, board, folder, part_of(observer, 0, 0.2)));
  const Stage stage{{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kBoxEdge)}, scenery.ring};
  const HandFilm film = draw_film(options, stage);
  EMBERLOCK_RETURN_IF_ERROR(
      write_films(comb_of(film), {kCombFrames}, folder / "comb", part_of(observer, 0.2, 0.25)));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto reads,
                             write_films(film, film_lengths(film, options.flame_frames), folder / "films",
                                         part_of(observer, 0.25, kNearlyDone)));
  fill_truth(film, reads, sample);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "truth.json", truth_json(sample)));
  return sample;
}

}  // namespace emberlock::rig
