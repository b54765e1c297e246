// SPDX-License-Identifier: Apache-2.0
// Files that call themselves volumes. OpenVDB's readers trust what these state.
#include "recon/export/volume_kind.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "base/random.h"
#include "recon/export/certificate.h"
#include "recon/export/volume_file.h"
#include "session/seal.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using testing::HasSubstr;

class VolumeKindTest : public testing::Test {
 protected:
  void SetUp() override {
    Volume volume;
    volume.grid = {{0, 0, 0}, 0.01F, 24, 20, 16};
    volume.emission.assign(3 * volume.grid.size(), 0.0F);
    volume.extinction.assign(volume.grid.size(), 0.0F);
    RandomStream random(3, 1);
    for (std::size_t i = 0; i < volume.extinction.size(); i += 3) {
      volume.extinction[i] = static_cast<float>(random.bits() % 1000);
      volume.emission[3 * i] = static_cast<float>(random.bits() % 1000);
    }
    ASSERT_TRUE(write_volume(volume, whole_).ok());
    SharedVolume shared = read_shared_volume(whole_).value();
    ASSERT_TRUE(write_vdb(shared, folder_ / "later.vdb", VdbSamples::half_an_edge_later).ok());
  }
  /// A file of these bytes, and what every reader reports of it.
  std::string read(const std::string& bytes) {
    const fs::path path = folder_ / "changed.vdb";
    put_bytes(path, bytes);
    const auto volume = read_volume(path);
    EXPECT_EQ(read_shared_volume(path).ok(), volume.ok());
    EXPECT_EQ(read_lighting(path).ok(), volume.ok());
    EXPECT_EQ(read_grid(path, "density").ok(), volume.ok());
    (void)check_volume(path);
    if (volume) return "holds";
    EXPECT_EQ(volume.error().kind, ErrorKind::bad_input);
    EXPECT_LT(volume.error().message().size(), 5000U);
    return volume.error().what;
  }

  test::TempFolder folder_;
  fs::path whole_ = folder_ / "volume.vdb";
};
using VolumeKindTestSlow = VolumeKindTest;

std::string replaced(std::string bytes, std::size_t at, const std::string& by) {
  return bytes.replace(at, std::min(by.size(), bytes.size() - at), by.substr(0, bytes.size() - at));
}

/// One change of a volume's bytes, as a fuzzer makes them: it may be none.
std::string mutated(const std::string& bytes, RandomStream& random) {
  const std::size_t at = random.bits() % bytes.size();
  const std::size_t near = random.bits() % std::min<std::size_t>(bytes.size(), 2000);  // the header
  const std::size_t place = random.bits() % 2 == 0 ? at : near;
  const std::string end(kEndOfVolume);
  switch (random.bits() % 7) {
    case 0:
      return replaced(bytes, place, std::string(1, static_cast<char>(random.bits())));
    case 1:
      return replaced(bytes, place, std::string("\0\xca\x9a\x3b", 4));  // a length of 1e9
    case 2:
      return replaced(bytes, place, std::string(8, '\xff'));
    case 3:
      return bytes.substr(0, at) + end;  // cut, and closed again
    case 4:
      return bytes.substr(0, place) + bytes.substr(at / 2, 64) + bytes.substr(place);
    case 5:
      return replaced(bytes, place, std::string(64, '\0'));
    default:
      return replaced(bytes, bytes.find("emberlock_cert") + random.bits() % 14, "x");
  }
}

/// Calls act(mutation, its number), which may take no more than 100 MB.
void each_mutation(const std::string& whole, int count,
                   const std::function<void(const std::string&, int)>& act) {
  rusage before{}, after{};
  ASSERT_EQ(::getrusage(RUSAGE_SELF, &before), 0);
  RandomStream random(11, 1);
  for (int i = 0; i < count; ++i) act(mutated(whole, random), i);
  ASSERT_EQ(::getrusage(RUSAGE_SELF, &after), 0);
#ifndef EMBERLOCK_SANITIZED  // sanitizers keep what is freed for a while
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100'000) << "kB";
#endif
}

void expect_no_mutation_is_read(const std::string& whole, int count,
                                const std::function<std::string(const std::string&)>& read) {
  each_mutation(whole, count, [&](const std::string& bytes, int i) {
    EXPECT_EQ(read(bytes) == "holds", bytes == whole) << i;
  });
}

/// With a seal that is that of these bytes, as long as they have room for one.
std::string forged(std::string bytes) {
  const std::size_t seal = bytes.find("emberlock-seal-1");
  if (seal == std::string::npos || seal + session::kSealLength > bytes.size()) return bytes;
  bytes.replace(seal, session::kSealLength, session::blank_seal(nullptr));
  return session::sealed(std::move(bytes), seal, nullptr, session::kSealsVolume);
}

TEST_F(VolumeKindTest, NoMutationIsReadOrTakesMemory) {
  expect_no_mutation_is_read(bytes_of(whole_), 200, [this](const std::string& b) { return read(b); });
}

TEST_F(VolumeKindTestSlow, NoMutationIsReadOrTakesMemory) {
  expect_no_mutation_is_read(bytes_of(whole_), 2000, [this](const std::string& b) { return read(b); });
}

TEST_F(VolumeKindTest, AForgedSealTakesNoMemoryEither) {
  const fs::path path = folder_ / "forged.vdb";
  int held = 0;
  const auto read_all = [&](const std::string& bytes) {
    put_bytes(path, forged(bytes));
    (void)read_shared_volume(path);
    (void)read_grid(path, "density");
    return read_volume(path);
  };
  const std::string whole = bytes_of(whole_);
  each_mutation(whole, 200, [&](const std::string& bytes, int) { held += read_all(bytes).ok() ? 1 : 0; });
  EXPECT_GT(held, 10) << "the seals weren't forged";
  const std::size_t dimensions = whole.find("emberlock_dimensions") + 20 + 4 + 5 + 4;
  const std::string huge = std::string("\0\x10\0\0\0\x10\0\0\0\x10\0\0", 12);  // 4096 along each edge
  EXPECT_THAT(read_all(replaced(whole, dimensions, huge)), FailsWith("more voxels than a file of its size"));
}

TEST_F(VolumeKindTest, EachKindIsNamed) {
  const std::string whole = bytes_of(whole_);
  const std::string foreign = replaced(whole.substr(0, 57), 0, " BDV") + std::string(4000, '\0');
  const std::map<std::string, std::string> kinds{
      {whole, "holds"},
      {"", "is cut short"},
      {whole.substr(0, 5), "is cut short"},
      {whole.substr(0, 40), "is cut short"},
      {whole.substr(0, 300), "is cut short"},
      {whole.substr(0, whole.size() - 1), "is cut short"},
      {foreign, "is an OpenVDB file that Emberlock hasn't written"},
      {"no volume", "isn't an OpenVDB file"},
      {" BDX" + whole.substr(4), "isn't an OpenVDB file"},
      {bytes_of(folder_ / "later.vdb"), "is an export for Blender before 5.0"},
      {replaced(whole, whole.size() / 2, "changed"), "its bytes were changed"}};
  for (const auto& [bytes, words] : kinds) EXPECT_THAT(read(bytes), HasSubstr(words)) << bytes.size();
  ASSERT_EQ(::mkfifo((folder_ / "pipe.vdb").c_str(), 0600), 0);
  EXPECT_THAT(read_volume(folder_ / "pipe.vdb").error().what, HasSubstr("not a regular file"));
  EXPECT_THAT(read_volume(folder_.path()).error().what, HasSubstr("not a regular file"));
  EXPECT_THAT(read_volume(folder_ / "absent.vdb").error().what, HasSubstr("No such file"));
  EXPECT_THAT(check_volume(folder_ / "pipe.vdb").error().what, HasSubstr("not a regular file"));
}

}  // namespace
}  // namespace emberlock::recon
