// SPDX-License-Identifier: Apache-2.0
#include "rig/config/preflight.h"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "rig/access.h"
#include "tests/support/certificate.h"
#include "tests/support/temp_folder.h"

namespace emberlock::rig {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Preflight : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text, unsigned mode = 0600) const {
    std::ofstream(folder_ / name) << text;
    fs::permissions(folder_ / name, static_cast<fs::perms>(mode));
    return folder_ / name;
  }
  /// Of a file that says this, after folders that exist.
  std::vector<Error> problems(const std::string& text) const {
    return check_config(write("lab.toml", text + "\n[recording]\nfolder = \"sessions\"\n"));
  }

  const test::TempFolder folder_;
};

constexpr const char* kServer = "[server]\nsocket = \"here.sock\"\n";

TEST_F(Preflight, AFileWhoseFoldersCanBeMadeIsFine) { EXPECT_THAT(problems(kServer), IsEmpty()); }

TEST_F(Preflight, AFileThatIsNotThereIsNamed) {
  const auto found = check_config(folder_ / "absent.toml");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found.front().message(), HasSubstr("absent.toml"));
}

TEST_F(Preflight, ProblemsOfTheTextComeFirst) {
  const auto found = problems("[log]\nlevel = 3\nfolder = 4");
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_THAT(found.front().where, HasSubstr("lab.toml:2:9"));
}

TEST_F(Preflight, ATokenThatEverybodyReadsIsRefused) {
  write("token", "0123456789abcdef0123\n", 0644);
  const auto found = problems(kServer + std::string("token_file = \"token\""));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found.front().message(),
              HasSubstr("everybody may read or write the token (mode 0644). Make it private: chmod o= "));
  write("token", "0123456789abcdef0123\n", 0640);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), IsEmpty());
  write("token", "0123456789abcdef0123\n", 0660);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), SizeIs(1));
  write("token", "short\n", 0600);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), SizeIs(1));
}

/// Certificates of both sections: the check finds what the start would refuse, and names the key.
TEST_F(Preflight, CertificatesAreJudgedAsTheStartJudgesThem) {
  const test::CertificateAuthority authority;
  const auto put = [&](const std::string& name, const rig::TlsIdentity& identity) {
    write(name + ".crt", identity.certificate, 0644);
    write(name + ".key", identity.key);
  };
  put("good", authority.issue("localhost"));
  put("old", authority.issue("localhost", {.from = -7200, .until = -3600}));
  put("early", authority.issue("localhost", {.from = 3600, .until = 7200}));
  put("weak", authority.issue("localhost", {.rsa_bits = 1024}));
  put("strong", authority.issue("localhost", {.rsa_bits = 2048}));
  put("ca", {authority.pem(), ""});
  put("text", {"nothing", "nothing"});
  put("empty", {"", ""});
  write("open.key", authority.issue("x").key, 0644);
  struct Row {
    const char *certificate, *key, *authority, *wrong_key;
    const char* says;
  };
  const std::vector<Row> rows{
      {"good.crt", "good.key", "ca.crt", "", ""},
      {"strong.crt", "strong.key", "ca.crt", "", ""},
      {"old.crt", "old.key", "ca.crt", "certificate", "has run out"},
      {"early.crt", "early.key", "ca.crt", "certificate", "isn't valid yet"},
      {"weak.crt", "weak.key", "ca.crt", "certificate", "too small"},
      {"good.crt", "strong.key", "ca.crt", "key", "is not the key of"},
      {"text.crt", "good.key", "ca.crt", "certificate", "no certificate"},
      {"empty.crt", "good.key", "ca.crt", "certificate", "no certificate"},
      {"strong.key", "good.key", "ca.crt", "certificate", "no certificate"},
      {"good.crt", "text.key", "ca.crt", "key", "no private key"},
      {"good.crt", "good.crt", "ca.crt", "key", "everybody"},
      {"good.crt", "open.key", "ca.crt", "key", "everybody"},
      {"good.crt", "absent.key", "ca.crt", "key", ""},
      {"good.crt", "good.key", "text.crt", "authority", "no certificate"},
      {"good.crt", "good.key", "old.crt", "authority", "has run out"},
      {"good.crt", "good.key", "absent.crt", "authority", ""},
  };
  for (const Row& row : rows) {
    const auto at = [&](const char* file) { return folder_ / file; };
    const auto start = ServerTls::read(at(row.certificate), at(row.key), at(row.authority));
    EXPECT_EQ(start.ok(), *row.wrong_key == 0) << row.certificate << row.key << row.authority;
    const std::string hosts = fmt::format(
        "{}[hosts]\nlisten = \"127.0.0.1:7143\"\ncertificate = \"{}\"\nkey = \"{}\"\nauthority = \"{}\"\n",
        kServer, row.certificate, row.key, row.authority);
    const std::string server =
        fmt::format("{}tls_certificate = \"{}\"\ntls_key = \"{}\"\ntls_clients = \"{}\"\n", kServer,
                    row.certificate, row.key, row.authority);
    const std::string wrong = row.wrong_key;
    for (const auto& [text, key] :
         {std::pair(hosts, "hosts." + wrong),
          std::pair(server, "server.tls_" + (wrong == "authority" ? "clients" : wrong))}) {
      const auto found = problems(text);
      ASSERT_THAT(found, SizeIs(start.ok() ? 0 : 1)) << text;
      if (start.ok()) continue;
      EXPECT_THAT(found.front().message(), HasSubstr(key));
      EXPECT_THAT(found.front().message(), HasSubstr(row.says));
    }
  }
}

TEST_F(Preflight, ASocketIsJudgedAsTheStartJudgesIt) {
  write("file", "");
  const std::string long_name(108, 's');
  for (const auto& [path, says] :
       std::vector<std::pair<std::string, const char*>>{{"here.sock", ""},
                                                        {"new/here.sock", ""},
                                                        {"no/such/here.sock", "there is no folder"},
                                                        {"file/here.sock", "this is no folder"},
                                                        {"file", "no socket"},
                                                        {long_name, "too long"}}) {
    const auto found = problems("[server]\nsocket = \"" + path + "\"\n");
    ASSERT_THAT(found, SizeIs(*says == 0 ? 0 : 1)) << path;
    if (*says != 0) {
      EXPECT_THAT(found.front().message(), HasSubstr(says));
    }
    const auto lock = SocketLock::take(folder_ / path);
    EXPECT_EQ(lock.ok(), *says == 0) << path;
  }
}

TEST_F(Preflight, FilesThatAreNotThereAndFoldersThatAreFilesAreNamed) {
  write("sessions", "not a folder");
  const auto found = problems(kServer + std::string("tls_certificate = \"a.crt\"\ntls_key = \"a.key\"\n"
                                                    "[rig]\ncalibration = \"absent.json\"\n"
                                                    "[rig.replay]\nsession = \"absent\"\n"
                                                    "[reconstruction]\nprogram = \"./absent\"\n"));
  std::string all;
  for (const Error& problem : found) all += problem.message() + "\n";
  EXPECT_THAT(found, SizeIs(6)) << all;
  for (const char* part : {"recording.folder", "server.tls_certificate", "server.tls_key", "absent.json",
                           "reconstruction.program"}) {
    EXPECT_THAT(all, HasSubstr(part));
  }
}

}  // namespace
}  // namespace emberlock::rig
