// SPDX-License-Identifier: Apache-2.0
// Writes what to time `emberlock ar` with, and measures its poses: a film of a marker that a hand holds a
// camera before, with truth, 640 x 480, with noise, five lost frames every three seconds, and a flame of
// 128^3 voxels.
//   bench_ar FOLDER [FRAMES]: FOLDER/film.mp4 (H.264 as players take it), lossless.mkv, blurred.mp4 (the
//     lens blurs by 1.5 px), rig.json, flame/ and truth.json
//   bench_ar --judge FOLDER OUT: how far OUT/poses.json is from FOLDER/truth.json
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apply/transfer.h"
#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "recon/hull/hull.h"
#include "recon/synthetic/flame.h"
#include "session/rig_file.h"
#include "session/video_writer.h"
#include "tests/support/marker_film.h"

namespace {

using namespace emberlock;
namespace fs = std::filesystem;

constexpr double kRate = 30;

recon::Intrinsics bench_lens() { return {{640, 480}, 600, 600, 318.3, 243.1, {-0.2, 0.05, 0, 0.001, 0}}; }

/// Lost for five frames every three seconds.
bool lost(int frame) { return frame % 90 >= 60 && frame % 90 < 65; }

bool write_flame(const fs::path& folder) {
  recon::FlameOptions options;
  options.absorber = recon::Absorber::soot;
  const recon::Grid grid = recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 128);
  fs::create_directories(folder);
  return recon::write_volume(recon::Flame(options).at(Seconds(0), grid).volume, folder / "volume.vdb").ok();
}

/// By a lens: light is blurred, not levels.
Image blurred(const Image& sharp, double sigma) {
  const apply::Transfer transfer(apply::Transfer::Curve::srgb);
  cv::Mat light(480, 640, CV_32FC3);
  auto* values = light.ptr<float>();
  for (std::size_t i = 0; i < sharp.bytes().size(); ++i)
    values[i] = transfer.light(static_cast<std::uint8_t>(sharp.bytes()[i]));
  cv::GaussianBlur(light, light, {}, sigma);
  Image image = sharp;
  for (std::size_t i = 0; i < image.bytes().size(); ++i)
    image.bytes()[i] = static_cast<std::byte>(transfer.level(values[i]));
  return image;
}

int write_films(const fs::path& folder, int frames) {
  if (!write_flame(folder / "flame")) return 1;
  const apply::Marker marker = test::usual_marker();
  const test::Plate plate(marker);
  const ImageLayout layout{{640, 480}, PixelFormat::rgb8, 8};
  using Coding = session::VideoWriter::Coding;
  auto film = session::VideoWriter::create(folder / "film.mp4", layout, Hertz(kRate));
  auto soft = session::VideoWriter::create(folder / "blurred.mp4", layout, Hertz(kRate));
  auto exact =
      session::VideoWriter::create(folder / "lossless.mkv", layout, Hertz(kRate), 0, Coding::lossless);
  if (!film || !soft || !exact) return 1;
  nlohmann::json truth = nlohmann::json::array();
  for (int f = 0; f < frames; ++f) {
    const recon::CameraModel camera = test::in_a_hand(bench_lens(), f / kRate);
    test::PlateLook look;
    look.noise = 3;
    look.seed = static_cast<std::uint64_t>(f);
    look.hidden = lost(f);
    const Image picture = plate.seen_by(camera, look);
    if (!(*film)->show(picture).ok() || !(*exact)->show(picture).ok() ||
        !(*soft)->show(blurred(picture, 1.5)).ok())
      return 1;
    nlohmann::json rows = nlohmann::json::array();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c)
        rows.push_back(c < 3 ? camera.camera_from_world.rotation(r, c)
                             : camera.camera_from_world.translation[r]);
    truth.push_back(rows);
  }
  if (!(*film)->close().ok() || !(*exact)->close().ok() || !(*soft)->close().ok()) return 1;
  std::ofstream(folder / "truth.json") << truth;
  v1::Rig rig = recon::empty_rig();
  *rig.add_cameras() = recon::rig_camera_of("hand", test::in_a_hand(bench_lens(), 0));
  return session::write_rig(folder / "rig.json", rig).ok() ? 0 : 1;
}

int judge(const fs::path& folder, const fs::path& out) {
  const nlohmann::json truth = nlohmann::json::parse(std::ifstream(folder / "truth.json"));
  const nlohmann::json poses = nlohmann::json::parse(std::ifstream(out / "poses.json"));
  const apply::Marker marker = test::usual_marker();
  double squares = 0;
  double worst = 0;
  double worst_lost = 0;
  double jump = 0;
  int count = 0;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (std::size_t f = 0; f < poses["frames"].size(); ++f) {
    const nlohmann::json& frame = poses["frames"][f];
    if (frame["from"] == "nothing") continue;
    recon::CameraModel camera{bench_lens(), {}};
    recon::Rigid3 pose;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        const double t = truth[f][static_cast<std::size_t>(4 * r + c)];
        const double p =
            frame["camera_from_marker"][static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
        (c < 3 ? camera.camera_from_world.rotation(r, c) : camera.camera_from_world.translation[r]) = t;
        (c < 3 ? pose.rotation(r, c) : pose.translation[r]) = p;
      }
    const double off = test::off_truth(marker, camera, pose);
    const Eigen::Vector2d foot = recon::CameraModel{bench_lens(), pose}.project(Eigen::Vector3d::Zero()) -
                                 camera.project(Eigen::Vector3d::Zero());
    if (count > 0) jump = std::max(jump, (foot - before).norm());
    before = foot;
    (lost(static_cast<int>(f)) ? worst_lost : worst) =
        std::max(lost(static_cast<int>(f)) ? worst_lost : worst, off);
    squares += off * off;
    ++count;
  }
  std::printf(
      "%d poses; corners off the truth: %.3f px (RMS), %.3f px at most, %.3f px in lost frames; "
      "the flame's foot jumps %.3f px at most\n",
      count, std::sqrt(squares / std::max(count, 1)), worst, worst_lost, jump);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 3 && words[0] == "--judge") return judge(words[1], words[2]);
  if (words.empty() || words.size() > 2)
    return std::fprintf(stderr, "usage: bench_ar FOLDER [FRAMES] | bench_ar --judge FOLDER OUT\n"), 2;
  return write_films(words[0], words.size() > 1 ? std::atoi(words[1].c_str()) : 180);
}
