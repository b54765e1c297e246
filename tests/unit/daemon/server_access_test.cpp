// SPDX-License-Identifier: Apache-2.0
// Who may ask the daemon: tokens, and what browsers tell of themselves.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "daemon/server/http_request.h"
#include "rig/access.h"
#include "tests/support/certificate.h"
#include "tests/support/recording.h"

namespace emberlock::daemon {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kSecret = "0123456789abcdef";

rig::Token token() { return *rig::Token::parse(kSecret); }

TEST(ServerAccess, ATokenMatchesItselfAndNothingElse) {
  EXPECT_TRUE(token().matches(kSecret));
  EXPECT_FALSE(token().matches(""));
  EXPECT_FALSE(token().matches(kSecret + "0"));
  for (std::size_t i = 0; i < kSecret.size(); ++i) {
    EXPECT_FALSE(token().matches(kSecret.substr(0, i)));
    std::string other = kSecret;
    other[i] ^= 1;  // whichever place differs
    EXPECT_FALSE(token().matches(other));
  }
  EXPECT_FALSE(token().matches(kSecret + '\0'));
}

TEST(ServerAccess, WhatCanNotStandInAHeaderIsNoToken) {
  EXPECT_TRUE(rig::Token::parse(kSecret + "\r\n").ok()) << "as an editor ends a line";
  EXPECT_TRUE(rig::Token::parse(std::string(rig::Token::kLongest, 'a')).ok());
  for (const std::string& wrong :
       {std::string(), kSecret.substr(1), std::string(rig::Token::kLongest + 1, 'a'), kSecret + " x",
        kSecret + "\nx", kSecret + ";", kSecret + '\0', kSecret + "\xc3\xa4"})
    EXPECT_FALSE(rig::Token::parse(wrong).ok()) << testing::PrintToString(wrong);
}

TEST(ServerAccess, ATokenIsMadeOnceForItsOwnerAloneAndReadAgain) {
  const test::TempFolder folder;
  const auto file = folder / "token";
  ASSERT_TRUE(rig::make_token(file).ok());
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  EXPECT_TRUE(rig::Token::read(file).ok());
  EXPECT_FALSE(rig::make_token(file).ok()) << "clients may have it";
  ASSERT_TRUE(rig::make_token(folder / "other").ok());
  EXPECT_FALSE(rig::Token::read(file)->matches(*read_file(folder / "other")));
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  EXPECT_THAT(rig::Token::read(file).error().message(), HasSubstr("everybody may read or write the token"));
  EXPECT_THAT(rig::Token::read(file).error().remedy, HasSubstr("chmod o="));
  ASSERT_EQ(::chmod(file.c_str(), 0660), 0);
  EXPECT_THAT(rig::Token::read(file).error().remedy, HasSubstr("chmod g-w"));
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
  EXPECT_TRUE(rig::Token::read(file).ok()) << "the group of the daemon's user";
  if (::geteuid() == 0) {
    constexpr unsigned kUser = 64001;
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    ASSERT_EQ(::chown(file.c_str(), kUser + 1, kUser), 0);
    ASSERT_EQ(::setegid(kUser), 0);
    ASSERT_EQ(::seteuid(kUser), 0);
    EXPECT_THAT(rig::Token::read(file).error().message(), HasSubstr("another user owns"));
    ASSERT_EQ(::seteuid(0), 0);
    ASSERT_EQ(::setegid(0), 0);
    EXPECT_TRUE(rig::Token::read(file).ok()) << "root tries a service user's files";
    ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  }
}

TEST(ServerAccess, AKeyThatOthersReadOrReplaceIsRefusedAsATokenIs) {
  const test::TempFolder folder;
  const rig::TlsIdentity one = test::CertificateAuthority().issue("localhost");
  test::write_secret(folder / "one.crt", one.certificate);
  test::write_secret(folder / "one.key", one.key);
  const auto read = [&] { return rig::TlsIdentity::read(folder / "one.crt", folder / "one.key"); };
  for (const mode_t fit : {0600, 0640, 0400}) {
    ASSERT_EQ(::chmod((folder / "one.key").c_str(), fit), 0);
    EXPECT_TRUE(read().ok()) << std::oct << fit;
  }
  for (const auto& [unfit, remedy] : {std::pair<mode_t, const char*>{0644, "chmod o="},
                                      {0604, "chmod o="},
                                      {0602, "chmod o="},
                                      {0660, "chmod g-w"}}) {
    ASSERT_EQ(::chmod((folder / "one.key").c_str(), unfit), 0);
    ASSERT_FALSE(read().ok()) << std::oct << unfit;
    EXPECT_THAT(read().error().remedy, testing::AllOf(HasSubstr(remedy), HasSubstr("one.key")));
  }
}

TEST(ServerAccess, WhatIsWrongWithCertificateOrKeyIsSaidOfTheFile) {
  const test::TempFolder folder;
  const test::CertificateAuthority authority;
  const auto write = [&](const char* name, const std::string& text) {
    test::write_secret(folder / name, text);
    return folder / name;
  };
  const rig::TlsIdentity one = authority.issue("localhost");
  const auto certificate = write("one.crt", one.certificate);
  const auto key = write("one.key", one.key);
  EXPECT_TRUE(rig::ServerTls::read(certificate, key, {}).ok());
  EXPECT_EQ(rig::ServerTls::read(certificate, key, write("ca.crt", authority.pem()))->clients,
            authority.pem());
  const auto expect = [](const Result<rig::ServerTls>& read, const std::string& file,
                         const std::string& words) {
    ASSERT_FALSE(read.ok());
    EXPECT_THAT(read.error().message(), testing::AllOf(HasSubstr(file), HasSubstr(words)));
  };
  expect(rig::ServerTls::read(folder / "absent.crt", key, {}), "absent.crt", "");
  expect(rig::ServerTls::read(key, key, {}), "one.key", "holds no certificate");
  expect(rig::ServerTls::read(certificate, certificate, {}), "one.crt", "holds no private key");
  expect(rig::ServerTls::read(certificate, write("other.key", authority.issue("x").key), {}), "other.key",
         "is not the key of");
  expect(rig::ServerTls::read(certificate, key, write("empty", "")), "empty", "holds no certificate");
}

/// A gate, and what it says of who shows this.
struct Gate {
  explicit Gate(std::optional<rig::Token> secret, HttpGate::Transport transport = HttpGate::Transport::plain)
      : gate(std::move(secret), sessions, transport) {}
  HttpAccess authorize(const HttpHead& head, const HttpTarget& target = {"/", {}, {}}) const {
    return gate.authorize(head, target, TimePoint{1});
  }
  std::shared_ptr<ConsoleSessions> sessions = std::make_shared<ConsoleSessions>();
  HttpGate gate;
};
constexpr auto kTls = HttpGate::Transport::tls;

TEST(ServerAccess, OnThisMachineAForeignNameOrSiteIsTurnedAwayWhateverItShows) {
  const Gate gate(token());
  const std::string shown = "Bearer " + kSecret;
  const auto refusal = [&](std::string_view host, std::string_view origin) -> std::optional<Refusal> {
    const auto access =
        gate.authorize({.host = host, .origin = origin, .authorization = shown, .cookie = {}});
    if (access.verdict == HttpVerdict::refused) return access.refusal;
    return std::nullopt;
  };
  for (const char* own : {"localhost", "localhost:7140", "127.0.0.1:7140", "[::1]", "[::1]:7140"}) {
    EXPECT_EQ(refusal(own, ""), std::nullopt) << own;
    EXPECT_EQ(refusal(own, std::string("http://") + own), std::nullopt) << own;
    EXPECT_EQ(refusal(own, "http://evil.example"), Refusal::foreign_origin) << own;
    EXPECT_EQ(refusal(own, "null"), Refusal::foreign_origin) << own;
  }
  for (const char* foreign : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80",
                              "[::1", "[evil]", "localhost:80:80", "1.2.3"})
    EXPECT_EQ(refusal(foreign, ""), Refusal::foreign_host) << foreign;
}

TEST(ServerAccess, OnThisMachineNobodyIsLetInWhoShowsNothing) {
  for (const std::optional<rig::Token>& secret : {std::optional<rig::Token>(), std::optional(token())}) {
    const Gate gate(secret);
    const auto access =
        gate.authorize({.host = "localhost", .origin = {}, .authorization = {}, .cookie = {}});
    EXPECT_EQ(access.verdict, HttpVerdict::refused);
    EXPECT_EQ(access.refusal, Refusal::nothing_shown);
  }
  // Where there is no token none is right, the empty one neither.
  for (const char* shown : {"Bearer ", "Bearer 0123456789abcdef"}) {
    EXPECT_EQ(Gate(std::nullopt)
                  .authorize({.host = "localhost", .origin = {}, .authorization = shown, .cookie = {}})
                  .refusal,
              Refusal::wrong_token);
  }
}

TEST(ServerAccess, ALinkOpensOnceAndItsCookieFromThenOnByTheSamePortAlone) {
  const Gate gate(std::nullopt);
  gate.sessions->serve_at("http://127.0.0.1:7140");
  const std::string url = gate.sessions->make_link(TimePoint{1}).value();
  const HttpTarget link = *parse_target(url.substr(std::string("http://127.0.0.1:7140").size()));
  const HttpHead bare{.host = "127.0.0.1:7140", .origin = {}, .authorization = {}, .cookie = {}};
  const HttpAccess first = gate.authorize(bare, link);
  ASSERT_EQ(first.verdict, HttpVerdict::give_cookie);
  EXPECT_EQ(gate.authorize(bare, link).refusal, Refusal::wrong_link) << "somebody else follows it";
  HttpHead known = bare;
  const std::string cookie = "a=b; " + first.cookie.substr(0, first.cookie.find(';')) + "; c=d";
  known.cookie = cookie;
  EXPECT_EQ(gate.authorize(known).verdict, HttpVerdict::granted);
  EXPECT_EQ(gate.authorize(known, link).verdict, HttpVerdict::granted) << "the browser's way back";
  known.host = "127.0.0.1:8000";
  EXPECT_EQ(gate.authorize(known).refusal, Refusal::nothing_shown) << "another daemon's port";
}

TEST(ServerAccess, BeyondThisMachineWhoShowsTheTokenIsWelcomeByWhateverName) {
  const Gate gate(token(), kTls);
  const auto authorize = [&](std::string_view authorization, std::string_view cookie,
                             const std::string& query) {
    return gate.authorize({.host = "lab", .origin = {}, .authorization = authorization, .cookie = cookie},
                          {.path = "/", .token = query, .link = {}});
  };
  EXPECT_EQ(authorize("Bearer " + kSecret, "", "").verdict, HttpVerdict::granted);
  EXPECT_EQ(authorize("", "", kSecret).verdict, HttpVerdict::give_cookie);
  for (const std::string& wrong : {kSecret + "0", "Basic " + kSecret, "bearer" + kSecret, kSecret}) {
    EXPECT_EQ(authorize(wrong, "", "").verdict, HttpVerdict::refused) << wrong;
    EXPECT_EQ(authorize("", "emberlock_session=" + wrong, "").refusal, Refusal::unknown_session) << wrong;
  }
  EXPECT_EQ(authorize("", "", kSecret + "0").refusal, Refusal::wrong_token);
  // Another site's page has the cookie sent along in no browser of today; it is turned away all the same.
  EXPECT_EQ(gate.authorize({.host = "lab",
                            .origin = "https://evil.example",
                            .authorization = "Bearer " + kSecret,
                            .cookie = {}})
                .refusal,
            Refusal::foreign_origin);
  EXPECT_EQ(
      gate.authorize(
              {.host = "lab", .origin = "http://lab", .authorization = "Bearer " + kSecret, .cookie = {}})
          .refusal,
      Refusal::foreign_origin)
      << "whoever is on the way can serve that page";
}

TEST(ServerAccess, ACookieIsForTheServerAloneAndOverTlsNeverSentInPlain) {
  const auto cookie = [](HttpGate::Transport transport) {
    return Gate(token(), transport).gate.cookie_for_token(kSecret, "localhost:7140", TimePoint{1}).value();
  };
  const std::string plain = cookie(HttpGate::Transport::plain);
  for (const char* part : {"emberlock_session_7140=", "; HttpOnly", "; SameSite=Strict", "; Path=/"})
    EXPECT_THAT(plain, HasSubstr(part));
  EXPECT_THAT(plain, Not(HasSubstr(kSecret))) << "the token itself stays where it was typed";
  EXPECT_THAT(plain, Not(HasSubstr("Secure")));
  EXPECT_THAT(cookie(kTls), testing::EndsWith("; Secure"));
  EXPECT_FALSE(Gate(token()).gate.cookie_for_token(kSecret + "0", "localhost", TimePoint{1}));
}

TEST(ServerAccess, ATargetIsAPathAndMayShowTheToken) {
  EXPECT_EQ(parse_target("/")->path, "/");
  const auto target = parse_target("/a/b?x=1&token=%61b%2F&y");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/a/b");
  EXPECT_EQ(target->token, "ab/");
  EXPECT_EQ(parse_target("/open?link=12&token=")->link, "12");
  EXPECT_EQ(token_of_form("token=%61b%2F"), "ab/");
  EXPECT_EQ(token_of_form("token=%6"), "");
  for (const char* wrong :
       {"", "a", "*", "http://localhost/", "/ a", "/a\n", "/?token=%", "/?token=%6", "/?token=%zz"})
    EXPECT_FALSE(parse_target(wrong)) << wrong;
}

}  // namespace
}  // namespace emberlock::daemon
