// SPDX-License-Identifier: Apache-2.0
// Exported videos, fetched from the console's server.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/server/exported_file.h"
#include "daemon/server/http_range.h"
#include "session/store.h"
#include "tests/support/http_server.h"

namespace emberlock::daemon {
namespace {

namespace fs = std::filesystem;
using test::ask;
using test::HttpAnswer;
using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class ServerExportsTest : public test::HttpServerTest {
 protected:
  ServerExportsTest() {
    fs::create_directories(videos / "folder.mp4");
    test::put_bytes(videos / "cam 1.mp4", "film");
    test::put_bytes(folder / "secret", "secret");
    test::put_bytes(videos / ".hidden", "secret");
    test::put_bytes(folder / "exports/take 1/above.mp4", "secret");
    fs::create_symlink(folder / "secret", videos / "link.mp4");
    fs::create_directories(folder / "elsewhere");
    test::put_bytes(folder / "elsewhere/cam.mp4", "secret");
    fs::create_directories(folder / "exports/linked");
    fs::create_directory_symlink(folder / "elsewhere", folder / "exports/linked/video");
    HttpServerOptions options = with_token();
    options.export_folder = [this](std::string_view session) {
      return store.path_for_export(session, "video");
    };
    serve(std::move(options));
  }
  ~ServerExportsTest() override { server.reset(); }

  fs::path videos = folder / "exports/take 1/video";
  session::SessionStore store = session::SessionStore::open(folder / "sessions").value();
};

TEST_F(ServerExportsTest, AVideoIsSentToBeSaved) {
  const HttpAnswer answer = ask(port, "GET", "/exports/take%201/video/cam%201.mp4");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "film");
  EXPECT_THAT(answer.head, HasSubstr("Content-Type: video/mp4"));
  EXPECT_THAT(answer.head, HasSubstr("Content-Length: 4"));
  EXPECT_THAT(answer.head, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(answer.head, HasSubstr("Cache-Control: no-store"));
  EXPECT_THAT(answer.head, HasSubstr("Content-Disposition: attachment; filename=\"cam 1.mp4\"; "
                                     "filename*=UTF-8''cam%201.mp4"));
}

TEST_F(ServerExportsTest, OfAHeadRequestOnlyTheHeadIsSent) {
  const HttpAnswer answer = ask(port, "HEAD", "/exports/take%201/video/cam%201.mp4");
  EXPECT_EQ(answer.status, 200);
  EXPECT_THAT(answer.head, HasSubstr("Content-Length: 4"));
  EXPECT_THAT(answer.body, IsEmpty());
}

TEST_F(ServerExportsTest, AConnectionGoesOnAfterAVideo) {
  const std::string target = " /exports/take%201/video/cam%201.mp4 HTTP/1.1\r\n" + test::kLetIn;
  const HttpAnswer answers = test::ask_raw(
      port, "HEAD" + target + "\r\nGET" + target + "\r\nGET" + target + "Connection: close\r\n\r\n");
  EXPECT_EQ(answers.status, 200);
  const std::size_t second = answers.body.find("\r\n\r\nfilmHTTP/1.1 200");
  EXPECT_NE(second, std::string::npos);
  EXPECT_TRUE(answers.body.ends_with("\r\n\r\nfilm"));
}

/// Every range of a small file against the bytes themselves, and forms that mean the whole file.
TEST_F(ServerExportsTest, APartOfAFileIsSentAsItIsAskedFor) {
  const std::string bytes = "0123456789";
  using Kind = RangeRequest::Kind;
  const auto expect = [&](const std::string& header, Kind kind, const std::string& part) {
    const RangeRequest asked = parse_range(header, bytes.size());
    EXPECT_EQ(asked.kind, kind) << header;
    if (kind == Kind::part) {
      EXPECT_EQ(bytes.substr(asked.range.first, asked.range.length), part) << header;
    }
  };
  for (std::size_t first = 0; first <= 12; ++first) {
    const bool begins = first < bytes.size();
    const std::string from = "bytes=" + std::to_string(first) + "-";
    expect(from, begins ? Kind::part : Kind::unsatisfiable, begins ? bytes.substr(first) : "");
    for (std::size_t last = first; last <= 12; ++last)
      expect(from + std::to_string(last), begins ? Kind::part : Kind::unsatisfiable,
             begins ? bytes.substr(first, last - first + 1) : "");
    const std::size_t count = std::min(first, bytes.size());
    expect("bytes=-" + std::to_string(first), count > 0 ? Kind::part : Kind::unsatisfiable,
           bytes.substr(bytes.size() - count));
  }
  for (const char* whole :
       {"", "bytes", "bytes=", "bytes=-", "bytes=4-2", "bytes=a-b", "bytes=1-2,4-5", "bytes=1", "lines=1-2",
        "bytes=-1-2", "bytes=1-99999999999999999999", "bytes= 1-2"})
    expect(whole, Kind::whole, "");
  EXPECT_EQ(parse_range("bytes=0-", 0).kind, Kind::unsatisfiable);

  const std::string target = "/exports/take%201/video/cam%201.mp4";
  const auto ask_part = [&](const std::string& headers, const char* method = "GET") {
    return ask(port, method, target, "", test::kLetIn + headers);
  };
  const HttpAnswer whole = ask_part("");
  EXPECT_THAT(whole.head, HasSubstr("Accept-Ranges: bytes"));
  const std::size_t at = whole.head.find("ETag: ") + 6;
  const std::string tag = whole.head.substr(at, whole.head.find('\r', at) - at);
  for (const char* condition : {"", "same"}) {
    const HttpAnswer part =
        ask_part("Range: bytes=1-2\r\n" + (*condition ? "If-Range: " + tag + "\r\n" : ""));
    EXPECT_EQ(part.status, 206);
    EXPECT_EQ(part.body, "il");
    EXPECT_THAT(part.head, HasSubstr("Content-Range: bytes 1-2/4"));
    EXPECT_THAT(part.head, HasSubstr("Content-Length: 2"));
  }
  EXPECT_EQ(ask_part("Range: bytes=1-2\r\nIf-Range: \"another\"\r\n").body, "film");
  EXPECT_EQ(ask_part("Range: bytes=1-2\r\n", "HEAD").status, 200);
  const HttpAnswer behind = ask_part("Range: bytes=4-\r\n");
  EXPECT_EQ(behind.status, 416);
  EXPECT_THAT(behind.head, HasSubstr("Content-Range: bytes */4"));
}

TEST_F(ServerExportsTest, NamesAreInAnyScript) {
  const fs::path there = folder / "exports/пламя/video";
  fs::create_directories(there);
  test::put_bytes(there / "камера.mp4", "film");
  const HttpAnswer answer = ask(port, "GET",
                                "/exports/%D0%BF%D0%BB%D0%B0%D0%BC%D1%8F/video/"
                                "%D0%BA%D0%B0%D0%BC%D0%B5%D1%80%D0%B0.mp4");
  EXPECT_EQ(answer.body, "film");
  EXPECT_THAT(answer.head, HasSubstr("filename*=UTF-8''%D0%BA%D0%B0%D0%BC%D0%B5%D1%80%D0%B0.mp4"));
  EXPECT_EQ(attachment("a\"\r\n.mp4"), "attachment; filename=\"a___.mp4\"; filename*=UTF-8''a%22%0D%0A.mp4");
}

TEST_F(ServerExportsTest, OnlyFilesOfAnExportAreSent) {
  for (const char* path : {"/exports/",
                           "/exports/take%201",
                           "/exports/take%201/video/",
                           "/exports/take%201/video/none.mp4",
                           "/exports/none/video/cam%201.mp4",
                           "/exports/take%201/video/folder.mp4",
                           "/exports/take%201/video/link.mp4",
                           "/exports/linked/video/cam.mp4",
                           "/exports/take%201/video/.hidden",
                           "/exports/take%201/video/..",
                           "/exports/take%201/video/../above.mp4",
                           "/exports/take%201/video/%2e%2e/above.mp4",
                           "/exports/take%201/video/..%2fabove.mp4",
                           "/exports/take%201/video/%252e%252e%252fabove.mp4",
                           "/exports/../video/cam.mp4",
                           "/exports/%2e%2e/video/cam.mp4",
                           "/exports/%2e%2e%2felsewhere/video/cam.mp4",
                           "/exports/take%201/video//etc/passwd",
                           "/exports/take%201/video/%2fetc%2fpasswd",
                           "/exports/%2fetc/video/passwd",
                           "/exports/take%201/video/cam%201.mp4%00.txt",
                           "/exports/take%201/video/cam%25201.mp4",
                           "/exports/take%201/video/cam%201.mp4%2",
                           "/exports/take%201/png/cam%201.mp4",
                           "/exports/take%201/above.mp4"}) {
    const HttpAnswer answer = ask(port, "GET", path);
    EXPECT_EQ(answer.status, 404) << path;
    EXPECT_THAT(answer.body, Not(AnyOf("secret", "film"))) << path;
  }
  EXPECT_EQ(ask(port, "POST", "/exports/take%201/video/cam%201.mp4").status, 405);
}

TEST_F(ServerExportsTest, WithoutTheTokenNothingIsSent) {
  const std::string target = "/exports/take%201/video/cam%201.mp4";
  EXPECT_EQ(ask(port, "GET", target, "", "Host: localhost\r\n").status, 401);
  EXPECT_EQ(ask(port, "HEAD", target, "", "Host: localhost\r\n").status, 401);
  EXPECT_EQ(ask(port, "GET", target, "", test::kLetIn + "Origin: http://evil.example\r\n").status, 403);
}

/// The client reads the first bytes of a file that the disk doesn't even hold, then leaves.
TEST_F(ServerExportsTest, ALargeFileIsSentPieceByPiece) {
  test::put_bytes(videos / "large.mp4", "begin");
  fs::resize_file(videos / "large.mp4", std::uintmax_t{1} << 40);
  {
    const UniqueFd client = test::connect_to(port);
    test::send_all(client, "GET /exports/take%201/video/large.mp4 HTTP/1.1\r\n" + test::kLetIn + "\r\n");
    EXPECT_THAT(read_until(client, "\r\n\r\nbegin"), HasSubstr("Content-Length: 1099511627776"));
    EXPECT_EQ(ask(port, "GET", "/exports/take%201/video/cam%201.mp4").body, "film") << "others are served";
  }
  std::string bytes(std::size_t{8} << 20, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 2654435761U >> 13);
  test::put_bytes(videos / "whole.mp4", bytes);
  EXPECT_TRUE(ask(port, "GET", "/exports/take%201/video/whole.mp4").body == bytes);
}

}  // namespace
}  // namespace emberlock::daemon
