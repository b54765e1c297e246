// SPDX-License-Identifier: Apache-2.0
// Every verb that writes a folder, and what becomes of files there that aren't its own: planted before and
// after, by people and by other verbs.
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/output_folder.h"
#include "cli/app_tree.h"
#include "cli/commands.h"
#include "recon/calibrate/board.h"
#include "recon/calibrate/carried_board.h"
#include "recon/calibrate/rig_formats.h"
#include "recon/export/picture.h"
#include "recon/preprocess/radiance.h"
#include "recon/synthetic/flame.h"
#include "session/video_writer.h"
#include "tests/support/board_rig.h"
#include "tests/support/hot_volume.h"
#include "tests/support/marker_film.h"
#include "tests/support/recording.h"
#include "tests/support/scene_files.h"
#include "tests/support/session_parts.h"
#include "tests/support/strobe_clips.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using Words = std::vector<std::string>;

/// A verb with all that it needs but the folder that it writes.
struct Writer {
  const char* verb;    ///< as its results name it
  const char* option;  ///< before the folder; empty where it stands alone
  test::AddVerb add;
  Words words;
  fs::path input;  ///< one file that it reads; none where it reads none
  std::set<std::string> makes;
};

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

/// Every file below a folder with its content; a symlink with where it leads.
std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (entry.is_symlink()) files[name] = fs::read_symlink(entry.path()).string();
    if (entry.is_regular_file() && !entry.is_symlink()) files[name] = *read_file(entry.path());
  }
  return files;
}

/// Eleven views of a small flame.
fs::path make_transforms(const fs::path& folder) {
  recon::PaperSceneOptions options;
  options.image = {48, 36};
  options.truth_voxels = 16;
  EXPECT_TRUE(test::write_scene(recon::paper_scene(options), folder).ok());
  return folder / "transforms.json";
}

/// A folder a camera with pictures of a chessboard.
fs::path make_boards(const fs::path& folder) {
  test::BoardRigOptions options;
  options.cameras = 2;
  options.instants = 6;
  options.seed = 5;
  options.image = {320, 240};
  options.board = *recon::parse_board("chessboard:9x6:18mm");
  const test::BoardRig rig = test::board_rig(options);
  for (const auto& sighting : rig.sightings.sightings) {
    const fs::path file =
        folder / rig.sightings.cameras[sighting.camera].id / fmt::format("board_{}.png", sighting.instant);
    fs::create_directories(file.parent_path());
    const Image picture = recon::board_picture(rig.cameras[sighting.camera], options.board,
                                               rig.world_from_board[sighting.instant]);
    EXPECT_TRUE(recon::write_png(picture.view(), file).ok());
  }
  return folder;
}

/// One camera that sees four greys at two exposures, as it is: a power of 2.2.
fs::path make_target(const fs::path& folder) {
  nlohmann::json patches;
  for (int p = 0; p < 4; ++p) patches[fmt::format("p{}", p)] = {16 * p, 0, 16, 48};
  write(folder / "colour.json", nlohmann::json{{"patches", {{"left", patches}}}}.dump());
  for (const double exposure : {0.25, 0.5, 1.0}) {
    Image picture(ImageLayout{{64, 48}, PixelFormat::rgb8, 8});
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double light = exposure * (0.1 + 0.2 * (x / 16));
        for (int c = 0; c < 3; ++c)
          picture.row_as<std::uint8_t>(y)[3 * x + c] =
              static_cast<std::uint8_t>(255 * std::pow(light, 1 / 2.2) + 0.5 * ((x + y) % 2));
      }
    }
    fs::create_directories(folder / "left");
    EXPECT_TRUE(
        recon::write_png(picture.view(), folder / "left" / fmt::format("target_{}s.png", exposure)).ok());
  }
  return folder;
}

/// Two frames of a marker.
fs::path make_marker_film(const fs::path& path) {
  const recon::Intrinsics lens{{160, 120}, 160, 160, 80, 60, {}};
  auto film = session::VideoWriter::create(path, {lens.size, PixelFormat::rgb8, 8}, Hertz(30), 0,
                                           session::VideoWriter::Coding::lossless);
  const test::Plate plate(test::usual_marker());
  for (int f = 0; f < 2; ++f) EXPECT_TRUE((*film)->show(plate.seen_by(test::in_a_hand(lens, f / 30.0))).ok());
  EXPECT_TRUE((*film)->close().ok());
  return path;
}

/// Two clips of one strobe and one of a comb, and the words that tell of them.
Words make_clips(const fs::path& folder) {
  drivers::VirtualRigDraw model;
  model.layout.size = {320, 240};
  model.row_time = microseconds_per_row(160);
  test::StrobeFilm film = test::random_film(44, 2, model, {.words = 8, .spacing = 60});
  film.format = {};
  film.suffix = ".mp4";
  film.frames = 90;
  fs::create_directories(folder / "comb");
  Words words;
  for (const auto& truth : test::film_strobe(film, folder)) words.push_back(truth.file);
  const auto comb = test::film_strobe(test::comb_of(film, 0, 36), folder / "comb");
  words.insert(words.end(),
               {"--flash-rate", fmt::format("{}", film.strobe.rate.value()), "--comb", comb[0].file,
                "--comb-rate", "300", "--code-words", "8", "--code-spacing", "60"});
  return words;
}

class OutputFolders : public testing::Test {
 protected:
  /// Verbs whose earlier result gives way to the next.
  std::vector<Writer> replacing() {
    const std::string transforms = make_transforms(temp_ / "project").string();
    const std::string boards = make_boards(temp_ / "boards").string();
    const std::string target = make_target(temp_ / "target").string();
    const std::string hot = test::make_hot_volume(temp_ / "hot" / "volume.vdb").string();
    test::record(temp_ / "session", {{64, 48}, PixelFormat::gray8, 8}, 2, test::small_disk_options());
    const std::string session = (temp_ / "session").string();
    const std::string scene = (temp_ / "scene.json").string();
    write(scene, R"({"format": "emberlock scene", "version": 1, "flames": [{"result": "hot/volume.vdb"}]})");
    const std::string law = (temp_ / "law" / "law.json").string();
    write(law, R"({"law": {"reach": 5, "spread": 0.1, "strength": {"views": 400, "pixels": 4e4, "noise": 1,)"
               R"( "exposure": 1e3, "sync": 1e3, "rest": 1}}})");
    const std::string marker_film = make_marker_film(temp_ / "marker.mkv").string();
    Words clips = make_clips(temp_ / "clips");
    const fs::path clip = clips.front();
    clips.insert(clips.begin(), "verify");
    return {
        {"reconstruct",
         "--out",
         add_reconstruct,
         {"reconstruct", transforms, "--voxels", "8", "--iterations", "2", "--effects", "none", "--device",
          "cpu"},
         temp_ / "project" / "view2.png",
         {"report.json", "volume.vdb", "views/0003.png"}},
        {"reconstruct --plan",
         "--plan",
         add_reconstruct,
         {"reconstruct", transforms, "--voxels", "8", "--device", "cpu"},
         temp_ / "project" / "view2.png",
         {"index.html", "box/0003.png"}},
        {"tradeoff recon",
         "--out",
         add_tradeoff,
         {"tradeoff", "recon",        transforms, "--hold-out", "1",    "--voxels", "8",       "--views",
          "0",        "--step",       "1",        "--effects",  "none", "--solver", "default", "--precision",
          "float32",  "--iterations", "1,2",      "--device",   "cpu"},
         temp_ / "project" / "view2.png",
         {"points.csv", "diagram.svg", "index.html"}},
        {"tradeoff sync",
         "--out",
         add_tradeoff,
         {"tradeoff", "sync", "--cameras", "3", "--tolerances", "100", "--policies", "densest", "--rigs",
          "20", "--flame-speed", "0"},
         {},
         {"points.csv", "diagram.svg", "index.html"}},
        {"tradeoff rig",
         "--out",
         add_tradeoff,
         {"tradeoff", "rig", "--cameras", "4", "--sizes", "32x24", "--voxels", "8", "--effects", "none",
          "--exposures", "1", "--tolerances", "5", "--devices", "cpu", "--rigs", "20"},
         {},
         {"points.csv", "rig.json", "index.html"}},
        {"design",
         "--out",
         add_design,
         {"design", "--flame", "0.16,1,1800", "--target-error", "250", "--law", law},
         law,
         {"report.html", "report.json"}},
        {"calibrate cameras",
         "--out",
         add_calibrate,
         {"calibrate", "cameras", boards, "--board", "chessboard:9x6:18mm", "--world", "0"},
         temp_ / "boards" / "cam00" / "board_0.png",
         {"rig.json", "index.html", "opencv/cam00.yml"}},
        {"calibrate colour",
         "--out",
         add_calibrate,
         {"calibrate", "colour", target, "--gamma", "2.2"},
         temp_ / "target" / "colour.json",
         {"rig.json", "colour.html"}},
        {"calibrate convert",
         "--out",
         add_calibrate,
         {"calibrate", "convert", transforms},
         transforms,
         {"rig.json", "transforms.json", "colmap/cameras.txt"}},
        {"verify", "--out", add_verify, clips, clip, {"report.html"}},
        {"demo",
         "--out",
         add_demo,
         {"demo", "--cameras", "3", "--image", "160x160", "--frames", "1", "--voxels", "8"},
         {},
         {"report.html", "summary.png", "flame/manifest.json", "reconstruction/volume.vdb"}},
        {"render",
         "--out",
         add_render,
         {"render", hot, "--frames", "2", "--image", "32x32"},
         hot,
         {"frame-0000.png", "frame-0001.png"}},
        {"scene",
         "--out",
         add_scene,
         {"scene", scene, "--frames", "2", "--image", "32x32"},
         hot,
         {"frame-0000.png", "frame-0001.png"}},
        {"stylize",
         "--out",
         add_stylize,
         {"stylize", transforms, "--voxels", "8", "--iterations", "2", "--effects", "none", "--device", "cpu",
          "--passes", "1", "--previews"},
         temp_ / "project" / "view2.png",
         {"report.json", "volume.vdb", "views/0003.png", "edits.json", "previews/0001.png"}},
        {"ar",
         "--out",
         add_ar,
         {"ar", marker_film, hot, "--marker", "aruco:4X4_50:7:80mm", "--focal", "160"},
         marker_film,
         {"ar.mp4", "poses.json"}},
        {"export", "--out", add_export, {"export", hot}, hot, {"flame.vdb"}},
        {"measure", "--out", add_measure, {"measure", hot, hot}, hot, {"measures.csv", "measures.html"}},
        {"simulate flame",
         "--out",
         add_simulate,
         {"simulate", "flame", "--frames", "1", "--cells", "8", "--rig", "virtual:2", "--image", "64x64"},
         {},
         {"session/manifest.json", "truth/frame-0000.vdb"}},
        {"sample",
         "",
         add_sample,
         {"sample", "--cameras", "3", "--image", "160x120", "--frames", "2"},
         {},
         {"films/camera-2.mp4", "comb/camera-0.mp4", "board/camera-1/00.png", "truth.json"}},
        {"sessions export",
         "--out",
         add_sessions,
         {"sessions", "export", session},
         temp_ / "session" / "manifest.json",
         {"export.txt", "cam0/000001.png"}},
    };
  }
  /// Verbs that make a new session, and never replace one.
  std::vector<Writer> founding() {
    make_transforms(temp_ / "project");
    const std::vector<fs::path> parts = record_parts_once();
    return {
        {"import",
         "--out",
         add_import,
         {"import", (temp_ / "project" / "transforms.json").string()},
         temp_ / "project" / "view2.png",
         {"manifest.json", "import.html", "view3/index.bin"}},
        {"align",
         "--record",
         add_align,
         {"align", "--rig", "virtual:3", "--tolerance", "100rows", "--shortest-take", "0"},
         {},
         {"manifest.json", "events.binpb"}},
        {"sessions join",
         "--out",
         add_sessions,
         {"sessions", "join", parts[0].string(), parts[1].string(), parts[2].string()},
         parts[1] / "manifest.json",
         {"manifest.json", "events.binpb", "above/index.bin"}},
    };
  }
  /// founding() is asked for more than once in a test.
  std::vector<fs::path> record_parts_once() {
    if (parts_.empty()) parts_ = test::record_parts(temp_ / "parts", test::three_hosts(), {.frames = 2});
    return parts_;
  }
  static test::VerbRun run(const Writer& writer, const fs::path& out) {
    Words words = writer.words;
    if (*writer.option != '\0') words.emplace_back(writer.option);
    words.push_back(out.string());
    return test::run_verb(writer.add, words);
  }
  static void expect_made(const Writer& writer, const fs::path& out) {
    for (const std::string& file : writer.makes)
      EXPECT_TRUE(fs::exists(out / file)) << writer.verb << ' ' << file;
  }
  /// Refused as bad input, with every file below the test's folder as it was.
  void expect_refused(const Writer& writer, const fs::path& out, const std::string& words) const {
    const auto before = files_below(temp_.path());
    const auto refused = run(writer, out);
    EXPECT_EQ(refused.exit_code, 2) << writer.verb << refused.out << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(words)) << writer.verb;
    EXPECT_EQ(files_below(temp_.path()), before) << writer.verb;
  }
  test::TempFolder temp_;
  std::vector<fs::path> parts_;
};

/// Every option of every verb that names a folder to write to, as the tables above have it.
TEST_F(OutputFolders, TheTablesHoldEveryVerbThatWritesOne) {
  std::set<std::string> listed{
      "emberlock devices clips --out",    // needs a camera: tests/vm/ptp
      "emberlock batch --out",            // goes on with what is there: tests/integration/batch
      "emberlock batch submit --out",     // the same
      "emberlock sessions backup --to"};  // puts copies beside what is there: backup_test.cpp
  for (const std::vector<Writer>& writers : {replacing(), founding()}) {
    for (const Writer& writer : writers) {
      if (*writer.option == '\0') continue;
      const bool plan = std::string_view(writer.option) == "--plan";
      listed.insert(std::string("emberlock ") + (plan ? "reconstruct" : writer.verb) + " " + writer.option);
    }
  }
  const CommandLine line;
  for (const auto add :
       {add_devices, add_smear,    add_align,  add_reconstruct, add_verify,  add_tradeoff, add_calibrate,
        add_import,  add_demo,     add_sample, add_doctor,      add_bench,   add_sessions, add_status,
        add_jobs,    add_watch,    add_record, add_strobe,      add_measure, add_simulate, add_render,
        add_export,  add_evaluate, add_scene,  add_ar,          add_stylize, add_batch,    add_design})
    add(line.program());
  std::set<std::string> found;
  const VerbWords tree = describe_tree(line.program());
  for (const VerbWords* verb : list_verbs(tree)) {
    for (const OptionWords& option : verb->options) {
      static const std::set<std::string> kRead{"--strobe", "--camera", "--mask",
                                               "--depth",  "--rig",    "--backups"};
      const bool folder = option.description.find("older") != std::string::npos || option.name == "--out";
      const bool reads = option.long_names.empty() || kRead.contains(option.name);
      if (folder && !reads) found.insert(verb->path + " " + option.name);
    }
  }
  EXPECT_EQ(found, listed);
}

using OutputFoldersSlow = OutputFolders;

TEST_F(OutputFoldersSlow, OfAnEarlierResultEveryVerbReplacesItsOwnFilesAlone) {
  for (const Writer& writer : replacing()) {
    SCOPED_TRACE(writer.verb);
    const fs::path out = temp_ / "results" / "out";
    {
      auto earlier = OutputFolder::create({out, {writer.verb}});
      ASSERT_TRUE(earlier.ok()) << earlier.error().message();
      write(earlier->path() / "old.txt", "of the run before");
      write(earlier->path() / "views" / "9999.png", "too");
      ASSERT_TRUE(earlier->commit().ok());
    }
    write(out / "notes.txt", "mine");
    write(out / "photos" / "holiday.jpg", "mine");
    write(out / "views" / "best.txt", "mine");
    fs::create_directory_symlink(temp_ / "project", out / "link");
    const auto done = run(writer, out);
    EXPECT_LT(done.exit_code, 2) << done.out << done.err;
    expect_made(writer, out);
    EXPECT_FALSE(fs::exists(out / "old.txt"));
    EXPECT_FALSE(fs::exists(out / "views" / "9999.png"));
    for (const char* mine : {"notes.txt", "photos/holiday.jpg", "views/best.txt"})
      EXPECT_EQ(*read_file(out / mine), "mine") << mine;
    EXPECT_TRUE(fs::exists(out / "link" / "view2.png"));
    EXPECT_EQ(std::distance(fs::directory_iterator(temp_ / "results"), {}), 1) << "nothing hidden is left";

    // What the run made is its own too, until somebody changes it.
    const std::string first = *writer.makes.begin();
    std::ofstream(out / first, std::ios::app) << "and what I think of it";
    expect_refused(writer, out, "was changed since");
    fs::remove_all(temp_ / "results");
  }
}

TEST_F(OutputFoldersSlow, AFolderThatNobodyListedIsLeftAlone) {
  for (const Writer& writer : replacing()) {
    SCOPED_TRACE(writer.verb);
    for (const char* name :
         {"report.json", "index.html", "rig.json", "points.csv", "report.html", "export.txt"})
      write(temp_ / "site" / name, "by a former version, or mine");
    write(temp_ / "site" / "photos" / "holiday.jpg", "mine");
    expect_refused(writer, temp_ / "site", kResultList);
    fs::remove_all(temp_ / "site");
  }
  for (const Writer& writer : founding()) {
    SCOPED_TRACE(writer.verb);
    write(temp_ / "take" / "manifest.json", "mine");
    expect_refused(writer, temp_ / "take", "not an empty folder");
    fs::remove_all(temp_ / "take");
    const auto done = run(writer, temp_ / "take");
    EXPECT_EQ(done.exit_code, 0) << done.err;
    expect_made(writer, temp_ / "take");
    expect_refused(writer, temp_ / "take", "not an empty folder");
    fs::remove_all(temp_ / "take");
  }
}

TEST_F(OutputFolders, WhatIsReadIsNeverInWhatIsWritten) {
  std::vector<Writer> writers = replacing();
  for (Writer& writer : founding()) writers.push_back(std::move(writer));
  for (const Writer& writer : writers) {
    if (writer.input.empty()) continue;
    SCOPED_TRACE(writer.verb);
    const fs::path folder = writer.input.parent_path();
    // The input's own folder, with a list as if the verb had once written there.
    if (std::string_view(writer.verb) != "import") {
      write(folder / kResultList, R"({"format": "emberlock result", "version": 1, "files": []})");
      expect_refused(writer, folder, "lies in ");
      fs::create_directory_symlink(folder, temp_ / "link");
      expect_refused(writer, temp_ / "link" / ".", "lies in ");
      fs::remove(temp_ / "link");
      fs::remove(folder / kResultList);
    }
    // Folders are read whole; beside a file is a place like any other.
    const bool reads_folder =
        std::any_of(writer.words.begin(), writer.words.end(), [&](const std::string& word) {
          return fs::is_directory(word) && writer.input.string().starts_with(word);
        });
    if (reads_folder) expect_refused(writer, folder / "result", "lies in a folder that is read");
  }
}

TEST_F(OutputFolders, AColourCalibrationKeepsTheRigThatItAddsTo) {
  const fs::path out = temp_ / "rig";
  const std::string boards = make_boards(temp_ / "boards").string();
  const std::string target = make_target(temp_ / "target").string();
  const Words cameras{"calibrate", "cameras", boards,  "--board",   "chessboard:9x6:18mm",
                      "--world",   "0",       "--out", out.string()};
  ASSERT_EQ(test::run_verb(add_calibrate, cameras).exit_code, 0);
  const auto colour = test::run_verb(add_calibrate, {"calibrate", "colour", target, "--gamma", "2.2", "--rig",
                                                     (out / "rig.json").string(), "--out", out.string()});
  ASSERT_EQ(colour.exit_code, 0) << colour.err;
  for (const char* file : {"colour.html", "index.html", "opencv/cam00.yml"})
    EXPECT_TRUE(fs::exists(out / file)) << file;
  EXPECT_EQ(session::read_rig(out / "rig.json")->cameras_size(), 3);
  const auto again = test::run_verb(add_calibrate, cameras);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(fs::exists(out / "colour.html"));
}

/// An import that was ended leaves its work beside the session: what somebody else put there stays.
TEST_F(OutputFolders, AnUnfinishedImportsFolderIsKnownByItsContent) {
  const Writer import = founding().front();
  const fs::path work = temp_ / "take.importing";
  write(work / "camera-view0" / "my.txt", "mine");
  expect_refused(import, temp_ / "take", "take.importing");
  write(work / "lock", "");
  expect_refused(import, temp_ / "take", "take.importing");
  write(work / "lock", "emberlock import, unfinished\n");
  const auto refused = run(import, temp_ / "take");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("no import made"));
  EXPECT_EQ(*read_file(work / "camera-view0" / "my.txt"), "mine");
  fs::remove_all(work / "camera-view0");
  write(work / "notes.txt", "mine");
  const auto done = run(import, temp_ / "take");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  expect_made(import, temp_ / "take");
  EXPECT_EQ(files_below(work), (std::map<std::string, std::string>{{"notes.txt", "mine"}}));
}

}  // namespace
}  // namespace emberlock::cli
