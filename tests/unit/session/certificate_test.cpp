// SPDX-License-Identifier: Apache-2.0
#include "session/certificate.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/random.h"
#include "session/files.h"
#include "session/verify.h"
#include "tests/support/recording.h"
#include "tests/support/signing_key.h"

namespace emberlock::session {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using testing::ElementsAre;
using testing::HasSubstr;

class SessionCertificateTest : public testing::Test {
 protected:
  SessionCertificateTest() {
    WriterOptions options = test::small_disk_options();
    options.frames_per_segment = 2;
    test::record(session_, {{48, 32}, PixelFormat::gray8, 8}, 5, options);
  }
  void certify(const SigningKey* key = nullptr) {
    const auto done = certify_session(session_, "emberlock 1", key);
    ASSERT_TRUE(done.ok()) << done.error().message();
  }
  /// Of the certificate itself, or of the files.
  [[nodiscard]] std::vector<std::string> problems() const {
    const auto check = check_certificate(session_);
    if (!check) return {check.error().what};
    if (!*check) return {"has none"};
    return (*check)->problems;
  }
  [[nodiscard]] std::vector<fs::path> files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(session_))
      if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }

  test::TempFolder folder_;
  fs::path session_ = folder_ / "take";
  SigningKey key_ = SigningKey::read(test::KeyFiles(folder_ / "key", 1).private_pem).value();
  SigningKey other_ = SigningKey::read(test::KeyFiles(folder_ / "other", 2).private_pem).value();
};

TEST_F(SessionCertificateTest, TellsEachFileAndHoldsAsLongAsNoneChanges) {
  const std::size_t before = files().size();
  certify(&key_);
  const auto check = check_certificate(session_);
  ASSERT_TRUE(check.ok() && *check);
  EXPECT_EQ((*check)->certificate.files_size(), static_cast<int>(before));
  EXPECT_EQ((*check)->certificate.session_id(), "test");
  EXPECT_EQ((*check)->seal.key, key_.public_key());
  EXPECT_TRUE((*check)->problems.empty());
  const auto verified = verify_session(session_);
  ASSERT_TRUE(verified.ok());
  EXPECT_TRUE(verified->whole()) << testing::PrintToString(verified->problems);
  EXPECT_EQ(verified->certified_files, before);
  EXPECT_EQ(verified->certified_by, key_.public_key());
}

TEST_F(SessionCertificateTest, EqualSessionsHaveEqualOnes) {
  certify(&key_);
  const std::string first = bytes_of(certificate_path(session_));
  certify(&key_);
  EXPECT_EQ(bytes_of(certificate_path(session_)), first);
}

using SessionCertificateSlow = SessionCertificateTest;
TEST_F(SessionCertificateSlow, OneChangedByteInAnyFileIsFound) {
  for (const SigningKey* key : {static_cast<const SigningKey*>(nullptr), &std::as_const(key_)}) {
    certify(key);
    std::vector<fs::path> all = files();
    std::erase_if(all, [](const fs::path& path) { return fs::file_size(path) == 0; });
    ASSERT_THAT(problems(), ElementsAre());
    RandomStream random(7, 1);
    int found = 0;
    for (int trial = 0; trial < 1000; ++trial) {
      const fs::path& path = all[random.bits() % all.size()];
      const std::string bytes = bytes_of(path);
      std::string changed = bytes;
      char& byte = changed[random.bits() % changed.size()];
      byte = static_cast<char>(byte ^ static_cast<char>(1 + random.bits() % 255));
      put_bytes(path, changed);
      if (!problems().empty()) ++found;
      put_bytes(path, bytes);
    }
    EXPECT_EQ(found, 1000);
  }
}

TEST_F(SessionCertificateTest, FilesThatAreAddedMissingOrCutAreNamed) {
  certify();
  put_bytes(session_ / "cam0" / "extra.txt", "");
  EXPECT_THAT(problems(), ElementsAre("cam0/extra.txt: was added after it was certified"));
  fs::remove(session_ / "cam0" / "extra.txt");
  const fs::path index = index_path(session_, "cam0");
  const std::string bytes = bytes_of(index);
  put_bytes(index, std::string_view(bytes).substr(0, bytes.size() - 1));
  EXPECT_THAT(problems(),
              ElementsAre("cam0/index.bin: has " + std::to_string(bytes.size() - 1) + " bytes, and had " +
                          std::to_string(bytes.size()) + " when it was certified"));
  fs::remove(index);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("cam0/index.bin: is missing")));
  put_bytes(index, bytes);
  EXPECT_THAT(problems(), ElementsAre());
}

TEST_F(SessionCertificateTest, VerifyingASessionNamesWhatIsNotAsCertified) {
  certify();
  put_bytes(session_ / "import.html", "not of this session");
  const auto check = verify_session(session_);
  ASSERT_TRUE(check.ok());
  EXPECT_FALSE(check->whole());
  EXPECT_THAT(check->problems, ElementsAre("import.html: was added after it was certified"));
  EXPECT_THAT(check->to_do, HasSubstr("certify the session anew"));
  EXPECT_EQ(check->certified_files, 0U);
}

TEST_F(SessionCertificateTest, AForgerySignedByAnotherKeyIsFoundByTheTrustedOne) {
  certify(&key_);
  put_bytes(session_ / "cam0" / "extra.txt", "forged");
  certify(&other_);
  const auto check = check_certificate(session_);
  ASSERT_TRUE(check.ok() && *check);
  EXPECT_TRUE((*check)->problems.empty()) << "the forger's own key does hold";
  EXPECT_THAT(check_signer((*check)->seal, key_.public_key(), "take").error().message(),
              HasSubstr("is signed by another key: " + other_.public_key()));
  certify(nullptr);
  const auto bare = check_certificate(session_);
  EXPECT_THAT(check_signer((*bare)->seal, key_.public_key(), "take").error().message(),
              HasSubstr("isn't signed"));
}

TEST_F(SessionCertificateTest, WhatIsCutTwiceOrOfAnotherVersionIsAClearError) {
  certify();
  const fs::path path = certificate_path(session_);
  const std::string text = bytes_of(path);
  const auto seal_anew = [&](std::string changed) {  // as a forger, or another version, would
    const std::size_t place = place_of_seal(changed, "").value();
    put_bytes(path, sealed(changed.replace(place, kSealLength, blank_seal(nullptr)), place, nullptr,
                           kSealsSession));
  };
  for (const std::size_t cut : {std::size_t{0}, std::size_t{1}, text.size() / 2, text.size() - 1}) {
    put_bytes(path, text.substr(0, cut));
    EXPECT_THAT(problems(), ElementsAre(HasSubstr("doesn't end in its seal"))) << cut;
  }
  put_bytes(path, text + text);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("its bytes were changed")));
  std::string version = text;
  version.replace(version.find("version\": 1"), 11, "version\": 2");
  seal_anew(version);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("of version 2, this program reads version 1")));
  std::string seal = text;
  seal.replace(seal.find("emberlock-seal-1"), 16, "emberlock-seal-2");
  put_bytes(path, seal);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("seal of another version")));
}

TEST_F(SessionCertificateTest, ANameThatLeadsOutOfTheFolderIsAMissingFile) {
  put_bytes(folder_ / "outside", "secret");
  google::protobuf::RepeatedPtrField<v1::HashedFile> files;
  for (const std::string& name : {std::string("../outside"), (folder_ / "outside").string()}) {
    v1::HashedFile& file = *files.Add();
    file.set_file(name);
    file.set_bytes(6);
    file.set_sha256("2bb80d537b1da3e38bd30361aa855686bde0eacd7162fef6a25fe97bf527a25b");
  }
  const auto changed = changed_files(session_, files);
  ASSERT_TRUE(changed.ok());
  EXPECT_THAT(*changed, ElementsAre(HasSubstr("is missing"), HasSubstr("is missing")));
}

TEST_F(SessionCertificateTest, UnfinishedSessionsLinksAndInterruptionsAreRefused) {
  const auto refused = [&](const Observer& observer = {}) {
    const auto done = certify_session(session_, "", nullptr, observer);
    return done.ok() ? std::string("certified") : done.error().what;
  };
  EXPECT_EQ(refused([](double, std::string_view) { return false; }), "ended early, as asked");
  fs::create_symlink(session_ / "manifest.json", session_ / "link");
  EXPECT_THAT(refused(), HasSubstr("is a link"));
  fs::remove(session_ / "link");
  ASSERT_EQ(::mkfifo((session_ / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(refused(), HasSubstr("neither a file nor a folder"));
  fs::remove(session_ / "pipe");
  v1::Manifest manifest = read_manifest(session_).value();
  manifest.set_state(v1::Manifest::RECORDING);
  ASSERT_TRUE(write_manifest(session_, manifest).ok());
  EXPECT_EQ(refused(), "its recording didn't end");
  EXPECT_FALSE(fs::exists(certificate_path(session_)));
}

}  // namespace
}  // namespace emberlock::session
