// SPDX-License-Identifier: Apache-2.0
#include "recon/export/certificate.h"

#include <cstring>
#include <filesystem>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "base/sha256.h"
#include "recon/export/vdb_header.h"
#include "recon/export/vdb_identity.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/certify.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"
#include "tests/support/signing_key.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using session::blank_seal;
using session::kSealLength;
using test::bytes_of;
using test::put_bytes;
using testing::HasSubstr;

Volume a_flame() {
  Volume volume;
  volume.grid = {{0, 0, 0}, 0.01F, 5, 4, 3};
  volume.emission.assign(3 * volume.grid.size(), 0.0F);
  for (std::size_t i = 0; i < volume.emission.size(); i += 2) volume.emission[i] = static_cast<float>(i);
  return volume;
}

class VolumeCertificateTest : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::shared_ptr<const SigningKey>& key = {}) const {
    Certification certification = simulated();
    certification.certificate.set_program("emberlock 1");
    certification.key = key;
    const fs::path path = folder_ / name;
    const Status done = write_volume(a_flame(), path, {}, {}, certification);
    EXPECT_TRUE(done.ok()) << done.error().message();
    return path;
  }
  std::shared_ptr<const SigningKey> key(unsigned char seed) const {
    const test::KeyFiles files(folder_ / ("key" + std::to_string(seed)), seed);
    return std::make_shared<const SigningKey>(SigningKey::read(files.private_pem).value());
  }
  /// "holds", "none", or what is wrong.
  static std::string checked(const fs::path& path) {
    const auto found = check_volume(path);
    return !found ? found.error().what : *found ? "holds" : "none";
  }
  /// Seals the bytes again, as a forger would.
  static void reseal(const fs::path& path, std::string bytes, const SigningKey* by) {
    std::istringstream file(bytes);
    const VdbText found = find_vdb_text(file, kCertificateKey, "").value().value();
    const std::size_t place = found.offset + session::place_of_seal(found.text, "").value();
    put_bytes(path, bytes.replace(place, kSealLength, blank_seal(by)));
    ASSERT_TRUE(session::seal_file(path, place, by, session::kSealsVolume).ok());
  }

  test::TempFolder folder_;
};

TEST_F(VolumeCertificateTest, EqualVolumesAreEqualFilesSignedOrNot) {
  EXPECT_EQ(bytes_of(write("a.vdb")), bytes_of(write("b.vdb")));
  EXPECT_EQ(bytes_of(write("a.vdb", key(1))), bytes_of(write("b.vdb", key(1))));
  EXPECT_NE(bytes_of(write("a.vdb", key(1))), bytes_of(write("b.vdb", key(2))));
}

TEST_F(VolumeCertificateTest, SaysWhatWasWritten) {
  const auto found = check_volume(write("a.vdb", key(1)));
  ASSERT_TRUE(found.ok() && *found) << found.error().message();
  EXPECT_EQ((*found)->certificate.origin(), v1::VolumeCertificate::SIMULATION);
  EXPECT_EQ((*found)->certificate.program(), "emberlock 1");
  EXPECT_EQ((*found)->seal.key, key(1)->public_key());
  EXPECT_EQ((*found)->bytes, fs::file_size(folder_ / "a.vdb"));
}

TEST_F(VolumeCertificateTest, OneChangedByteIsFound) {
  for (const auto& by : {std::shared_ptr<const SigningKey>(), key(1)}) {
    const fs::path path = write("a.vdb", by);
    const std::string bytes = bytes_of(path);
    RandomStream random(5, 1);
    int found = 0;
    for (int trial = 0; trial < 1000; ++trial) {
      std::string changed = bytes;
      char& byte = changed[random.bits() % changed.size()];
      byte = static_cast<char>(byte ^ static_cast<char>(1 + random.bits() % 255));
      put_bytes(path, changed);
      if (checked(path) != "holds") ++found;
    }
    EXPECT_EQ(found, 1000);
  }
}

TEST_F(VolumeCertificateTest, EachByteOfTheSealIsCovered) {
  for (const auto& by : {std::shared_ptr<const SigningKey>(), key(1)}) {
    const fs::path path = write("a.vdb", by);
    const std::string bytes = bytes_of(path);
    const std::size_t seal = bytes.find("emberlock-seal-1");
    for (std::size_t i = seal; i < seal + kSealLength; ++i) {
      std::string changed = bytes;
      changed[i] = changed[i] == '0' ? '1' : '0';
      put_bytes(path, changed);
      EXPECT_NE(checked(path), "holds") << i - seal;
    }
  }
}

TEST_F(VolumeCertificateTest, AForgerySealedWithAnotherKeyIsFoundByTheTrustedOne) {
  const fs::path path = write("a.vdb", key(1));
  std::string forged = bytes_of(path);
  forged.replace(forged.find("SIMULATION"), 10, "PICTURES\" ");  // no longer JSON
  reseal(path, forged, key(2).get());
  EXPECT_THAT(checked(path), HasSubstr("not a certificate"));
  forged = bytes_of(write("a.vdb", key(1)));
  forged.replace(forged.find("emberlock 1"), 11, "emberlock 2");
  reseal(path, forged, key(2).get());
  const auto found = check_volume(path);
  ASSERT_TRUE(found.ok() && *found) << "the forger's own key does hold";
  EXPECT_THAT(session::check_signer((*found)->seal, key(1)->public_key(), "a.vdb"),
              FailsWith("is signed by another key"));
  reseal(path, forged, nullptr);
  EXPECT_THAT(session::check_signer(check_volume(path).value()->seal, key(1)->public_key(), "").error().what,
              HasSubstr("isn't signed"));
}

TEST_F(VolumeCertificateTest, ASignatureOfASessionIsNoneOfAVolume) {
  const fs::path path = write("a.vdb", key(1));
  std::string bytes = bytes_of(path);
  const std::size_t place = bytes.find("emberlock-seal-1");
  put_bytes(path, bytes.replace(place, kSealLength, blank_seal(key(1).get())));
  ASSERT_TRUE(session::seal_file(path, place, key(1).get(), session::kSealsSession).ok());
  EXPECT_THAT(checked(path), HasSubstr("isn't by the key that it names"));
}

TEST_F(VolumeCertificateTest, AVolumeThatIsCutIsAClearError) {
  const fs::path path = write("a.vdb");
  const std::string bytes = bytes_of(path);
  for (std::size_t cut = 0; cut < bytes.size(); cut += 1 + cut / 40) {
    put_bytes(path, bytes.substr(0, cut));
    const auto found = check_volume(path);
    ASSERT_FALSE(found.ok()) << cut;
    EXPECT_EQ(found.error().where, path.string());
  }
}

TEST_F(VolumeCertificateTest, OneOfAnotherVersionIsAClearError) {
  const fs::path path = write("a.vdb");
  std::string bytes = bytes_of(path);
  bytes.replace(bytes.find("version\": 1"), 11, "version\": 7");
  reseal(path, bytes, nullptr);
  EXPECT_THAT(checked(path), HasSubstr("of version 7, this program reads version 1"));
}

TEST_F(VolumeCertificateTest, AVolumeWithoutOneIsReadAsBefore) {
  const fs::path path = write("a.vdb");
  std::string bytes = bytes_of(path);
  bytes.replace(bytes.find(kCertificateKey), 20, "emberlock_something_");  // as if no certificate were there
  put_bytes(path, bytes);
  EXPECT_THAT(read_volume(path), FailsWith("carries no certificate"));
  identify_by_content(path);  // as those volumes are
  EXPECT_EQ(checked(path), "none");
  const auto volume = value_of(read_volume(path));
  EXPECT_EQ(volume.emission, a_flame().emission);
  EXPECT_TRUE(read_shared_volume(path).ok());
  EXPECT_TRUE(read_lighting(path).ok());
  const auto exported = value_of(origin_of_export(path));
  EXPECT_FALSE(exported.has_exported());
}

TEST_F(VolumeCertificateTest, AnExportTellsOfTheVolumeThatItIsOf) {
  const fs::path path = write("a.vdb", key(1));
  SharedVolume shared = read_shared_volume(path).value();
  shared.certification.certificate = origin_of_export(path).value();
  for (const VdbSamples samples : {VdbSamples::at_index, VdbSamples::half_an_edge_later}) {
    ASSERT_TRUE(write_vdb(shared, folder_ / "flame.vdb", samples).ok());
    const auto found = check_volume(folder_ / "flame.vdb");
    ASSERT_TRUE(found.ok() && *found) << found.error().message();
    const v1::VolumeCertificate& told = (*found)->certificate;
    EXPECT_EQ(told.origin(), v1::VolumeCertificate::VOLUME);
    EXPECT_EQ(told.made_from(0).sha256(), sha256(bytes_of(path)));
    EXPECT_EQ(told.exported().program(), "emberlock 1");
    EXPECT_THAT(told.exported().seal(), HasSubstr("key:" + key(1)->public_key()));
  }
}

TEST_F(VolumeCertificateTest, NothingIsCertifiedOfAVolumeThatWasChanged) {
  const fs::path path = write("a.vdb");
  std::string bytes = bytes_of(path);
  bytes[bytes.size() / 2] ^= 1;
  put_bytes(path, bytes);
  EXPECT_EQ(origin_of_export(path).error().kind, ErrorKind::refused);
}

// --- headers that anybody may have made

std::string sized(const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  std::string bytes(sizeof size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  return bytes + text;
}
std::string vdb_with(std::uint32_t count, const std::string& metadata) {
  std::string bytes(8 + 12 + 1 + 36, '\0');
  bytes.replace(0, 4, " BDV");
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  return bytes + metadata;
}
std::string found_in(const std::string& bytes) {
  std::istringstream file(bytes);
  const auto found = find_vdb_text(file, "key", "x.vdb");
  if (!found) return found.error().what;
  return *found ? (*found)->text : "nothing";
}

TEST(VdbHeader, AMetadatumIsFoundAmongOthers) {
  const std::string other = sized("other") + sized("float") + sized("1234");
  const std::string key = sized("key") + sized("string") + sized("text");
  EXPECT_EQ(found_in(vdb_with(2, other + key)), "text");
  EXPECT_EQ(found_in(vdb_with(1, other)), "nothing");
  EXPECT_EQ(found_in(vdb_with(0, "")), "nothing");
  std::istringstream file(vdb_with(2, other + key));
  const std::string bytes = file.str();
  EXPECT_EQ(bytes.substr(find_vdb_text(file, "key", "").value()->offset), "text");
}

TEST(VdbHeader, SizesAreNotTrusted) {
  const std::string key = sized("key") + sized("string") + sized("text");
  const std::string huge(4, '\xff');
  EXPECT_EQ(found_in(vdb_with(2, key + key)), "has key twice");
  EXPECT_EQ(found_in(vdb_with(1, sized("key") + sized("float") + sized("1234"))), "has a damaged key");
  EXPECT_EQ(found_in(vdb_with(1, sized("key") + sized("string") + huge)), "is cut short in its key");
  EXPECT_THAT(found_in(vdb_with(1, huge)), HasSubstr("is cut short in its header"));
  EXPECT_THAT(found_in(vdb_with(1, sized("other") + sized("float") + huge)), HasSubstr("is cut short"));
  EXPECT_THAT(found_in(vdb_with(2, key)), HasSubstr("is cut short in its header"));
  EXPECT_EQ(found_in(vdb_with(0xffffffff, key)), "has a damaged header");
  EXPECT_EQ(found_in("not a volume"), "isn't an OpenVDB file");
  EXPECT_EQ(found_in(""), "isn't an OpenVDB file");
}

}  // namespace
}  // namespace emberlock::recon
