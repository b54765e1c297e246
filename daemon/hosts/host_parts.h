// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/result.h"
#include "base/time_point.h"
#include "daemon/hosts/remote_host.h"
#include "emberlock/v1/hosts.pb.h"

namespace emberlock::daemon {

/// What became of another host's part of a recording.
struct PartNews {
  std::string session;
  v1::HostPart part;
};

/// The other hosts' parts of this host's recordings: has them begun and ended, and asks for each until it is
/// known to be whole or short, however long its host was away, and when emberlockd was restarted meanwhile.
/// A thread asks twice a second. Any thread may call.
class HostParts {
 public:
  using Hosts = std::vector<std::shared_ptr<RemoteHost>>;

  /// `leader` is how this host calls itself.
  explicit HostParts(Hosts hosts = {}, std::string leader = {});
  ~HostParts();
  HostParts(const HostParts&) = delete;
  HostParts& operator=(const HostParts&) = delete;

  [[nodiscard]] bool any() const { return !hosts_.empty(); }
  [[nodiscard]] std::vector<std::string> addresses() const;
  [[nodiscard]] const std::string& leader() const { return leader_; }
  /// What the clock of a host shows now, where it is known.
  [[nodiscard]] std::optional<v1::ClockReading> clock(const std::string& address) const;
  /// Each host's status, with how many parts are asked of it.
  [[nodiscard]] std::vector<v1::HostStatus> hosts() const;

  /// Has the parts of a session begun, all hosts at once, without waiting for their answers. A request is for
  /// the host that its place says; `known` is what this host's manifest says of the part. A host that doesn't
  /// answer begins when it does, as long as the recording lasts. `folder` is this host's own part.
  void begin(const std::filesystem::path& folder, const std::vector<v1::PartRequest>& requests,
             const std::vector<v1::HostPart>& known);
  /// The recording ends, or ended, at this instant of this host's clock.
  void end(const std::filesystem::path& folder, TimePoint at);
  /// This host's own part is finished: waits until the others are known, at most `patience`, and writes into
  /// the manifest what is known of them; what comes later is written when it comes.
  Status close(const std::filesystem::path& folder, Seconds patience);
  /// Takes up sessions of an earlier emberlockd, whose manifests name parts that aren't known to be whole.
  void take_up(const std::vector<std::filesystem::path>& folders);

  /// As they are known now; none of a session that isn't asked for any more.
  [[nodiscard]] std::vector<v1::HostPart> of(const std::filesystem::path& folder) const;
  /// What is news since the last call: parts that are missing, short, or whole after all.
  std::vector<PartNews> news();

 private:
  struct Part {
    std::shared_ptr<RemoteHost> host;        ///< null: it isn't one of the rig's any more
    std::optional<v1::PartRequest> request;  ///< to begin it with; absent after a restart
    v1::HostPart known;
    bool begun = false;  ///< its host said so
    bool busy = false;   ///< it is being begun
    Seconds late{0};     ///< it began so much after the recording, at most
    bool settled = false;
    bool wanting = false;  ///< as it was told
  };
  struct Take {
    std::filesystem::path folder;
    std::string session_id = {};
    std::optional<TimePoint> ended = {};  ///< on this host's clock
    bool restarted = false;               ///< emberlockd was, so it doesn't know when it ended
    bool closed = false;                  ///< this host's own part is finished
    bool behind = false;                  ///< the manifest doesn't say what is known
    std::vector<Part> parts = {};
  };
  void run();
  /// What the part's host says of it, and what is done about that. Without the lock.
  static Part asked(const Take& take, Part part);
  static void begin(Part& part, const std::filesystem::path& folder);
  static void find_begun(Part& part);
  static void settle(const Take& take, const v1::HostPart& there, Part& part);
  void write_behind(std::unique_lock<std::mutex>& lock);
  // These require the lock.
  Take* find(const std::filesystem::path& folder);
  void take_over(const std::string& session_id, std::size_t place, Part part);

  const Hosts hosts_;
  const std::string leader_;
  mutable std::mutex mutex_;
  std::condition_variable wakes_;
  std::condition_variable looked_;
  bool ending_ = false;
  bool hurries_ = false;
  std::vector<Take> takes_;
  std::vector<std::future<void>> beginning_;  ///< each has a host begin a part
  std::vector<PartNews> news_;
  std::thread thread_;  ///< last: it uses all of the above; none without hosts
};

}  // namespace emberlock::daemon
