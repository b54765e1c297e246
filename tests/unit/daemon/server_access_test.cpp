// Who may ask the daemon: tokens, and what browsers tell of themselves.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "daemon/server/access.h"
#include "daemon/server/http_request.h"
#include "tests/support/certificate.h"
#include "tests/support/recording.h"

namespace emberlock {
namespace {

using testing::HasSubstr;

const std::string kSecret = "0123456789abcdef";

Token token() { return *Token::parse(kSecret); }

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
  EXPECT_TRUE(Token::parse(kSecret + "\r\n").ok()) << "as an editor ends a line";
  EXPECT_TRUE(Token::parse(std::string(Token::kLongest, 'a')).ok());
  for (const std::string& wrong :
       {std::string(), kSecret.substr(1), std::string(Token::kLongest + 1, 'a'), kSecret + " x",
        kSecret + "\nx", kSecret + ";", kSecret + '\0', kSecret + "\xc3\xa4"})
    EXPECT_FALSE(Token::parse(wrong).ok()) << testing::PrintToString(wrong);
}

TEST(ServerAccess, ATokenIsMadeOnceForItsOwnerAloneAndReadAgain) {
  const test::TempFolder folder;
  const auto file = folder / "token";
  ASSERT_TRUE(make_token(file).ok());
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  EXPECT_TRUE(Token::read(file).ok());
  EXPECT_FALSE(make_token(file).ok()) << "clients may have it";
  ASSERT_TRUE(make_token(folder / "other").ok());
  EXPECT_FALSE(Token::read(file)->matches(*read_file(folder / "other")));
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  EXPECT_THAT(Token::read(file).error().message(), HasSubstr("chmod o="));
}

TEST(ServerAccess, WhatIsWrongWithCertificateOrKeyIsSaidOfTheFile) {
  const test::TempFolder folder;
  const test::CertificateAuthority authority;
  const auto write = [&](const char* name, const std::string& text) {
    test::write_secret(folder / name, text);
    return folder / name;
  };
  const TlsIdentity one = authority.issue("localhost");
  const auto certificate = write("one.crt", one.certificate);
  const auto key = write("one.key", one.key);
  EXPECT_TRUE(ServerTls::read(certificate, key, {}).ok());
  EXPECT_EQ(ServerTls::read(certificate, key, write("ca.crt", authority.pem()))->clients, authority.pem());
  const auto expect = [](const Result<ServerTls>& read, const std::string& file, const std::string& words) {
    ASSERT_FALSE(read.ok());
    EXPECT_THAT(read.error().message(), testing::AllOf(HasSubstr(file), HasSubstr(words)));
  };
  expect(ServerTls::read(folder / "absent.crt", key, {}), "absent.crt", "");
  expect(ServerTls::read(key, key, {}), "one.key", "holds no certificate");
  expect(ServerTls::read(certificate, certificate, {}), "one.crt", "holds no private key");
  expect(ServerTls::read(certificate, write("other.key", authority.issue("x").key), {}), "other.key",
         "is not the key of");
  expect(ServerTls::read(certificate, key, write("empty", "")), "empty", "holds no certificate");
}

TEST(ServerAccess, OnThisMachineAForeignNameOrSiteIsTurnedAway) {
  const HttpGate gate(std::nullopt);
  const auto judge = [&](std::string_view host, std::string_view origin) {
    return gate.judge({.host = host, .origin = origin, .authorization = {}, .cookie = {}},
                      {.path = "/", .token = {}});
  };
  for (const char* own : {"localhost", "localhost:7140", "127.0.0.1:7140", "[::1]", "[::1]:7140"}) {
    EXPECT_EQ(judge(own, ""), HttpVerdict::welcome) << own;
    EXPECT_EQ(judge(own, std::string("http://") + own), HttpVerdict::welcome) << own;
    EXPECT_EQ(judge(own, "http://evil.example"), HttpVerdict::foreign_origin) << own;
    EXPECT_EQ(judge(own, "null"), HttpVerdict::foreign_origin) << own;
  }
  for (const char* foreign : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80",
                              "[::1", "[evil]", "localhost:80:80", "1.2.3"})
    EXPECT_EQ(judge(foreign, ""), HttpVerdict::wrong_host) << foreign;
}

TEST(ServerAccess, WithATokenWhoShowsItIsWelcomeByWhateverName) {
  const HttpGate gate(token());
  const auto judge = [&](std::string_view authorization, std::string_view cookie, const std::string& query) {
    return gate.judge({.host = "lab", .origin = {}, .authorization = authorization, .cookie = cookie},
                      {.path = "/", .token = query});
  };
  EXPECT_EQ(judge("Bearer " + kSecret, "", ""), HttpVerdict::welcome);
  EXPECT_EQ(judge("", "a=b; emberlock_token=" + kSecret + "; c=d", ""), HttpVerdict::welcome);
  EXPECT_EQ(judge("", "", kSecret), HttpVerdict::give_cookie);
  for (const std::string& wrong : {std::string(), kSecret + "0", "Basic " + kSecret, "bearer" + kSecret}) {
    EXPECT_EQ(judge(wrong, "", ""), HttpVerdict::no_token) << wrong;
    EXPECT_EQ(judge("", "emberlock_token=" + wrong, ""), HttpVerdict::no_token) << wrong;
    EXPECT_EQ(judge("", "", wrong), HttpVerdict::no_token) << wrong;
  }
  EXPECT_EQ(judge("", "x_emberlock_token=" + kSecret, ""), HttpVerdict::no_token);
  // Another site's page has the cookie sent along in no browser of today; it is turned away all the same.
  EXPECT_EQ(gate.judge({.host = "lab",
                        .origin = "https://evil.example",
                        .authorization = "Bearer " + kSecret,
                        .cookie = {}},
                       {.path = "/", .token = {}}),
            HttpVerdict::foreign_origin);
}

TEST(ServerAccess, ACookieIsForTheServerAloneAndOverTlsNeverSentInPlain) {
  const std::string plain = HttpGate(token()).cookie_of(kSecret);
  for (const char* part :
       {"emberlock_token=0123456789abcdef;", "; HttpOnly", "; SameSite=Strict", "; Path=/"})
    EXPECT_THAT(plain, HasSubstr(part));
  EXPECT_EQ(HttpGate(token(), HttpGate::Transport::tls).cookie_of(kSecret), plain + "; Secure");
}

TEST(ServerAccess, ATargetIsAPathAndMayShowTheToken) {
  EXPECT_EQ(parse_target("/")->path, "/");
  const auto target = parse_target("/a/b?x=1&token=%61b%2F&y");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/a/b");
  EXPECT_EQ(target->token, "ab/");
  for (const char* wrong :
       {"", "a", "*", "http://localhost/", "/ a", "/a\n", "/?token=%", "/?token=%6", "/?token=%zz"})
    EXPECT_FALSE(parse_target(wrong)) << wrong;
}

}  // namespace
}  // namespace emberlock
