// SPDX-License-Identifier: Apache-2.0
#include "base/signature.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/hex.h"
#include "base/sha256.h"
#include "tests/support/signing_key.h"
#include "tests/support/temp_folder.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class InAFolder : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  test::TempFolder temp_;
  const fs::path& folder_ = temp_.path();
};
class FileHashTest : public InAFolder {};
class SignatureTest : public InAFolder {};

TEST(Sha256, IsWhatTheStandardSaysOfItsExamples) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-4
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_F(FileHashTest, DoesNotDependOnHowTheBytesComeAndAFilesIsThatOfItsBytes) {
  std::string bytes((3 << 20) + 7, 'x');
  for (std::size_t i = 0; i < bytes.size(); i += 999) bytes[i] = static_cast<char>(i);
  Sha256 parts;
  for (std::size_t at = 0; at < bytes.size(); at += 100'003)
    parts.add(std::string_view(bytes).substr(at, 100'003));
  EXPECT_EQ(parts.hex(), sha256(bytes));
  put("file", bytes);
  double seen = 0;
  const auto hash = hash_file(folder_ / "file", [&](double share, std::string_view) {
    EXPECT_GE(share, seen);
    seen = share;
    return true;
  });
  ASSERT_TRUE(hash.ok());
  EXPECT_EQ(hash->sha256, sha256(bytes));
  EXPECT_EQ(hash->bytes, bytes.size());
  EXPECT_EQ(seen, 1);
  EXPECT_EQ(hash_file(folder_ / "file", [](double, std::string_view) { return false; }).error().kind,
            ErrorKind::refused);
  EXPECT_EQ(hash_file(folder_ / "none").error().kind, ErrorKind::bad_input);
}

// RFC 8032, 7.1, TEST 2.
TEST_F(SignatureTest, IsWhatTheStandardSaysOfItsExample) {
  const std::string seed = from_hex("4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb");
  std::array<unsigned char, 32> bytes{};
  std::copy(seed.begin(), seed.end(), bytes.begin());
  const test::KeyFiles files(folder_, bytes);
  const auto key = SigningKey::read(files.private_pem);
  ASSERT_TRUE(key.ok()) << key.error().message();
  EXPECT_EQ(key->public_key(), "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c");
  EXPECT_EQ(read_public_key(files.public_pem).value(), key->public_key());
  EXPECT_EQ(key->sign("\x72"),
            "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da"
            "085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00");
}

TEST_F(SignatureTest, HoldsForItsTextAndItsKeyAlone) {
  const auto key = SigningKey::read(test::KeyFiles(folder_ / "one", 1).private_pem);
  const auto other = SigningKey::read(test::KeyFiles(folder_ / "two", 2).private_pem);
  ASSERT_TRUE(key.ok() && other.ok());
  const std::string signature = key->sign("a flame");
  EXPECT_TRUE(is_signed_by(key->public_key(), "a flame", signature));
  EXPECT_FALSE(is_signed_by(key->public_key(), "a Flame", signature));
  EXPECT_FALSE(is_signed_by(other->public_key(), "a flame", signature));
  for (std::size_t i = 0; i < signature.size(); ++i) {
    std::string changed = signature;
    changed[i] = changed[i] == '0' ? '1' : '0';
    EXPECT_FALSE(is_signed_by(key->public_key(), "a flame", changed)) << i;
  }
  EXPECT_FALSE(is_signed_by(key->public_key(), "a flame", "no digits"));
}

TEST_F(SignatureTest, FilesThatAreNoKeyAreRefusedWithTheCommandThatMakesOne) {
  const test::KeyFiles files(folder_, 3);
  put("text.pem", "hello");
  for (const auto& path : {folder_ / "text.pem", files.public_pem}) {
    const auto key = SigningKey::read(path);
    ASSERT_FALSE(key.ok());
    EXPECT_EQ(key.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(key.error().message(), HasSubstr("openssl genpkey -algorithm ed25519"));
  }
  EXPECT_FALSE(read_public_key(files.private_pem).ok());
  EXPECT_FALSE(SigningKey::read(folder_ / "none.pem").ok());
}

}  // namespace
}  // namespace emberlock
