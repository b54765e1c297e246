// SPDX-License-Identifier: Apache-2.0
// Certificates as the verbs write and check them.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/certify.h"
#include "recon/synthetic/flame.h"
#include "session/files.h"
#include "tests/support/recording.h"
#include "tests/support/scene_files.h"
#include "tests/support/signing_key.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using testing::HasSubstr;
using testing::Not;
using Words = std::vector<std::string>;

test::VerbRun run_words(test::AddVerb add, const char* verb, const fs::path& what, Words words) {
  words.insert(words.begin(), {verb, what.string()});
  return test::run_verb(add, std::move(words));
}

class VerifyVolumeTest : public testing::Test {
 protected:
  /// Of a session's frame, written as `reconstruct` would.
  [[nodiscard]] fs::path volume_of_session(recon::FileHashes* hashes) const {
    test::record(session_, {{16, 8}, PixelFormat::gray8, 8}, 4, test::small_disk_options());
    recon::Certification certification;
    certification.certificate = recon::origin_of(session_, {}, {}, hashes).value();
    return write(certification);
  }
  [[nodiscard]] fs::path write(const recon::Certification& certification) const {
    recon::Volume volume;
    volume.grid = {{0, 0, 0}, 0.01F, 3, 3, 3};
    volume.emission.assign(3 * volume.grid.size(), 1.0F);
    EXPECT_TRUE(recon::write_volume(volume, folder_ / "volume.vdb", {}, {}, certification).ok());
    return folder_ / "volume.vdb";
  }
  static test::VerbRun verify(const fs::path& volume, Words words = {}) {
    return run_words(add_verify_volume, "verify-volume", volume, std::move(words));
  }
  static void change_a_byte(const fs::path& path) {
    std::string bytes = bytes_of(path);
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    put_bytes(path, bytes);
  }

  test::TempFolder folder_;
  fs::path session_ = folder_ / "take";
  test::KeyFiles key_{folder_ / "key", 1};
  test::KeyFiles other_{folder_ / "other", 2};
  recon::FileHashes hashes_;
};

TEST_F(VerifyVolumeTest, SaysWhatAVolumeOfASessionIsMadeOfAndComparesTheSession) {
  const fs::path volume = volume_of_session(&hashes_);
  const auto holds = verify(volume, {"--session", session_.string()});
  EXPECT_EQ(holds.exit_code, 0) << holds.err;
  EXPECT_THAT(holds.out, HasSubstr("holds: each of its"));
  EXPECT_THAT(holds.out, HasSubstr("session's files  4 of 4 are as they were"));
  EXPECT_THAT(holds.out, HasSubstr("session          test"));
  EXPECT_THAT(holds.out, HasSubstr("in sync          the session's files don't tell"));
  EXPECT_THAT(holds.out, HasSubstr("not calibrated"));
  change_a_byte(session::index_path(session_, "cam0"));
  const auto changed = verify(volume, {"--session", session_.string()});
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.err, HasSubstr("cam0/index.bin: isn't what was certified"));
  EXPECT_EQ(verify(volume).exit_code, 0) << "the volume itself is as it was";
}

TEST_F(VerifyVolumeTest, WhatDoesNotHoldExitsWithOneAndWhatIsNotThereWithTwo) {
  const fs::path volume = write({});
  change_a_byte(volume);
  const auto changed = verify(volume);
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.err, HasSubstr("its bytes were changed"));
  std::string bytes = bytes_of(write({}));
  bytes.replace(bytes.find(recon::kCertificateKey), 20, "emberlock_something_");
  put_bytes(volume, bytes);
  const auto none = verify(volume);
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("carries no certificate"));
  EXPECT_THAT(verify(write({}), {"--session", session_.string()}).err,
              HasSubstr("the volume isn't of a session"));
  EXPECT_THAT(verify(volume_of_session(nullptr), {"--session", session_.string()}).err,
              HasSubstr("they were left out"));
  EXPECT_EQ(verify(folder_ / "no.vdb").exit_code, 2);
}

TEST_F(VerifyVolumeTest, TheTrustedKeyMustHaveSigned) {
  recon::Certification certification = recon::simulated();
  const auto with = [&](const test::KeyFiles& files) {
    return verify(folder_ / "volume.vdb", {"--public-key", files.public_pem.string()});
  };
  EXPECT_EQ(write(certification), folder_ / "volume.vdb");
  EXPECT_THAT(with(key_).err, HasSubstr("isn't signed"));
  certification.key = std::make_shared<SigningKey>(SigningKey::read(key_.private_pem).value());
  EXPECT_EQ(write(certification), folder_ / "volume.vdb");
  EXPECT_THAT(with(key_).out, HasSubstr(certification.key->public_key() + ", the key given"));
  EXPECT_THAT(with(other_).err, HasSubstr("is signed by another key"));
  EXPECT_EQ(with(other_).exit_code, 1);
  EXPECT_THAT(verify(folder_ / "volume.vdb").out, HasSubstr("which nobody vouched for"));
}

TEST_F(VerifyVolumeTest, JsonIsForPrograms) {
  const auto run = verify(volume_of_session(&hashes_), {"--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto told = nlohmann::json::parse(run.out);
  EXPECT_TRUE(told["holds"].get<bool>());
  EXPECT_EQ(told["certificate"]["origin"], "SESSION");
  EXPECT_EQ(told["certificate"]["session"]["files"].size(), 4U);
}

TEST_F(VerifyVolumeTest, WhatForeignHandsWroteMovesNoCursor) {
  recon::Certification certification = recon::simulated();
  certification.certificate.set_program("\x1b[2J\u009b1mclean");
  EXPECT_THAT(verify(write(certification)).out, HasSubstr("?[2J?1mclean"));
}

TEST_F(VerifyVolumeTest, ReconstructWritesTheSameSignedVolumeTwiceAndExportsTellOfIt) {
  recon::PaperSceneOptions options;
  options.image = {48, 36};
  options.truth_voxels = 16;
  ASSERT_TRUE(test::write_scene(recon::paper_scene(options), folder_ / "scene").ok());
  const auto made = [&](const char* out) {
    const auto run = run_words(add_reconstruct, "reconstruct", folder_ / "scene" / "transforms.json",
                               {"--voxels", "8", "--iterations", "2", "--effects", "none", "--key",
                                key_.private_pem.string(), "--out", (folder_ / out).string()});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("certificate      signed by "));
    return bytes_of(folder_ / out / "volume.vdb");
  };
  EXPECT_EQ(made("one"), made("two"));
  const auto said = verify(folder_ / "one" / "volume.vdb", {"--public-key", key_.public_pem.string()});
  EXPECT_EQ(said.exit_code, 0) << said.err;
  EXPECT_THAT(said.out, HasSubstr("made of          pictures, without a session"));
  EXPECT_THAT(said.out, HasSubstr("options          --effects none --iterations 2"));

  const auto exported = [&](Words words) {
    words.insert(words.end(), {"--out", (folder_ / "files").string()});
    return run_words(add_export, "export", folder_ / "one", std::move(words));
  };
  EXPECT_THAT(exported({}).out, HasSubstr("certificate      unsigned"));
  const auto of_export = verify(folder_ / "files" / "flame.vdb");
  EXPECT_EQ(of_export.exit_code, 0) << of_export.err;
  EXPECT_THAT(of_export.out, HasSubstr("That volume's certificate said:\nmade of          pictures"));
  EXPECT_THAT(exported({"--format", "nvdb"}).out, HasSubstr("none: files of this format carry none"));
  EXPECT_THAT(exported({"--format", "vti", "--key", key_.private_pem.string()}).err,
              HasSubstr("carry no certificate to sign"));
  change_a_byte(folder_ / "one" / "volume.vdb");
  const auto refused = exported({});
  EXPECT_NE(refused.exit_code, 0) << "a changed volume isn't certified anew";
  EXPECT_THAT(refused.err, HasSubstr("isn't what its certificate seals"));
}

TEST_F(VerifyVolumeTest, SessionsAreCertifiedAndVerified) {
  test::record(session_, {{16, 8}, PixelFormat::gray8, 8}, 4, test::small_disk_options());
  const auto sessions = [&](Words words) { return test::run_verb(add_sessions, std::move(words)); };
  const Words verified{"sessions", "verify", session_.string(), "--public-key", key_.public_pem.string()};
  EXPECT_THAT(sessions(verified).err, HasSubstr("has no certificate"));
  const auto done = sessions({"sessions", "certify", session_.string(), "--key", key_.private_pem.string()});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("files            4, "));
  EXPECT_THAT(sessions(verified).out, HasSubstr("4 files as certified, signed by "));
  EXPECT_EQ(sessions(verified).exit_code, 0);
  put_bytes(session_ / "extra", "");
  EXPECT_THAT(sessions(verified).out, HasSubstr("extra: was added after it was certified"));
  EXPECT_EQ(sessions(verified).exit_code, 1);
  fs::remove(session_ / "extra");
  EXPECT_EQ(
      sessions({"sessions", "certify", session_.string(), "--key", other_.private_pem.string()}).exit_code,
      0);
  EXPECT_THAT(sessions(verified).err, HasSubstr("is signed by another key"));
}

}  // namespace
}  // namespace emberlock::cli
