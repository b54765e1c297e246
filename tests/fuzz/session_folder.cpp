// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include "rig/align/settings_proto.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/verify.h"
#include "tests/fuzz/target.h"

// A whole session, damaged: everything that reads one says what is good or why it can't, and agrees. The
// input is the five files of a session one after the other, each behind its length as three bytes,
// little-endian; what is left of the input belongs to the last. Frames that come are compared with their
// hashes by the reader itself; what repair leaves must be whole. Of an alignment's settings among the events
// those that are taken say the same when they are written and read again.
namespace {

namespace fs = std::filesystem;
using namespace emberlock;

constexpr const char* kFiles[] = {"manifest.json", "events.binpb", "cam0/index.bin", "cam0/000000.mkv",
                                  "cam0/000001.nut"};

const fs::path& folder() {
  static const fs::path path = [] {
    const bool memory = ::access("/dev/shm", W_OK) == 0;
    std::string name =
        ((memory ? fs::path("/dev/shm") : fs::temp_directory_path()) / "emberlock-fuzz-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    static const std::string made = name;
    std::atexit([] {
      std::error_code ec;
      fs::remove_all(made, ec);
    });
    return fs::path(name) / "s";
  }();
  return path;
}

void unpack(std::string_view bytes) {
  std::error_code ec;
  fs::remove_all(folder(), ec);
  fs::create_directories(folder() / "cam0", ec);
  for (const char* file : kFiles) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 3 && i < bytes.size(); ++i) {
      length |= std::size_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
    }
    bytes.remove_prefix(std::min<std::size_t>(3, bytes.size()));
    length = std::min(length, bytes.size());
    if (length > 0) std::ofstream(folder() / file, std::ios::binary) << bytes.substr(0, length);
    bytes.remove_prefix(length);
  }
}

void expect(bool holds) {
  if (!holds) std::abort();
}

void expect_settings_come_back(const v1::Event& event) {
  const auto options = rig::align_options(event.settings());
  if (!options.ok()) return;
  const v1::AlignmentSettings written = rig::to_proto(*options);
  const auto again = rig::align_options(written);
  expect(again.ok() && rig::to_proto(*again).SerializeAsString() == written.SerializeAsString());
}

}  // namespace

FUZZ_TARGET(session_folder) {
  unpack({reinterpret_cast<const char*>(data), size});
  const auto check = session::verify_session(folder());
  auto reader = session::SessionReader::open(folder());
  if (check && check->whole()) expect(reader.ok());
  if (reader.ok()) {
    expect(check.ok());
    for (const v1::Event& event : reader->events()) expect_settings_come_back(event);
    for (std::size_t c = 0; c < reader->camera_count(); ++c) {
      std::uint64_t good = 0;
      for (std::size_t i = 0; i < reader->stamps(c).size(); ++i) good += reader->read(c, i).ok() ? 1 : 0;
      expect(good == check->cameras.at(c).good);
    }
  }
  if (!check) return 0;
  const auto repaired = session::repair_session(folder());
  if (!repaired) return 0;
  const auto after = session::verify_session(folder());
  expect(after.ok());
  // Of a camera of which nothing is left nobody says that all is there.
  const bool all_have_frames = std::all_of(repaired->cameras.begin(), repaired->cameras.end(),
                                           [](const auto& camera) { return camera.kept > 0; });
  expect(after->whole() == all_have_frames);
  for (std::size_t c = 0; c < check->cameras.size(); ++c) {
    expect(after->cameras.at(c).good == repaired->cameras.at(c).kept);
  }
  return 0;
}
