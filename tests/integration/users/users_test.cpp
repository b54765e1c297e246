// SPDX-License-Identifier: Apache-2.0
// Who may do what over which way in, asked as each of them: the test is root, and its children take on other
// users' identities, which needn't have names. What is found is the table of daemon/server/README.md.
#include <csignal>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "tests/support/certificate.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/tls_tunnel.h"
#include "tests/support/wait.h"
#include "tests/support/watch_client.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using test::ask;
using testing::HasSubstr;

struct User {
  uid_t user;
  gid_t group;
  std::vector<gid_t> others = {};  ///< supplementary groups
};
constexpr gid_t kRig = 64010;
const User kDaemon{64001, kRig};
const User kMember{64002, 64002, {kRig}};
const User kOther{64003, 64003};

/// On failure the process is somebody else already, and ends.
void become(const User& who) {
  if (::setgroups(who.others.size(), who.others.data()) != 0 ||
      ::setresgid(who.group, who.group, who.group) != 0 || ::setresuid(who.user, who.user, who.user) != 0)
    ::_exit(126);
}

/// What `ask` returns to a child that is `who`. The test has one thread still.
std::string as(const User& who, const std::function<std::string()>& question) {
  int ends[2];
  EXPECT_EQ(::pipe(ends), 0);
  UniqueFd from(ends[0]);
  const pid_t child = ::fork();
  if (child == 0) {
    become(who);
    std::string answer;
    try {
      answer = question();
    } catch (const std::exception& error) {
      answer = error.what();
    }
    for (std::size_t at = 0; at < answer.size();) {
      const ssize_t wrote = ::write(ends[1], answer.data() + at, answer.size() - at);
      if (wrote <= 0) break;
      at += static_cast<std::size_t>(wrote);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string answer;
  char bytes[4096];
  for (ssize_t got = 0; (got = ::read(from.get(), bytes, sizeof bytes)) > 0;)
    answer.append(bytes, static_cast<std::size_t>(got));
  ::waitpid(child, nullptr, 0);
  return answer;
}

/// The programs under test where any user may start them: the build's own folder may be closed to others.
class Programs {
  test::TempFolder folder_{
      test::TempFolder::On::disk};  // memory may be mounted so that nothing starts from it

 public:
  const std::string daemon = opened(EMBERLOCKD_PROGRAM), client = opened(EMBERLOCK_PROGRAM);

  static const Programs& open_to_all() {
    static const Programs programs;
    return programs;
  }

 private:
  [[nodiscard]] std::string opened(const fs::path& program) const {
    ::chmod(folder_.path().c_str(), 0755);
    const fs::path to = folder_ / program.filename();
    std::error_code on_another_disk;
    fs::create_hard_link(program, to, on_another_disk);
    if (on_another_disk) fs::copy_file(program, to);
    return to.string();
  }
};

/// emberlockd as its own user, in a folder that everybody may enter; its runtime folder is its group's.
class RunningDaemon {
 public:
  /// `server`: more lines of [server].
  explicit RunningDaemon(const std::string& server) {
    ::chmod(folder_.path().c_str(), 0755);
    for (const char* name : {"run", "sessions"}) {
      fs::create_directory(folder_ / name);
      EXPECT_EQ(::chown((folder_ / name).c_str(), kDaemon.user, kDaemon.group), 0);
      ::chmod((folder_ / name).c_str(), 0750);
    }
    fs::create_directory(folder_ / "console");
    std::ofstream(folder_ / "console/index.html") << "<!doctype html>console";
    std::ofstream(folder_ / "d.toml")
        << "[rig]\nname = \"users\"\n[[rig.camera]]\ndriver = \"virtual\"\ncount = 2\nsize = \"320x240\"\n"
        << "[rig.strobe]\ndriver = \"virtual\"\n[recording]\nfolder = \"" << (folder_ / "sessions").string()
        << "\"\nfree_space_floor_mib = 0\n[log]\nlevel = \"info\"\n[server]\nsocket = \"" << socket().string()
        << "\"\nconsole = \"" << (folder_ / "console").string() << "\"\n"
        << server;
  }
  RunningDaemon(const RunningDaemon&) = delete;
  RunningDaemon& operator=(const RunningDaemon&) = delete;
  ~RunningDaemon() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
  }
  void start() {
    pid_ = ::fork();
    if (pid_ == 0) {
      if (std::freopen((folder_ / "log").c_str(), "w", stderr) == nullptr) ::_exit(125);
      become(kDaemon);
      ::execl(Programs::open_to_all().daemon.c_str(), "emberlockd", "--config", (folder_ / "d.toml").c_str(),
              nullptr);
      ::_exit(127);
    }
    // It says where its console is once it has a port.
    constexpr std::string_view kSays = "the console is at ";
    ASSERT_TRUE(test::wait_until([&] { return log().find(kSays) != std::string::npos; })) << log();
    const std::string text = log();
    const std::size_t line = text.find(kSays) + kSays.size();
    const std::size_t colon = text.find(':', text.find("://", line) + 3);
    http_port = std::stoi(text.substr(colon + 1));
  }
  [[nodiscard]] std::string config() const { return (folder_ / "d.toml").string(); }
  [[nodiscard]] fs::path socket() const { return folder_ / "run/d.sock"; }
  [[nodiscard]] std::string log() const {
    auto text = read_file(folder_ / "log");
    return text ? std::move(*text) : std::string();
  }
  /// A file that the daemon alone may read.
  std::string secret(const std::string& name, const std::string& text) {
    test::write_secret(folder_ / name, text);
    EXPECT_EQ(::chown((folder_ / name).c_str(), kDaemon.user, kDaemon.group), 0);
    return (folder_ / name).string();
  }
  int http_port = 0;

 private:
  test::TempFolder folder_;
  pid_t pid_ = -1;
};

const std::string kHere = "Host: localhost\r\n";
const std::string kShown = kHere + "Authorization: Bearer " + test::kHttpToken + "\r\n";

std::string word(bool allowed) { return allowed ? "yes" : "no"; }
std::string emberlock(const std::string& words) { return Programs::open_to_all().client + " " + words; }

/// By the daemon's socket: whether it says what the rig does, and gives a link.
std::vector<std::string> by_socket(const RunningDaemon& daemon) {
  const std::string where = " --daemon unix:" + daemon.socket().string();
  return {word(shell(emberlock("status --json") + where).output.find("\"phase\"") != std::string::npos),
          word(shell(emberlock("console") + where).output.find("/open?link=") != std::string::npos)};
}
std::vector<std::string> by_http(int port, const std::string& headers) {
  return {word(ask(port, "POST", "/api/v1/Daemon/GetStatus", "", headers).status == 200),
          word(test::WatchClient(port, headers).open()),
          word(ask(port, "GET", "/metrics", "", headers).status == 200),
          word(ask(port, "GET", "/", "", headers).body == "<!doctype html>console")};
}
std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
const std::vector<std::string> kNoSuchWay{"-"}, kNotHere{"-", "-"};

/// A line of the table; children tell cells as a line of their own.
std::string row(const std::string& who, const std::vector<std::string>& cells) {
  std::string line = "| " + who + " |";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line;
}

/// The headers of a browser that follows this link; empty: it isn't let in.
std::string follow(int port, const std::string& url) {
  const std::string cookie = test::cookie_of(ask(port, "GET", url.substr(url.find("/open")), "", kHere));
  return cookie.empty() ? kHere : kHere + "Cookie: " + cookie + "\r\n";
}
std::string a_link(const RunningDaemon& daemon) {
  const std::string out = shell(emberlock("console --json --daemon unix:") + daemon.socket().string()).output;
  const std::size_t at = out.find("http");
  return at == std::string::npos ? "/open?link=none" : out.substr(at, out.find('"', at) - at);
}

void expect_in_the_table(const std::vector<std::string>& rows) {
  const std::string readme = read_file(fs::path(EMBERLOCK_SOURCE_DIR) / "daemon/server/README.md").value();
  for (const std::string& line : rows)
    EXPECT_THAT(readme, HasSubstr(line + "\n")) << "daemon/server/README.md";
}

class Users : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(::geteuid(), 0U) << "takes on other users' identities: run it as root";
    const std::string client = Programs::open_to_all().client;
    const std::string may = as(kOther, [&] { return word(::access(client.c_str(), X_OK) == 0); });
    ASSERT_EQ(may, "yes") << "other users must be able to start " << client;
  }
};

// As it is installed: the socket, and the console on this machine alone; no token.
TEST_F(Users, OnThisMachineTheSocketsFolderSaysWhoGetsInAndALinkHandsItOn) {
  RunningDaemon daemon("http_listen = \"127.0.0.1:0\"\n");
  daemon.start();
  const int port = daemon.http_port;
  const auto bare = [&](const User& who, const std::string& name) {
    return as(who, [&] { return row(name, by_socket(daemon) + kNoSuchWay + by_http(port, kHere)); });
  };
  std::vector<std::string> rows{bare(kDaemon, "the daemon's own user"),
                                bare(kMember, "a member of its group"),
                                bare(kOther, "any other user of this machine")};
  const std::string link = as(kMember, [&] { return a_link(daemon); });
  const std::string browser = as(kMember, [&] { return follow(port, link); });
  rows.push_back(as(kMember, [&] {
    return row("a browser that followed a link, whosever", kNotHere + kNoSuchWay + by_http(port, browser));
  }));
  rows.push_back(as(kOther, [&] {
    return row("a browser that follows it a second time",
               kNotHere + kNoSuchWay + by_http(port, follow(port, link)));
  }));
  expect_in_the_table(rows);
  EXPECT_THAT(daemon.log(), HasSubstr("turned away by http: user 64003 follows a link"))
      << "as the kernel says";
}

// A token file changes nothing of the socket; programs on this machine show the token.
TEST_F(Users, OnThisMachineATokenIsAskedForToo) {
  RunningDaemon daemon("http_listen = \"127.0.0.1:0\"\ntoken_file = \"token\"\n");
  daemon.secret("token", test::kHttpToken);
  daemon.start();
  const auto by = [&](const std::string& name, const std::string& headers) {
    return as(kOther,
              [&] { return row(name, by_socket(daemon) + kNoSuchWay + by_http(daemon.http_port, headers)); });
  };
  expect_in_the_table({by("any other user of this machine, where there is a token, without it", kHere),
                       by("any other user of this machine, with the token", kShown)});
}

/// A daemon that listens to the network, and who comes from there.
class Network {
 public:
  explicit Network(const std::string& more)
      : daemon(fmt::format("listen = \"127.0.0.1:{}\"\nhttp_listen = \"0.0.0.0:0\"\ntoken_file = \"token\"\n"
                           "tls_certificate = \"server.crt\"\ntls_key = \"server.key\"\n{}",
                           grpc_port_.number(), more)) {
    const rig::TlsIdentity server = servers_.issue("localhost");
    daemon.secret("server.crt", server.certificate);
    daemon.secret("server.key", server.key);
    daemon.secret("clients.crt", clients_.pem());
    daemon.secret("token", test::kHttpToken);
    test::write_secret(mine_ / "ca.crt", servers_.pem());
    test::write_secret(mine_ / "right", test::kHttpToken);
    test::write_secret(mine_ / "wrong", "this is another token");
    const rig::TlsIdentity own = clients_.issue("operator");
    test::write_secret(mine_ / "own.crt", own.certificate);
    test::write_secret(mine_ / "own.key", own.key);
    own_ = own;
  }
  enum class Token { right, wrong };
  enum class Certificate { none, shown };
  [[nodiscard]] std::string row_of(const std::string& who, Token token, Certificate certificate) const {
    const bool shows = certificate == Certificate::shown;
    const std::string certificates =
        fmt::format(" --tls-certificate {0}.crt --tls-key {0}.key", (mine_ / "own").string());
    const std::string options = fmt::format(" --daemon localhost:{} --tls-ca {} --token-file {}",
                                            grpc_port_.number(), (mine_ / "ca.crt").string(),
                                            (mine_ / (token == Token::right ? "right" : "wrong")).string()) +
                                (shows ? certificates : std::string());
    const std::vector<std::string> by_grpc{
        word(shell(emberlock("status --json") + options).output.find("\"phase\"") != std::string::npos)};
    EXPECT_EQ(shell(emberlock("console") + options).output.find("/open?link="), std::string::npos);
    const test::TlsTunnel tunnel(daemon.http_port, servers_.pem(), shows ? own_ : rig::TlsIdentity{});
    return row(who, kNotHere + by_grpc + by_http(tunnel.port(), token == Token::right ? kShown : kHere));
  }

 private:
  test::ReservedPort grpc_port_;
  test::CertificateAuthority servers_{"who signs servers"}, clients_{"who signs clients"};
  test::TempFolder mine_;
  rig::TlsIdentity own_;

 public:
  RunningDaemon daemon;
};

TEST_F(Users, FromElsewhereTheTokenLetsIn) {
  Network network("");
  network.daemon.start();
  expect_in_the_table(
      {network.row_of("from elsewhere, without the token", Network::Token::wrong, Network::Certificate::none),
       network.row_of("from elsewhere, with the token", Network::Token::right, Network::Certificate::none)});
}

TEST_F(Users, FromElsewhereACertificateIsAskedForBesideTheTokenAndNotInsteadOfIt) {
  Network network("tls_clients = \"clients.crt\"\n");
  network.daemon.start();
  expect_in_the_table({network.row_of("from elsewhere, certificates asked for: the token alone",
                                      Network::Token::right, Network::Certificate::none),
                       network.row_of("from elsewhere, certificates asked for: a certificate alone",
                                      Network::Token::wrong, Network::Certificate::shown),
                       network.row_of("from elsewhere, certificates asked for: both", Network::Token::right,
                                      Network::Certificate::shown)});
}

TEST_F(Users, AKeyThatEverybodyReadsIsRefusedAtTheStart) {
  Network network("");
  const std::string key = network.daemon.secret("server.key", "any");
  ASSERT_EQ(::chmod(key.c_str(), 0644), 0);
  const Shell run = shell(std::string(EMBERLOCKD_PROGRAM) + " --config " + network.daemon.config());
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.output,
              testing::AllOf(HasSubstr("everybody may read or write the key"), HasSubstr("chmod o=")));
}

// What README.md says to do first: nothing is edited (but for the console's port, so that tests run side by
// side).
TEST_F(Users, AnOrdinaryUserStartsADaemonOfTheirOwnWithThePrintedConfiguration) {
  const test::TempFolder folder;
  const fs::path home = folder / "home";
  const fs::path runtime = folder / "run";
  ::chmod(folder.path().c_str(), 0755);
  for (const fs::path& own : {home, runtime}) {
    fs::create_directory(own);
    ASSERT_EQ(::chown(own.c_str(), kOther.user, kOther.group), 0);
    ::chmod(own.c_str(), 0700);
  }
  const std::string script = fmt::format(R"(
unset RUNTIME_DIRECTORY STATE_DIRECTORY XDG_DATA_HOME EMBERLOCK_DAEMON
export HOME={} XDG_RUNTIME_DIR={}
cd $HOME
{} --print-config | sed 's/^#\(http_listen = "127.0.0.1:\)7140/\10/' > rig.toml
{} --config rig.toml 2> log & daemon=$!
for i in $(seq 1200); do {} status --json > status 2> error && grep -q phase status && break; sleep 0.1; done
{} console >> status 2>> error
kill $daemon; wait $daemon; echo "ended $?" >> status
cat status error log; find . $XDG_RUNTIME_DIR -printf '%M %p\n'
)",
                                         home.string(), runtime.string(), Programs::open_to_all().daemon,
                                         Programs::open_to_all().daemon, Programs::open_to_all().client,
                                         Programs::open_to_all().client);
  const std::string said = as(kOther, [&] { return shell(script).output; });
  EXPECT_THAT(said, HasSubstr("\"phase\""));
  EXPECT_THAT(said, HasSubstr("/open?link="));
  EXPECT_THAT(said, HasSubstr("ended 0"));
  EXPECT_THAT(said, HasSubstr("drwx------ " + (runtime / "emberlock").string() + "\n"));
  EXPECT_THAT(said, HasSubstr("./.local/share/emberlock/sessions\n"));
  EXPECT_THAT(said, testing::Not(HasSubstr("[error]")));
}

// Another user opens as many connections as there are places, again and again, each stopping in its head. An
// operator who is in the middle of his own first request gets his answer: the kernel tells them apart.
TEST_F(Users, AnotherUsersHalfOpenRequestsShutNobodyOut) {
  RunningDaemon daemon("http_listen = \"127.0.0.1:0\"\n");
  daemon.start();
  const int port = daemon.http_port;
  const std::string browser = as(kMember, [&] { return follow(port, a_link(daemon)); });
  int begun[2], over[2];
  ASSERT_EQ(::pipe(begun), 0);
  ASSERT_EQ(::pipe(over), 0);
  const pid_t attacker = ::fork();
  if (attacker == 0) {
    become(kOther);
    char go = 0;
    if (::read(begun[0], &go, 1) != 1) ::_exit(1);
    std::vector<UniqueFd> half;
    for (int i = 0; i < 700; ++i) {
      half.push_back(test::connect_to(port));
      test::send_all(half.back(), "GET / HTTP/1.1\r\nHost: 127");
      if (half.size() > 400) half.erase(half.begin());
    }
    // Once the server has closed the oldest that is held, it has taken all places.
    (void)test::read_to_end(half.front());
    if (::write(over[1], "x", 1) != 1) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  const std::string answer = as(kMember, [&] {
    const UniqueFd own = test::connect_to(port);
    test::send_all(own, "GET /metrics HTTP/1.1\r\nConnection: close\r\n");
    // Its place is taken before the attack begins: a later request is answered.
    (void)ask(port, "GET", "/healthz", "", kHere);
    if (::write(begun[1], "x", 1) != 1) return std::string("no attack");
    char done = 0;
    if (::read(over[0], &done, 1) != 1) return std::string("the attack failed");
    test::send_all(own, browser + "\r\n");
    const std::string metrics = test::read_to_end(own);
    const bool another =
        ask(port, "GET", "/metrics", "", browser).status == 200 && test::WatchClient(port, browser).open();
    return metrics.substr(0, 12) + (another ? ", and another" : "");
  });
  EXPECT_EQ(answer, "HTTP/1.1 200, and another");
  ::kill(attacker, SIGKILL);
  ::waitpid(attacker, nullptr, 0);
}

}  // namespace
}  // namespace emberlock
