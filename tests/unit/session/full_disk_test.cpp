// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
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

#include "session/async_writer.h"
#include "session/files.h"
#include "session/join.h"
#include "session/verify.h"
#include "tests/support/recording.h"
#include "tests/support/session_parts.h"

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
