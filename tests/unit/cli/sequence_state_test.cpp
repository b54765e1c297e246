// SPDX-License-Identifier: Apache-2.0
// What a sequence or a batch that goes on takes for done.
#include "cli/sequence_state.h"

#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/output_folder.h"
#include "base/sha256.h"
#include "cli/batch_result.h"
#include "tests/support/recording.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using report::SequenceFrame;
using report::SequenceTold;
using test::put_bytes;

/// A frame's folder with a volume of these bytes, as `reconstruct` makes one; what its row states.
SequenceFrame make_frame(const fs::path& folder, std::uint64_t frame, const std::string& bytes) {
  auto out = OutputFolder::create({folder, OutputVerb{"reconstruct"}});
  EXPECT_TRUE(out.ok());
  put_bytes(out->path() / "volume.vdb", bytes);
  put_bytes(out->path() / "report.json", "{}");
  EXPECT_TRUE(out->commit().ok());
  SequenceFrame row;
  row.frame = frame;
  row.volume = listed_hash_of_volume(folder);
  EXPECT_EQ(row.volume, sha256(bytes));
  return row;
}

struct Damage {
  const char* what;
  std::function<void(const fs::path& folder)> make;
  bool holds = false;
};
const std::string kVolumeBytes(3000, 'v');

std::vector<Damage> damages() {
  const auto volume = [](const fs::path& folder) { return folder / "volume.vdb"; };
  const auto touch = [](const fs::path& file) {
    fs::last_write_time(file, fs::last_write_time(file) + std::chrono::hours(1));
  };
  std::vector<Damage> all{
      {"nothing", [](const fs::path&) {}, true},
      {"another time", [=](const fs::path& f) { touch(volume(f)); }, true},
      {"another file removed", [](const fs::path& f) { fs::remove(f / "report.json"); }, true},
      {"removed", [=](const fs::path& f) { fs::remove(volume(f)); }},
      {"folder removed", [](const fs::path& f) { fs::remove_all(f); }},
      {"a folder", [=](const fs::path& f) { fs::remove(volume(f)), fs::create_directory(volume(f)); }},
      {"a pipe", [=](const fs::path& f) { fs::remove(volume(f)), (void)::mkfifo(volume(f).c_str(), 0600); }},
      {"longer", [=](const fs::path& f) { put_bytes(volume(f), kVolumeBytes + "x"); }},
      {"a link to nothing",
       [=](const fs::path& f) { fs::remove(volume(f)), fs::create_symlink("nowhere", volume(f)); }},
      {"a link to another", [=](const fs::path& f) {
         put_bytes(f / "other", "other");
         fs::remove(volume(f));
         fs::create_symlink("other", volume(f));
       }}};
  for (const std::uintmax_t size : {0, 1, 7, 1500, 2999})
    all.push_back({"cut", [=](const fs::path& f) { fs::resize_file(volume(f), size); }});
  for (const std::size_t at : {0, 1500, 2999})
    all.push_back({"a changed byte", [=](const fs::path& f) {
                     put_bytes(volume(f), std::string(kVolumeBytes).replace(at, 1, "w"));
                   }});
  return all;
}

TEST(SequenceState, AVolumeHoldsAsLongAsItsBytesAreThere) {
  for (const bool hashed : {true, false})  // a row of an earlier version has no hash
    for (const Damage& damage : damages()) {
      const test::TempFolder temp;
      SequenceFrame row = make_frame(temp / "frame-5", 5, kVolumeBytes);
      if (!hashed) row.volume.clear();
      damage.make(temp / "frame-5");
      EXPECT_EQ(holds_volume(temp / "frame-5", row), damage.holds) << damage.what << ' ' << hashed;
    }
}

TEST(SequenceState, AFrameThatWasMadeOtherwiseSinceIsNotTheRows) {
  const test::TempFolder temp;
  const SequenceFrame row = make_frame(temp / "frame-5", 5, kVolumeBytes);
  make_frame(temp / "frame-5", 5, "another volume, as of --cold");
  EXPECT_FALSE(holds_volume(temp / "frame-5", row));
}

TEST(SequenceState, ABatchsChunkHoldsAsLongAsAllItsVolumesDo) {
  for (const Damage& damage : damages())
    for (const std::uint64_t damaged : {4, 5}) {
      const test::TempFolder temp;
      SequenceTold told;
      for (const std::uint64_t frame : {4, 5})
        told.frames.push_back(make_frame(temp / fmt::format("frame-{}", frame), frame, kVolumeBytes));
      fs::create_directory(temp / "sequence");
      put_bytes(temp / "sequence/frames.json", report::sequence_json(told));
      EXPECT_TRUE(chunk_holds(temp.path(), 2));
      EXPECT_FALSE(chunk_holds(temp.path(), 3)) << "one frame was never tried";
      damage.make(temp / fmt::format("frame-{}", damaged));
      EXPECT_EQ(chunk_holds(temp.path(), 2), damage.holds) << damage.what;
      EXPECT_TRUE(fs::exists(temp / "sequence"));
      put_bytes(temp / "sequence/frames.json", report::sequence_json(told).substr(0, 200));
      EXPECT_FALSE(chunk_holds(temp.path(), 2));
      EXPECT_FALSE(fs::exists(temp / "sequence")) << "so that all frames are made again";
    }
}

TEST(SequenceState, AnOptionsFileIsKnownByWhatItHolds) {
  const test::TempFolder temp;
  put_bytes(temp / "rig.json", "one");
  const auto given = [&](std::vector<std::string> words) {
    std::map<std::string, std::string> options;
    const CommandLine line;
    const Verb verb = line.program().add_verb("verb", "A verb");
    std::string rig, voxels, out;
    int threads = 0;
    verb.add_option("--rig", rig, "A file");
    verb.add_option("--voxels", voxels, "A number");
    verb.add_option("--out", out, "A folder");
    verb.add_threads(threads);
    verb.set_action([&] { options = given_options(verb, {"--out", "--threads", "--help"}); });
    words.insert(words.begin(), "verb");
    line.parse(words);
    return options;
  };
  const std::string rig = (temp / "rig.json").string();
  const auto before = given({"--rig", rig, "--voxels", "16", "--out", "a", "--threads", "1"});
  EXPECT_EQ(before, given({"--threads", "2", "--voxels", "16", "--rig", rig}));
  EXPECT_NE(before, given({"--voxels", "24", "--rig", rig}));
  EXPECT_NE(before, given({"--rig", rig}));
  put_bytes(temp / "rig.json", "two");
  EXPECT_NE(before, given({"--rig", rig, "--voxels", "16"}));
}

}  // namespace
}  // namespace emberlock::cli
