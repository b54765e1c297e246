// SPDX-License-Identifier: Apache-2.0
// A soak: emberlockd with eleven simulated cameras in real time, and all that use it at once, for as long as
// asked. An operator goes round: strobe, alignment, a recording of 5 s, its verification, a reconstruction,
// requests that must be refused. Beside him three `emberlock watch` and three consoles come and go, one of
// them without reading. `scripts/soak` runs it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/http_client.h"
#include "tests/support/shell.h"
#include "tests/support/watch_client.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;
using std::chrono::seconds;
using namespace std::chrono_literals;

constexpr int kCameras = 11;
constexpr double kRecorded = 5;           ///< seconds
constexpr auto kPatience = 600s;          ///< with the slowest step, under ThreadSanitizer on a busy machine
constexpr int kFindingsAtMost = 20;       ///< then it ends
constexpr std::size_t kSessionsKept = 3;  ///< the disk stays bounded

struct Plan {
  seconds duration{};
  fs::path folder;  ///< of the run; sanitizers' reports lie there too, "report.PID"
  double rate_hz = 0;
  bool bounded_memory = false;  ///< growth fails the soak
};

/// What was seen; any thread.
class Findings {
 public:
  void add(const std::string& what) {
    const std::lock_guard lock(mutex_);
    fmt::print("FOUND: {}\n", what);
    std::fflush(stdout);
    ++number_;
  }
  [[nodiscard]] int number() const {
    const std::lock_guard lock(mutex_);
    return number_;
  }

 private:
  mutable std::mutex mutex_;
  int number_ = 0;
};

/// The programs of this build lie beside this one.
std::string program(const char* name) {
  return (fs::read_symlink("/proc/self/exe").parent_path() / name).string();
}

/// emberlockd, as it is started.
class Daemon {
 public:
  Daemon(const Plan& plan, int port) : port_(port), socket_(plan.folder / "run" / "d.sock") {
    const std::string config = plan.folder / "emberlockd.toml";
    const fs::path token = plan.folder / "token";
    std::ofstream(token) << test::kHttpToken;
    fs::permissions(token, fs::perms::owner_read | fs::perms::owner_write);
    std::ofstream(config) << fmt::format(
        "[rig]\nname = \"soak\"\n[rig.virtual]\nscene = \"flame\"\nseed = 1\n"
        "[[rig.camera]]\ndriver = \"virtual\"\ncount = {}\nsize = \"320x240\"\nrate_hz = {}\n"
        "[rig.strobe]\ndriver = \"virtual\"\n[alignment]\ntolerance = \"60rows\"\nframe_deadline_s = 30\n"
        "[recording]\nfolder = \"{}\"\nencoding = \"raw\"\ntranscode = \"when-idle\"\n"
        "[reconstruction]\nprogram = \"{}\"\ndevice = \"cpu\"\nvoxels = 16\nbudget_s = 2\n"
        "[server]\nsocket = \"{}\"\nhttp_listen = \"127.0.0.1:{}\"\ntoken_file = \"{}\"\n",
        kCameras, plan.rate_hz, (plan.folder / "sessions").string(), program("emberlock"), socket_.string(),
        port_, token.string());
    std::string name = program("emberlockd");
    std::string option = "--config";
    std::string value = config;
    char* words[] = {name.data(), option.data(), value.data(), nullptr};
    if (::posix_spawn(&pid_, name.c_str(), nullptr, nullptr, words, environ) != 0) pid_ = -1;
  }
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string client(const std::string& words) const {
    return program("emberlock") + " " + words + " --daemon unix:" + socket_.string();
  }
  /// Asked again and again: it ended by itself when this is false.
  [[nodiscard]] bool lives() {
    if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
    return pid_ > 0;
  }
  [[nodiscard]] double resident_mb() const {
    std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
    double size = 0;
    double resident = 0;
    statm >> size >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
  }
  [[nodiscard]] double cpu_s() const {
    std::ifstream file("/proc/" + std::to_string(pid_) + "/stat");
    std::string word;
    double ticks = 0;
    for (int field = 1; field <= 15 && file >> word; ++field)
      if (field >= 14) ticks += std::stod(word);
    return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  /// Its exit status, or in words how it ended.
  std::string end() {
    if (lives()) ::kill(pid_, SIGTERM);
    const auto until = Clock::now() + kPatience;
    while (lives() && Clock::now() < until) std::this_thread::sleep_for(50ms);
    if (lives()) {
      ::kill(pid_, SIGKILL);
      return "not by SIGTERM";
    }
    return WIFEXITED(status_) ? std::to_string(WEXITSTATUS(status_))
                              : fmt::format("by signal {}", WTERMSIG(status_));
  }

 private:
  int port_;
  fs::path socket_;
  pid_t pid_ = -1;
  int status_ = 0;
};

/// Everything that a soak's threads share.
struct Soak {
  const Plan plan;
  const test::ReservedPort port;
  Daemon daemon;
  Findings findings;
  std::atomic<bool> over = false;
  std::atomic<int> watchers = 0;
  std::atomic<int> viewers = 0;
  std::atomic<std::uint64_t> pictures = 0;
  std::vector<double> resident_mb = {};  ///< one a second

  explicit Soak(Plan given) : plan(std::move(given)), daemon(plan, port.number()) {}
  void pause(std::chrono::milliseconds time) {
    for (const auto until = Clock::now() + time; !over && Clock::now() < until;)
      std::this_thread::sleep_for(20ms);
  }
  /// Where the daemon doesn't answer any more, the soak ends.
  void guard(const std::function<void()>& body) {
    try {
      body();
    } catch (const std::exception& e) {
      if (!over.exchange(true)) findings.add(e.what());
    }
  }
};

/// Comes and goes on gRPC; every third time it is killed in mid-stream.
void watch_by_grpc(Soak& soak, unsigned seed) {
  std::mt19937 random(seed);
  for (int round = 0; !soak.over; ++round) {
    const double stay = 1 + static_cast<double>(random() % 100) / 10;
    const bool killed = round % 3 == 2;
    const Shell watch =
        shell(fmt::format("exec timeout -s KILL {} {} >/dev/null", killed ? stay : 300.0,
                          soak.daemon.client(fmt::format("watch --json --seconds {}", stay))));
    ++soak.watchers;
    if (!killed && !soak.over && watch.status != 0)
      soak.findings.add(fmt::format("emberlock watch ended with {}: {}", watch.status, watch.output));
  }
}

enum class Reads { everything, nothing };

/// Comes and goes as a console does, wanting pictures.
void watch_by_websocket(Soak& soak, unsigned seed, Reads reads) {
  std::mt19937 random(seed);
  while (!soak.over) {
    test::WatchClient viewer(soak.daemon.port());
    if (!viewer.open()) {
      soak.findings.add("no WebSocket: " + viewer.answer());
      return;
    }
    ++soak.viewers;
    viewer.say(R"({"watch": {"rate_hz": 12}})");
    const auto until = Clock::now() + std::chrono::milliseconds(500 + random() % 10000);
    while (!soak.over && Clock::now() < until) {
      pollfd ready{viewer.descriptor(), POLLIN, 0};
      if (reads == Reads::nothing || ::poll(&ready, 1, 100) <= 0) {
        std::this_thread::sleep_for(50ms);
        continue;
      }
      while (const auto message = viewer.hear_now()) soak.pictures += message->opcode == 2 ? 1 : 0;
    }
  }
}

void watch_memory(Soak& soak) {
  while (!soak.over) {
    soak.resident_mb.push_back(soak.daemon.resident_mb());
    soak.pause(1s);
  }
}

/// Who goes round, by the JSON API. A step that can't be made is a finding, and ends the round.
class Operator {
 public:
  explicit Operator(Soak& soak) : soak_(soak) {}

  void go_round() {
    ++rounds_;
    if (set_strobe() && align() && record() && verify()) {
      reconstruct();
      be_refused();
      ask("status --json");
      ask("sessions list --json");
      await_reconstruction();
    }
    call("Sync/Stop");  // it isn't locked, perhaps
    tidy();
  }
  void report() const {
    fmt::print(
        "{} rounds, {} recordings of {:g} s: {} frames written, {} lost and accounted for; "
        "{} reconstructions, {} requests refused as they must be\n",
        rounds_, recordings_, kRecorded, frames_, lost_, reconstructions_, refusals_);
  }

 private:
  test::HttpAnswer call(const std::string& method, const Json& request = Json::object()) {
    return test::ask(soak_.daemon.port(), "POST", "/api/v1/" + method, request.dump());
  }
  bool good(const std::string& method, const Json& request = Json::object()) {
    const test::HttpAnswer answer = call(method, request);
    if (answer.status == 200) return true;
    soak_.findings.add(fmt::format("{} {}: {} {}", method, request.dump(), answer.status, answer.body));
    return false;
  }
  Json status() {
    const test::HttpAnswer answer = call("Daemon/GetStatus");
    return answer.status == 200 ? Json::parse(answer.body) : Json::object();
  }
  /// Waits while one of these holds; the status after that.
  Json after(const std::set<std::string>& phases) {
    const auto until = Clock::now() + kPatience;
    for (;;) {
      Json now = status();
      if (phases.count(now.value("phase", "")) == 0) return now;
      if (Clock::now() > until) {
        soak_.findings.add(fmt::format("still {} after {} s: {}", now.value("phase", ""), kPatience.count(),
                                       now.value("reason", "")));
        return now;
      }
      std::this_thread::sleep_for(200ms);
    }
  }
  /// Asks by gRPC. Exit code 1 tells of a fault that the daemon shows, which isn't one of the soak's.
  void ask(const std::string& words) {
    const Shell verb = shell(soak_.daemon.client(words));
    if (verb.status != 0 && verb.status != 1)
      soak_.findings.add(fmt::format("{}: {} {}", words, verb.status, verb.output));
  }

  bool set_strobe() {
    for (const double rate_hz : {5.0, 12.5, 23.976}) {
      const Json wanted{{"output", "FLASHING"}, {"rate_hz", rate_hz}, {"width_s", 50e-6}};
      if (!good("Strobe/Apply", wanted) || !good("Strobe/Get")) return false;
    }
    return true;
  }
  bool align() {
    if (!good("Sync/Align", {{"tolerance", "60rows"}})) return false;
    const Json now = after({"CALIBRATING", "ALIGNING"});
    if (now.value("phase", "") == "LOCKED") return true;
    // Chance decides what an alignment sees; that one may be given up isn't what is soaked here.
    ++unaligned_;
    fmt::print("not locked: {}\n", now.value("reason", ""));
    return true;
  }
  bool record() {
    take_ = fmt::format("take {}", rounds_);
    const Json wanted{{"name", take_}, {"seconds", kRecorded}, {"unlocked", true}};
    // While the lock is renewed the daemon asks for a second or two of patience.
    const auto until = Clock::now() + kPatience;
    test::HttpAnswer answer = call("Capture/Record", wanted);
    while (answer.status == 409 && answer.body.find("ask again") != std::string::npos &&
           Clock::now() < until) {
      soak_.pause(500ms);
      answer = call("Capture/Record", wanted);
    }
    if (answer.status != 200) {
      soak_.findings.add(fmt::format("{} isn't begun: {} {}", take_, answer.status, answer.body));
      return false;
    }
    const Json recording = after({"CAPTURING", "FINISHING"})["recording"];
    ++recordings_;
    frames_ += std::stoull(recording.value("frames", "0"));
    for (const char* cause : {"camera_gap", "transport", "underrun", "queue", "disk"})
      lost_ += std::stoull(recording.value("lost", Json::object()).value(cause, "0"));
    if (recording.value("state", "") == "COMPLETE") return true;
    soak_.findings.add(fmt::format("{} isn't whole: {}", take_, recording.dump()));
    return false;
  }
  bool verify() {
    const test::HttpAnswer answer = call("Sessions/Verify", {{"session", take_}});
    if (answer.status == 200 && answer.body.find("\"outcome\":{\"ok\":true") != std::string::npos)
      return true;
    soak_.findings.add(fmt::format("{} isn't verified: {} {}", take_, answer.status, answer.body));
    return false;
  }
  void reconstruct() {
    if (!good("Reconstruct/Start", {{"session", take_}})) return;
    ++reconstructions_;
    if (rounds_ % 4 == 3) {
      std::this_thread::sleep_for(300ms);
      call("Reconstruct/Cancel");  // it may be done already
    }
  }
  void await_reconstruction() {
    const auto until = Clock::now() + kPatience;
    while (Clock::now() < until) {
      const Json now = status().value("reconstruction", Json::object());
      const std::string state = now.value("state", "");
      if (state == "FAILED") soak_.findings.add("reconstruction: " + now.value("error", ""));
      if (state != "RUNNING") return;
      std::this_thread::sleep_for(200ms);
    }
    soak_.findings.add("the reconstruction runs on");
    call("Reconstruct/Cancel");
  }
  void be_refused() {
    const auto refused = [this](const test::HttpAnswer& answer, const char* what) {
      ++refusals_;
      if (answer.status < 400 || answer.status >= 500)
        soak_.findings.add(fmt::format("{} was answered with {}: {}", what, answer.status, answer.body));
    };
    const int port = soak_.daemon.port();
    const auto post = [&](const std::string& target, const std::string& body) {
      return test::ask(port, "POST", target, body);
    };
    refused(post("/api/v1/Daemon/Nothing", "{}"), "a method that isn't there");
    refused(post("/api/v1/Capture/Record", "{\"name\": "), "JSON cut short");
    refused(post("/api/v1/Capture/Record", R"({"name": "../../outside"})"), "a path as a name");
    refused(post("/api/v1/Capture/Record", R"({"nam": "x"})"), "a field that isn't there");
    refused(post("/api/v1/Capture/Record", fmt::format(R"({{"name": "{}"}})", take_)),
            "a name that is taken");
    refused(post("/api/v1/Sessions/Get", R"({"session": "nobody's"})"), "a session that isn't there");
    refused(post("/api/v1/Strobe/Apply", R"({"rate_hz": -1})"), "a negative rate");
    refused(post("/api/v1/Daemon/GetStatus", std::string(8 << 20, ' ')), "a request of 8 MB");
    refused(test::ask(port, "GET", "/../../etc/passwd"), "a path out of the console's folder");
    refused(test::ask(port, "GET", "/api/v1/watch", {}, "Host: elsewhere\r\n"), "another host's name");
    test::send_all(test::connect_to(port), "POST /api/v1/Daemon/GetStatus HTTP/1.1\r\nContent-Le");
    test::send_all(test::connect_to(port), "\x16\x03\x01\x02\xff\xff");
  }
  /// Old sessions go, unless they wait to be compressed, and what was made of them.
  void tidy() {
    const fs::path sessions = soak_.plan.folder / "sessions";
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(sessions)) all.push_back(entry.path());
    std::sort(all.begin(), all.end(), [](const fs::path& a, const fs::path& b) {
      return fs::last_write_time(a) > fs::last_write_time(b);
    });
    for (std::size_t i = kSessionsKept; i < all.size(); ++i) {
      if (shell(fmt::format("find '{}' -name '*.nut' | grep .", all[i].string())).status == 0) continue;
      fs::remove_all(all[i]);
      fs::remove_all(soak_.plan.folder / "results" / all[i].filename());
    }
    good("Daemon/Acknowledge");
  }

  Soak& soak_;
  std::string take_;
  int rounds_ = 0;
  int recordings_ = 0;
  int reconstructions_ = 0;
  int refusals_ = 0;
  int unaligned_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t lost_ = 0;
};

void judge_memory(Soak& soak) {
  const std::vector<double>& mb = soak.resident_mb;
  if (mb.size() < 6) return;
  const auto third = static_cast<std::ptrdiff_t>(mb.size() / 3);
  const double first = *std::max_element(mb.begin(), mb.begin() + third);
  const double last = *std::max_element(mb.end() - third, mb.end());
  fmt::print("resident memory: {:.0f} MB at most in the first third, {:.0f} MB in the last\n", first, last);
  if (soak.plan.bounded_memory && last > 1.1 * first) soak.findings.add("it grows");
}

void judge_reports(Soak& soak) {
  for (const auto& entry : fs::directory_iterator(soak.plan.folder)) {
    if (!entry.path().filename().string().starts_with("report.")) continue;
    const Shell head = shell(fmt::format("head -n 60 '{}'", entry.path().string()));
    soak.findings.add(fmt::format("a sanitizer's report, {}:\n{}", entry.path().string(), head.output));
  }
}

int run(Plan plan) {
  Soak soak(std::move(plan));
  const auto began = Clock::now();
  while (soak.daemon.lives() && shell(soak.daemon.client("sessions list")).status != 0)
    std::this_thread::sleep_for(100ms);
  fmt::print("ready after {:.1f} s\n", std::chrono::duration<double>(Clock::now() - began).count());
  std::fflush(stdout);

  std::vector<std::thread> others;
  const auto beside = [&](std::function<void()> body) {
    others.emplace_back([&soak, body = std::move(body)] { soak.guard(body); });
  };
  beside([&] { watch_memory(soak); });
  for (unsigned i = 0; i < 3; ++i) {
    beside([&, i] { watch_by_grpc(soak, i); });
    beside([&, i] { watch_by_websocket(soak, 10 + i, i == 0 ? Reads::nothing : Reads::everything); });
  }
  Operator someone(soak);
  while (!soak.over && Clock::now() - began < soak.plan.duration &&
         soak.findings.number() < kFindingsAtMost) {
    soak.guard([&] { someone.go_round(); });
    someone.report();
    fmt::print("{:.0f} MB resident\n", soak.daemon.resident_mb());
    std::fflush(stdout);
  }
  const double cpu_s = soak.daemon.cpu_s();
  const double ran = std::chrono::duration<double>(Clock::now() - began).count();
  soak.over = true;
  for (std::thread& other : others) other.join();
  if (const std::string ended = soak.daemon.end(); ended != "0")
    soak.findings.add("emberlockd ended " + ended);
  judge_memory(soak);
  judge_reports(soak);
  someone.report();
  fmt::print(
      "{} visits by gRPC, {} by WebSocket, {} pictures; {:.0f} s, of which emberlockd computed {:.0f} s\n",
      soak.watchers.load(), soak.viewers.load(), soak.pictures.load(), ran, cpu_s);
  fmt::print("{}\n",
             soak.findings.number() == 0 ? "clean" : fmt::format("{} findings", soak.findings.number()));
  return soak.findings.number() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace emberlock

/// soak SECONDS FOLDER RATE_HZ [bounded-memory]
int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "soak SECONDS FOLDER RATE_HZ [bounded-memory]; scripts/soak knows what fits\n");
    return 2;
  }
  return emberlock::run({std::chrono::seconds(std::atoi(argv[1])), argv[2], std::atof(argv[3]), argc > 4});
}
