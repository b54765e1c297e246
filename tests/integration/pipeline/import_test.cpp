// SPDX-License-Identifier: Apache-2.0
// `emberlock import` on films that virtual cameras made of a strobe and then a flame, and on what people give
// it by mistake.
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "films/import_run.h"
#include "report/import_report.h"
#include "session/media/frame_file.h"
#include "session/reader.h"
#include "session/rig_file.h"
#include "session/shutter_times.h"
#include "session/verify.h"
#include "tests/support/import_clips.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"
#include "tests/support/video_writer.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const smear::FrameCode kImportCode{.words = 8, .spacing = 60};

/// Three cameras, started within a second, that filmed the strobe for ten seconds and then a flame.
class ImportFilms : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new test::TempFolder;
    drivers::VirtualRigDraw model;
    model.layout.size = {320, 240};
    model.row_time = microseconds_per_row(160);
    test::FlameFilm film{test::random_film(43, 3, model, kImportCode), Seconds(11)};
    film.strobe.format = {};
    film.strobe.format.gop = 12;
    film.strobe.format.crf = 20;
    film.strobe.suffix = ".mp4";
    film.strobe.starts = {0.3, 0.9, 0.1};
    film.strobe.frames = 340;
    clips_ = new std::vector(test::film_flame(film, *shared_ / "films"));
    comb_ = test::film_strobe(test::comb_of(film.strobe, 0, 36), shared_->path())[0].file;
    flash_rate_ = film.strobe.strobe.rate;
    row_time_ = film.strobe.rig.cameras[0].timing.row_time;
  }
  static void TearDownTestSuite() {
    delete clips_;
    delete shared_;
  }

  films::ImportOptions options() const {
    films::ImportOptions options;
    options.folder = *shared_ / "films";
    options.out = folder_ / "session";
    options.alignment = films::Alignment::strobe;
    options.clip.flash_rate = flash_rate_;
    options.clip.code = kImportCode;
    options.comb = comb_;
    options.comb_rate = Hertz(300);
    options.min_free_bytes = 0;
    return options;
  }
  /// The films as links in a folder of the test's own, so that some may be replaced.
  fs::path own_films() const {
    fs::create_directories(folder_ / "films");
    for (const auto& clip : *clips_)
      fs::create_symlink(clip.file, folder_ / "films" / fs::path(clip.file).filename());
    return folder_ / "films";
  }
  static std::string refusal(const films::ImportOptions& options) {
    const auto result = films::run_import(options, {}, report::reports_of);
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : result.error().message();
  }

  inline static test::TempFolder* shared_ = nullptr;
  inline static std::vector<test::FlameClip>* clips_ = nullptr;
  inline static std::string comb_;
  inline static Hertz flash_rate_;
  inline static SecondsPerRow row_time_;
  test::TempFolder folder_;
};

TEST_F(ImportFilms, BecomeASessionOfTheFramesThatBelongTogetherEachWithItsTime) {
  const auto result = films::run_import(options(), {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  auto session = session::SessionReader::open(folder_ / "session");
  ASSERT_TRUE(session.ok()) << session.error().message();
  ASSERT_EQ(session->camera_count(), 3U);
  const auto times = session::read_shutter_times(*session);
  ASSERT_TRUE(times.ok() && times->has_value());
  // The flame's 3.5 s, less the second or so by which the films' ends differ.
  EXPECT_GT(result->instants, 60);
  for (std::size_t c = 0; c < 3; ++c) {
    const test::FlameClip& truth = (*clips_)[c];
    const test::FlameClip& reference = (*clips_)[0];
    const auto& entry = (*times)->cameras(static_cast<int>(c));
    EXPECT_EQ(entry.camera_id(), fs::path(truth.file).stem());
    const std::int64_t first = result->cameras[c].first;
    EXPECT_GT(truth.read_starts[first], TimePoint{} + Seconds(11)) << "still the strobe";
    EXPECT_LT(truth.read_starts[first], TimePoint{} + Seconds(11.2)) << "flame was thrown away";
    const auto film = session::FrameFile::open(truth.file).value();
    for (std::int64_t i = 0; i < first; ++i) ASSERT_TRUE(film->next().ok());
    for (std::int64_t i = 0; i < result->instants; ++i) {
      const Seconds late = truth.read_starts[first + i] - reference.read_starts[result->cameras[0].first + i];
      ASSERT_NEAR(entry.late_s(static_cast<int>(i)), late.value(), 5 * entry.sigma_s() + 1e-6)
          << c << " " << i;
      ASSERT_LT(std::abs(late.value()), 0.021);
      const auto frame = session->read(c, static_cast<std::size_t>(i));
      ASSERT_TRUE(frame.ok()) << frame.error().message();
      ASSERT_EQ(frame->stamp.frame_id, static_cast<std::uint64_t>(i));
      ASSERT_EQ(*frame->image, film->next().value()) << "camera " << c << ", frame " << i;
    }
    EXPECT_LT(entry.sigma_s(), 100e-6);
  }
  EXPECT_TRUE(session::verify_session(folder_ / "session")->whole());
  EXPECT_FALSE(fs::exists(folder_ / "session.importing"));
}

TEST_F(ImportFilms, SayByTheVerbWhatBecameOfThem) {
  const std::vector<std::string> words{"import",         (*shared_ / "films").string(),
                                       "--out",          (folder_ / "session").string(),
                                       "--flash-rate",   fmt::format("{}", flash_rate_.value()),
                                       "--comb",         comb_,
                                       "--comb-rate",    "300",
                                       "--code-words",   "8",
                                       "--code-spacing", "60",
                                       "--camera",       "left=camera-1.mp4",
                                       "--grey",         "--json"};
  const auto run = test::run_verb(add_import, words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json.at("cameras").size(), 3U);
  EXPECT_EQ(json.at("cameras")[2].at("id"), "left");
  EXPECT_EQ(json.at("aligned_by"), "strobe");
  EXPECT_EQ(session::SessionReader::open(folder_ / "session")->layout(0).format, PixelFormat::gray8);
  const std::string page = read_file(folder_ / "session/import.html").value();
  const auto& left = json.at("cameras")[2];
  for (const std::string& said :
       {fmt::format("3 cameras, {} instants", json.at("instants").get<int>()),
        std::string("--camera says so"), fmt::format("{:+d}", left.at("frame_offset").get<int>()),
        fmt::format("{:+.4f} ± {:.4f}", left.at("late_ms")[0].get<double>(),
                    left.at("sigma_ms")[0].get<double>()),
        fmt::format("{} to {}", left.at("strobe_frames")[0][0].get<int>(),
                    left.at("strobe_frames")[0][1].get<int>() - 1),
        std::string("Calibrate the cameras ("), std::string("data:image/png"),
        std::string("what the clock's fit leaves"), std::string("Standard error of that")})
    EXPECT_THAT(page, HasSubstr(said));
  for (const char* wrong : {"http://", "https://", "<script", "\"nan", "Lnan", "Mnan", "{}"})
    EXPECT_EQ(page.find(wrong), std::string::npos) << wrong;
  EXPECT_EQ(test::run_verb(add_import, words).exit_code, 2) << "an existing session was overwritten";
}

TEST_F(ImportFilms, GoOnWhereTheyWereKilled) {
  films::ImportOptions with = options();
  int seen = 0;
  const auto ended = films::run_import(
      with, [&](double fraction, std::string_view) { return fraction < 0.7 || ++seen < 3; },
      report::reports_of);
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.error().kind, ErrorKind::refused);
  EXPECT_FALSE(fs::exists(with.out));
  std::vector<fs::file_time_type> done;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "session.importing"))
    if (entry.path().extension() == ".done") done.push_back(fs::last_write_time(entry.path()));
  EXPECT_FALSE(done.empty());
  std::vector<double> fractions;
  const auto result = films::run_import(
      with,
      [&](double fraction, std::string_view what) {
        if (what.starts_with("camera-")) fractions.push_back(fraction);
        return true;
      },
      report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_LT(fractions.size(), 2.2 * static_cast<double>(result->instants)) << "all was written anew";
  EXPECT_TRUE(session::verify_session(with.out)->whole());
}

TEST_F(ImportFilms, WithoutTheStrobeAreRefusedOrLeftOutAndNamed) {
  films::ImportOptions with = options();
  with.folder = own_films();
  test::VideoWriter writer(with.folder / "dark.mp4", {320, 240}, {});
  const Image black({.size = {320, 240}});
  for (int i = 0; i < 100; ++i) writer.write(black);
  writer.close();
  EXPECT_THAT(refusal(with),
              AllOf(HasSubstr("dark.mp4"), HasSubstr("shows no strobe"), HasSubstr("--partial")));
  with.faults = films::Faults::partial;
  const auto result = films::run_import(with, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->cameras.size(), 3U);
  EXPECT_THAT(result->notes, testing::Contains(AllOf(HasSubstr("dark is left out"), HasSubstr("no strobe"))));
}

TEST_F(ImportFilms, OfVariableFrameRateAreRefusedOrUsedUpToThere) {
  films::ImportOptions with = options();
  with.folder = own_films();
  const fs::path varying = with.folder / "camera-2.mp4";
  fs::remove(varying);
  const auto original = session::FrameFile::open((*clips_)[2].file, session::Colours::brightness).value();
  test::VideoWriter writer(varying, {320, 240}, {});
  for (int i = 0; i < 340; ++i) {
    if (i == 310) writer.skip(1);
    writer.write(original->next().value());
  }
  writer.close();
  EXPECT_THAT(refusal(with),
              AllOf(HasSubstr("camera-2.mp4"), HasSubstr("frame rate varies"), HasSubstr("frame 310")));
  with.faults = films::Faults::partial;
  const auto result = films::run_import(with, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->cameras[2].frames, 310);
  EXPECT_THAT(result->notes, testing::Contains(HasSubstr("camera-2 is used in part")));
}

TEST_F(ImportFilms, ThatAreTruncatedEndWhereTheyDecodeAndSaySo) {
  films::ImportOptions with = options();
  with.folder = own_films();
  fs::remove(with.folder / "camera-1.mp4");
  // Matroska, which keeps its frames before its index.
  const auto original = session::FrameFile::open((*clips_)[1].file, session::Colours::brightness).value();
  test::VideoFormat format;
  format.gop = 12;
  test::VideoWriter writer(with.folder / "camera-1.mkv", {320, 240}, format);
  for (int i = 0; i < 340; ++i) writer.write(original->next().value());
  writer.close();
  const fs::path cut = with.folder / "camera-1.mkv";
  fs::resize_file(cut, fs::file_size(cut) * 93 / 100);
  const auto result = films::run_import(with, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_LT(result->cameras[1].frames, 330);
  EXPECT_THAT(result->notes, testing::Contains(AllOf(HasSubstr("camera-1"), HasSubstr("truncated"))));
  EXPECT_TRUE(session::verify_session(with.out)->whole());
  with.out = folder_ / "wanted";
  with.flame = films::Part{Seconds(12), Seconds(13.9)};
  EXPECT_THAT(refusal(with), AllOf(HasSubstr("camera-1.mkv"), HasSubstr("doesn't reach")));
}

TEST_F(ImportFilms, AreNotPairedByGuess) {
  films::ImportOptions with = options();
  with.alignment.reset();
  EXPECT_THAT(refusal(with), AllOf(HasSubstr("--flash-rate"), HasSubstr("--unsynchronised")));
  with.alignment = films::Alignment::offsets;
  with.offsets["camera-2"] = 14;
  with.flame = films::Part{Seconds(12), Seconds(13)};
  const auto result = films::run_import(with, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->cameras[2].frame_offset, 14);
  EXPECT_THAT(result->notes, testing::Contains(HasSubstr("NOT SYNCHRONISED")));
  EXPECT_FALSE(fs::exists(session::shutter_times_path(with.out)));
}

TEST_F(ImportFilms, GetTheCalibrationOfTheirRigOrAreRefusedForItBeforeTheyAreSearched) {
  v1::Rig rig;
  rig.set_format_version(session::kRigFormatVersion);
  for (int c = 0; c < 3; ++c) {
    v1::RigCamera& camera = *rig.add_cameras();
    camera.set_camera_id(fmt::format("camera-{}", c));
    camera.set_width(320);
    camera.set_height(240);
    camera.mutable_calibration()->set_fx(500 + c);
    camera.mutable_colour()->add_gain(1.5 + c);
  }
  for (int i = 0; i < 3; ++i) {
    rig.mutable_box()->add_center(0.1 * i);
    rig.mutable_box()->add_size(0.5);
  }
  films::ImportOptions with = options();
  with.rig = folder_ / "rig.json";
  ASSERT_TRUE(session::write_rig(with.rig, rig).ok());
  with.flame = films::Part{Seconds(12), Seconds(12.4)};
  const auto result = films::run_import(with, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  const v1::Manifest manifest = session::SessionReader::open(with.out)->manifest();
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(manifest.cameras(c).calibration().fx(), 500 + c);
    EXPECT_EQ(manifest.cameras(c).colour().gain(0), 1.5 + c);
    EXPECT_TRUE(result->cameras[static_cast<std::size_t>(c)].calibrated);
  }
  EXPECT_EQ(manifest.box().center(2), 0.2);

  const auto refused = [&](const v1::Rig& wrong) {
    EXPECT_TRUE(session::write_rig(with.rig, wrong).ok());
    with.out = folder_ / "refused";
    const auto answer = films::run_import(
        with, [](double fraction, std::string_view) { return fraction < 0.05; }, report::reports_of);
    EXPECT_FALSE(fs::exists(with.out));
    return answer.ok() ? std::string() : answer.error().message();
  };
  v1::Rig other_size = rig;
  other_size.mutable_cameras(1)->set_width(640);
  EXPECT_THAT(refused(other_size),
              AllOf(HasSubstr("camera-1"), HasSubstr("640 x 240"), HasSubstr("320 x 240")));
  v1::Rig without = rig;
  without.mutable_cameras()->RemoveLast();
  EXPECT_THAT(refused(without), AllOf(HasSubstr("rig.json"), HasSubstr("knows no camera camera-2")));
  fs::remove(with.rig);
  EXPECT_THAT(refusal(with), HasSubstr("rig.json"));
}

TEST_F(ImportFilms, OfOneCameraInPiecesOfDifferentSizeAreRefused) {
  films::ImportOptions with = options();
  with.folder = own_films();
  fs::create_directories(with.folder / "cam");
  for (const auto& [name, size] :
       {std::pair{"MVI_9.mp4", ImageSize{320, 240}}, {"MVI_10.mp4", ImageSize{160, 120}}}) {
    test::VideoWriter writer(with.folder / "cam" / name, size, {});
    for (int i = 0; i < 30; ++i) writer.write(Image({.size = size}));
    writer.close();
  }
  EXPECT_THAT(refusal(with), AllOf(HasSubstr("MVI_10.mp4"), HasSubstr("160 x 120"), HasSubstr("MVI_9.mp4")));
}

TEST(ImportPictures, ByTheirNumbersCutToThoseThatAllCamerasHave) {
  const test::TempFolder folder;
  const ImageLayout layout{{24, 16}, PixelFormat::rgb8, 8};
  for (const auto& [id, first, last] : {std::tuple{"left", 7, 12}, {"right", 9, 14}}) {
    fs::create_directories(folder / "in" / id);
    for (int i = first; i <= last; ++i) {
      if (i == 11 && std::string(id) == "right") continue;
      std::ofstream file(folder / "in" / id / fmt::format("frame{}.ppm", i), std::ios::binary);
      const Image image = test::noise_image(layout, static_cast<std::uint64_t>(i));
      file << "P6 24 16 255\n";
      file.write(reinterpret_cast<const char*>(image.bytes().data()),
                 static_cast<std::streamsize>(image.bytes().size()));
    }
  }
  films::ImportOptions options;
  options.folder = folder / "in";
  options.out = folder / "session";
  options.min_free_bytes = 0;
  const auto result = films::run_import(options, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->instants, 3);  // 9, 10, 12
  EXPECT_THAT(result->notes, testing::Contains(HasSubstr("1 instants are left out")));
  auto session = session::SessionReader::open(options.out).value();
  for (std::size_t c = 0; c < 2; ++c) {
    const std::vector<std::uint64_t> numbers{9, 10, 12};
    ASSERT_EQ(session.stamps(c).size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(session.stamps(c)[i].frame_id, numbers[i] - 9);
      EXPECT_EQ(*session.read(c, i)->image, test::noise_image(layout, numbers[i]));
    }
  }
}

TEST(ImportTransforms, BecomeACalibratedSessionOfOneInstant) {
  const test::TempFolder folder;
  const ImageLayout layout{{24, 16}, PixelFormat::gray8, 8};
  for (const char* name : {"a.pgm", "b.pgm"}) {
    std::ofstream file(folder / name, std::ios::binary);
    const Image image = test::noise_image(layout, 3);
    file << "P5 24 16 255\n";
    file.write(reinterpret_cast<const char*>(image.bytes().data()),
               static_cast<std::streamsize>(image.bytes().size()));
  }
  std::ofstream(folder / "transforms.json") << R"({"fl_x": 30, "fl_y": 31, "w": 24, "h": 16,
    "box": {"center": [0, 0, 1], "size": [1, 1, 2]}, "frames": [
    {"file_path": "a.pgm", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]},
    {"file_path": "b.pgm", "transform_matrix": [[0,0,1,3],[0,1,0,0],[-1,0,0,0],[0,0,0,1]]}]})";
  films::ImportOptions options;
  options.folder = folder.path();
  options.out = folder / "session";
  options.min_free_bytes = 0;
  const auto result = films::run_import(options, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  auto session = session::SessionReader::open(options.out).value();
  ASSERT_EQ(session.camera_count(), 2U);
  EXPECT_EQ(session.manifest().box().size(2), 2);
  EXPECT_EQ(session.manifest().cameras(0).calibration().fy(), 31);
  ASSERT_EQ(session.manifest().cameras(1).calibration().camera_from_world_size(), 12);
  EXPECT_EQ(*session.read(0, 0)->image, test::noise_image(layout, 3));
}

/// Two films of noise, calibrated by a transforms.json.
films::ImportOptions films_with_transforms(const std::filesystem::path& folder,
                                           std::array<std::uint64_t, 2> frames, std::array<int, 2> rates) {
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  for (std::size_t c = 0; c < 2; ++c) {
    test::VideoFormat format;
    format.codec = AV_CODEC_ID_FFV1;
    format.rate = {rates[c], 1};
    test::VideoWriter writer(folder / (c == 0 ? "a.mkv" : "b.mkv"), layout.size, format);
    for (std::uint64_t n = 0; n < frames[c]; ++n) writer.write(test::noise_image(layout, 10 * c + n));
    writer.close();
  }
  std::ofstream(folder / "cameras.json")
      << R"({"fl_x": 30, "fl_y": 31, "w": 64, "h": 48, "fps": 30, "frames": [
    {"file_path": "a.mkv", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]},
    {"file_path": "b.mkv", "transform_matrix": [[0,0,1,3],[0,1,0,0],[-1,0,0,0],[0,0,0,1]]}]})";
  films::ImportOptions options;
  options.folder = folder / "cameras.json";
  options.out = folder / "session";
  options.min_free_bytes = 0;
  return options;
}

TEST(ImportTransforms, OfVideosBecomeASessionWhoseFramesGoByTheirNumbers) {
  const test::TempFolder folder;
  const auto result =
      films::run_import(films_with_transforms(folder.path(), {5, 5}, {30, 30}), {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->instants, 5);
  EXPECT_THAT(result->notes, testing::ElementsAre(HasSubstr("NOT SYNCHRONISED")));
  auto session = session::SessionReader::open(folder / "session").value();
  ASSERT_EQ(session.camera_count(), 2U);
  EXPECT_EQ(session.manifest().cameras(1).calibration().camera_from_world_size(), 12);
  EXPECT_NEAR(session.manifest().cameras(0).frame_rate_hz(), 30, 0.1);
  for (std::size_t c = 0; c < 2; ++c) {
    ASSERT_EQ(session.stamps(c).size(), 5U);
    for (std::size_t n = 0; n < 5; ++n) {
      EXPECT_EQ(session.stamps(c)[n].frame_id, n);
      EXPECT_NEAR((session.stamps(c)[n].device_time - session.stamps(c)[0].device_time).value(),
                  static_cast<double>(n) / 30, 2e-3);
      EXPECT_EQ(*session.read(c, n)->image, test::noise_image({{64, 48}, PixelFormat::gray8, 8}, 10 * c + n));
    }
  }
}

TEST(ImportTransforms, OfVideosThatDontGoTogetherAreRefusedAndSaid) {
  const test::TempFolder shorter;
  const auto cut =
      films::run_import(films_with_transforms(shorter.path(), {5, 4}, {30, 30}), {}, report::reports_of);
  ASSERT_FALSE(cut.ok());
  EXPECT_THAT(cut.error().message(), HasSubstr("b.mkv: has 4 frames, a.mkv has 5"));
  const test::TempFolder slower;
  const auto slow =
      films::run_import(films_with_transforms(slower.path(), {5, 5}, {30, 25}), {}, report::reports_of);
  ASSERT_FALSE(slow.ok());
  EXPECT_THAT(slow.error().message(), HasSubstr("has 25.00 frames a second, a.mkv has 30."));
  EXPECT_FALSE(std::filesystem::exists(slower / "session"));
}

}  // namespace
}  // namespace emberlock::cli
