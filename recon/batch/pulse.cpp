// SPDX-License-Identifier: Apache-2.0
#include "recon/batch/pulse.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <sstream>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/unique_fd.h"
#include "recon/batch/whole_number.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;

/// A beat may come late, and be seen late, by several of them.
constexpr double kBeatsInPatience = 6;

/// Of files of the kernel's; empty where it isn't there.
std::string line_of(const fs::path& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  char text[1024];
  const ssize_t read = fd.get() < 0 ? 0 : ::read(fd.get(), text, sizeof text);
  std::string line(text, read > 0 ? static_cast<std::size_t>(read) : 0);
  return line.substr(0, line.find('\n'));
}

std::string this_boot() {
  std::error_code ec;
  return line_of("/proc/sys/kernel/random/boot_id") + " " +
         fs::read_symlink("/proc/self/ns/pid", ec).string();
}

/// 0 where there is no such process, or one that has ended and waits for its parent.
std::uint64_t start_of(std::int64_t pid) {
  const std::string stat = line_of(fmt::format("/proc/{}/stat", pid));
  const std::size_t behind_name = stat.rfind(')');
  if (behind_name == std::string::npos) return 0;
  std::istringstream fields(stat.substr(behind_name + 1));
  std::string state, field;
  fields >> state;
  if (state == "Z" || state == "X") return 0;
  constexpr int kBetween = 18;  // fields 4 to 21
  for (int i = 0; i < kBetween; ++i) fields >> field;
  std::uint64_t ticks = 0;
  fields >> ticks;
  return ticks;
}

struct FileTime {
  bool is_there = true;
  std::optional<std::int64_t> changed;  ///< ns; nothing where the file server doesn't tell
};

/// By an open file, which a file server's clients ask the server for.
FileTime time_of(const fs::path& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) return {errno != ENOENT, std::nullopt};
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) return {};
  return {true, std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

}  // namespace

Worker Worker::here(int rank, std::string device) {
  char host[256] = "?";
  ::gethostname(host, sizeof host - 1);
  return {host, this_boot(), ::getpid(), start_of(::getpid()), rank, std::move(device)};
}

std::string Worker::name() const { return fmt::format("{}-{}-{}", host, pid, started); }

std::string to_json(const Worker& worker) {
  const nlohmann::ordered_json json = {{"host", worker.host}, {"boot", worker.boot},
                                       {"pid", worker.pid},   {"started", worker.started},
                                       {"rank", worker.rank}, {"device", worker.device}};
  return json.dump(1) + "\n";
}

Result<Worker> parse_worker(std::string_view text, const std::string& where) try {
  const auto json = nlohmann::json::parse(text);
  return Worker{json.at("host").get<std::string>(),         json.at("boot").get<std::string>(),
                whole_number<std::int64_t>(json.at("pid")), whole_number<std::uint64_t>(json.at("started")),
                whole_number<int>(json.at("rank")),         json.at("device").get<std::string>()};
} catch (const std::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where};
}

std::optional<bool> runs_here(const Worker& worker) {
  static const std::string here = this_boot();
  if (worker.boot != here) return std::nullopt;
  return start_of(worker.pid) == worker.started;
}

Result<std::unique_ptr<Pulse>> Pulse::start(const fs::path& workers, const Worker& me, Seconds patience,
                                            const Clock& clock) {
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(workers / me.name(), to_json(me)));
  return std::unique_ptr<Pulse>(new Pulse(workers, me, patience, clock));
}

Pulse::Pulse(fs::path workers, const Worker& me, Seconds patience, const Clock& clock)
    : workers_(std::move(workers)),
      mine_(workers_ / me.name()),
      patience_(patience),
      clock_(clock),
      thread_([this] { beat(); }) {}

Pulse::~Pulse() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ending_.notify_all();
  thread_.join();
  std::error_code ec;
  fs::remove(mine_, ec);
}

void Pulse::beat() {
  const std::chrono::duration<double> between(patience_.value() / kBeatsInPatience);
  std::unique_lock lock(mutex_);
  while (!ending_.wait_for(lock, between, [this] { return ended_; }))
    ::utimensat(AT_FDCWD, mine_.c_str(), nullptr, 0);  // the file server's time; late where it doesn't answer
}

Life Pulse::life_of(const std::string& worker) {
  const fs::path path = workers_ / worker;
  const FileTime now = time_of(path);
  if (!now.is_there) return Life::gone;  // it took its file away, or never was
  const auto [entry, first] = seen_.try_emplace(worker);
  Seen& seen = entry->second;
  if (seen.worker.host.empty())
    if (const auto text = read_file(path))
      if (auto parsed = parse_worker(*text, path.string())) seen.worker = std::move(*parsed);
  if (const auto runs = runs_here(seen.worker)) return *runs ? Life::alive : Life::gone;
  if (first || (now.changed && seen.changed != *now.changed)) {
    seen.changed = now.changed.value_or(0);
    seen.at = clock_.now();
    return Life::alive;
  }
  return clock_.now() - seen.at > patience_ ? Life::silent : Life::alive;
}

std::map<std::string, Worker> workers_in(const fs::path& workers) {
  std::map<std::string, Worker> found;
  std::error_code ec;
  for (fs::directory_iterator it(workers, ec), end; !ec && it != end; it.increment(ec))
    if (const auto text = read_file(it->path()))
      if (auto worker = parse_worker(*text, it->path().string()))
        found.emplace(it->path().filename().string(), std::move(*worker));
  return found;
}

}  // namespace emberlock::recon
