// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <system_error>

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "session/async_writer.h"
#include "session/events.h"
#include "session/files.h"
#include "session/join.h"
#include "session/store.h"
#include "session/verify.h"
#include "tests/support/recording.h"
#include "tests/support/session_parts.h"
#include "tests/support/wait.h"

// A disk that is full, in earnest: a process of its own records to a small file system in memory (in a mount
// namespace), or may not let a file grow.
namespace emberlock::session {
namespace {

using test::manifest_of;
using test::noise_frame;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kFullDiskLayout{{64, 48}, PixelFormat::gray8, 8};
constexpr std::uint64_t kFullDiskFrameBytes = 64 * 48;
constexpr std::uint64_t kManyFrames = 2000;  // 6 MB a camera
constexpr int kNoNamespace = 77;

/// Runs `body` in a child process; it says by its text what went wrong. Returns the exit code.
int in_a_process(const std::function<std::string()>& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    const std::string wrong = body();
    if (wrong == "no namespace") ::_exit(kNoNamespace);
    if (!wrong.empty()) std::fprintf(stderr, "%s\n", wrong.c_str());
    ::_exit(wrong.empty() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

std::string mount_small_disk(const std::filesystem::path& at, int megabytes) {
  const bool alone =
      ::geteuid() == 0 ? ::unshare(CLONE_NEWNS) == 0 : ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0;
  const std::string options = "size=" + std::to_string(megabytes) + "m";
  const bool mounted = alone && ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                       ::mount("small", at.c_str(), "tmpfs", 0, options.c_str()) == 0;
  return mounted ? "" : "no namespace";
}

/// Records two cameras until all frames were offered; says what doesn't add up. They keep step, and so share
/// the disk fairly: neither is more than its short queue ahead, however the threads are scheduled.
std::string record_all(const std::filesystem::path& folder, Encoding encoding, std::uint64_t& lost) {
  auto session = SessionWriter::create(folder, manifest_of({kFullDiskLayout, kFullDiskLayout}),
                                       small_disk_options(encoding));
  if (!session) return session.error().message();
  AsyncWriter writer(std::move(session).value(),
                     {.queue_bytes = 2 * kFullDiskFrameBytes, .when_full = WhenFull::wait});
  std::array<std::uint64_t, 2> written{};  // as was told while recording
  for (std::uint64_t i = 0; i < kManyFrames; ++i) {
    for (const std::size_t camera : {0, 1}) {
      if (!writer.push(camera, noise_frame(kFullDiskLayout, i, camera))) return "a frame was lost on its way";
      written[camera] = std::max(written[camera], writer.progress(camera).written);
    }
  }
  const auto manifest = writer.finish();
  if (!manifest) return manifest.error().message();
  if (manifest->state() != v1::Manifest::COMPLETE) return "the manifest isn't finished";
  if (!writer.failure()) return "nobody was told";
  lost = 0;
  for (const std::size_t camera : {0, 1}) {
    const v1::Counts& counts = manifest->cameras(static_cast<int>(camera)).counts();
    if (counts.recorded() + counts.disk() != kManyFrames) return "a frame is unaccounted for";
    if (counts.recorded() < std::max<std::uint64_t>(100, written[camera]))
      return "what was written before isn't kept";
    lost += counts.disk();
  }
  const auto check = verify_session(folder);
  if (!check) return check.error().message();
  if (!check->whole())
    return check->cameras[0].problems.empty() ? check->to_do : check->cameras[0].problems[0];
  return "";
}

class FullDiskThreads : public testing::TestWithParam<Encoding> {};

TEST_P(FullDiskThreads, InMidRecordingKeepsWhatIsWrittenFinishesTheManifestAndCountsTheRest) {
  const TempFolder temp;
  const int code = in_a_process([&]() -> std::string {
    if (std::string wrong = mount_small_disk(temp.path(), 5); !wrong.empty()) return wrong;
    std::uint64_t lost = 0;
    std::string wrong = record_all(temp / "s", GetParam(), lost);
    return wrong.empty() && lost < kManyFrames ? "the disk held more than it can" : wrong;
  });
  ASSERT_NE(code, kNoNamespace) << "nobody may mount here: run as root, or allow user namespaces";
  EXPECT_EQ(code, 0);
}

TEST_P(FullDiskThreads, ThatHasRoomAgainIsRecordedToInANewSegment) {
  const TempFolder temp;
  const int code = in_a_process([&]() -> std::string {
    if (std::string wrong = mount_small_disk(temp.path(), 6); !wrong.empty()) return wrong;
    auto writer =
        SessionWriter::create(temp / "s", manifest_of({kFullDiskLayout}), small_disk_options(GetParam()));
    if (!writer) return writer.error().message();
    test::put_bytes(temp / "other", std::string(std::size_t{4} << 20, 'x'));
    std::uint64_t i = 0;
    while (i < kManyFrames && writer->write(0, noise_frame(kFullDiskLayout, i, 0)).ok()) ++i;
    if (i == kManyFrames) return "the disk wasn't full";
    std::filesystem::remove(temp / "other");
    const std::uint64_t full_at = i;
    while (i < full_at + 300) static_cast<void>(writer->write(0, noise_frame(kFullDiskLayout, ++i, 0)));
    const auto manifest = writer->finish();
    if (!manifest) return manifest.error().message();
    const v1::CameraStream& camera = manifest->cameras(0);
    if (camera.segments_size() != 2) return "segments: " + std::to_string(camera.segments_size());
    if (camera.counts().disk() > 150) return "lost: " + std::to_string(camera.counts().disk());
    if (camera.counts().recorded() + camera.counts().disk() != i + 1) return "a frame is unaccounted for";
    const auto check = verify_session(temp / "s");
    return check && check->whole() ? "" : "it can't be read back";
  });
  ASSERT_NE(code, kNoNamespace) << "nobody may mount here: run as root, or allow user namespaces";
  EXPECT_EQ(code, 0);
}

TEST_P(FullDiskThreads, FilesThatMayNotGrowAreAsAFullDisk) {
  const TempFolder temp;
  const int code = in_a_process([&]() -> std::string {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{2 << 20, 2 << 20};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return "no limit";
    std::uint64_t lost = 0;
    return record_all(temp / "s", GetParam(), lost);
  });
  EXPECT_EQ(code, 0);
}

/// As long as it lives, no file of this process may grow.
class NoGrowth {
 public:
  NoGrowth() {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit none{1, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &none);
  }
  NoGrowth(const NoGrowth&) = delete;
  NoGrowth& operator=(const NoGrowth&) = delete;
  ~NoGrowth() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

constexpr double kRefusalRate = 20;

/// Pushes frames of this many seconds, and waits until each has been tried.
void push_seconds(AsyncWriter& writer, double seconds, std::uint64_t& pushed) {
  for (const auto end = pushed + static_cast<std::uint64_t>(std::llround(seconds * kRefusalRate));
       pushed < end; ++pushed) {
    Frame frame = noise_frame({{32, 24}, PixelFormat::gray8, 8}, pushed);
    frame.stamp.monotonic_time.ns =
        static_cast<std::int64_t>(1e9 + 1e9 / kRefusalRate * static_cast<double>(pushed));
    static_cast<void>(writer.push(0, std::move(frame)));
  }
  test::wait_until([&] { return writer.progress(0).queued == 0; });
}

v1::Event note_event(int number) {
  v1::Event event;
  event.set_monotonic_ns(number);
  return event;
}

/// The disk refuses all from a second on, until a later one.
std::string record_over_refusals(const std::filesystem::path& folder, Encoding encoding, double from,
                                 double until) {
  auto session = SessionWriter::create(folder, manifest_of({{{32, 24}, PixelFormat::gray8, 8}}),
                                       small_disk_options(encoding));
  if (!session) return session.error().message();
  AsyncWriter writer(std::move(session).value(), {.queue_time = Seconds(1e3), .when_full = WhenFull::wait});
  std::uint64_t pushed = 0;
  static_cast<void>(writer.append(note_event(1)));
  push_seconds(writer, from, pushed);
  if (writer.trouble()) return "trouble before there is any";
  {
    const NoGrowth no_growth;
    static_cast<void>(writer.append(note_event(2)));
    push_seconds(writer, std::max(until - from, 1 / kRefusalRate), pushed);
    if (!test::wait_until([&] { return writer.trouble().has_value(); })) return "no trouble is reported";
    const DiskTrouble trouble = *writer.trouble();
    if (trouble.is_final) return "it isn't tried again: " + trouble.error.message();
    if (until - from > 1.5 && trouble.lasting < Seconds(until - from - 1.5)) return "its length is wrong";
  }
  static_cast<void>(writer.append(note_event(3)));
  push_seconds(writer, 4, pushed);
  if (!test::wait_until([&] {
        push_seconds(writer, 1 / kRefusalRate, pushed);
        return !writer.trouble();
      }))
    return "the trouble doesn't end";
  const auto manifest = writer.finish();
  if (!manifest) return manifest.error().message();
  const v1::Counts& counts = manifest->cameras(0).counts();
  if (counts.recorded() + counts.disk() != pushed) return "a frame is unaccounted for";
  // What an encoder holds, a quarter of a second, is lost with the segment.
  if (static_cast<double>(counts.disk()) > (until - from + 1.5) * kRefusalRate + 1)
    return "too many are lost: " + std::to_string(counts.disk());
  if (manifest->cameras(0).segments_size() != (from > 1 ? 2 : 1)) return "segments";
  const auto events = read_file(events_path(folder));
  if (!events || parse_events(*events).events.size() != 3) return "an event is lost";
  const auto check = verify_session(folder);
  return check && check->whole() ? "" : "it can't be read back";
}

TEST(DiskThatRefusesThreads, ForAWhileIsReportedAndRecordedToAgain) {
  for (const Encoding encoding : {Encoding::ffv1, Encoding::raw_nut, Encoding::huffman_nut})
    for (const double from : {0.0, 2.0})
      for (const double lasts : {0.0, 0.5, 1.5, 7.0}) {
        const TempFolder temp;
        EXPECT_EQ(
            in_a_process([&] { return record_over_refusals(temp / "s", encoding, from, from + lasts); }), 0)
            << static_cast<int>(encoding) << ", from " << from << " s, for " << lasts << " s";
      }
}

/// Where recordings go before and after what happens to their disk.
TEST(DiskThatIsUnmountedThreads, IsNeverRecordedOverOntoTheOneBelow) {
  const TempFolder temp;
  const int code = in_a_process([&]() -> std::string {
    const std::filesystem::path disk = temp / "disk", other = temp / "other", at = temp / "at";
    for (const auto& folder : {disk, other, at}) std::filesystem::create_directory(folder);
    if (std::string wrong = mount_small_disk(disk, 2); !wrong.empty()) return wrong;
    const auto mount = [&](const std::filesystem::path& which) {
      return ::mount(which.c_str(), at.c_str(), nullptr, MS_BIND, nullptr) == 0;
    };
    const auto unmount = [&] { return ::umount2(at.c_str(), MNT_DETACH) == 0; };
    if (::mount("other", other.c_str(), "tmpfs", 0, "size=2m") != 0 || !mount(disk)) return "no namespace";
    const auto store = SessionStore::open(at / "deep" / "sessions", {.min_free_bytes = 0});
    if (!store) return store.error().message();
    const auto refuses = [&](const char* when) -> std::string {
      const Error errors[] = {store->path_for_new("a", {1}).error(), store->path_for_new("", {1}).error(),
                              store->path_for_export("a", "video").error(), store->storage(1).error(),
                              store->check_disk().error()};
      for (const Error& error : errors)
        if (error.kind != ErrorKind::refused || error.what.find("another disk") == std::string::npos)
          return when;
      return "";
    };
    const auto accepts = [&](const char* when) -> std::string {
      return store->path_for_new("a", {1}) && store->path_for_export("a", "video") && store->storage(1)
                 ? ""
                 : when;
    };
    const std::vector<std::function<std::string()>> steps{
        [&] { return accepts("mounted"); },
        [&] { return unmount() ? refuses("unmounted") : "umount"; },
        [&] {
          return std::filesystem::create_directories(store->folder()) ? refuses("a folder below") : "mkdir";
        },
        [&] { return mount(other) ? refuses("another disk") : "mount"; },
        [&] { return unmount() && mount(disk) ? accepts("mounted again") : "mount"; },
        [&] {
          std::filesystem::remove_all(at / "deep");  // as a user would: it is made again on the same disk
          return store->path_for_new("a", {1}) ? "" : "removed by the user";
        },
    };
    for (const auto& step : steps)
      if (std::string wrong = step(); !wrong.empty()) return wrong;
    return "";
  });
  ASSERT_NE(code, kNoNamespace) << "nobody may mount here: run as root, or allow user namespaces";
  EXPECT_EQ(code, 0);
}

TEST(JoinOnAFullDiskThreads, LeavesNothing) {
  const TempFolder temp;
  const auto parts = test::record_parts(temp / "parts", test::three_hosts(), {.frames = 200});  // 3 MB
  std::filesystem::create_directory(temp / "disk");
  const int code = in_a_process([&]() -> std::string {
    if (std::string wrong = mount_small_disk(temp / "disk", 2); !wrong.empty()) return wrong;
    const auto joined = join_sessions(parts, temp / "disk/joined", Missing::is_an_error);
    if (joined) return "the disk held more than it can";
    if (joined.error().kind != ErrorKind::io) return joined.error().message();
    return std::filesystem::is_empty(temp / "disk") ? "" : "something is left";
  });
  ASSERT_NE(code, kNoNamespace) << "nobody may mount here: run as root, or allow user namespaces";
  EXPECT_EQ(code, 0);
}

INSTANTIATE_TEST_SUITE_P(Recording, FullDiskThreads, testing::Values(Encoding::ffv1, Encoding::raw_nut));

}  // namespace
}  // namespace emberlock::session
