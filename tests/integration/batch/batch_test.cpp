// SPDX-License-Identifier: Apache-2.0
// `emberlock batch` as mpirun starts it, on a flame of simulated cameras: volumes are those of sequences of
// its chunks, bit for bit, however many ranks there are, whoever dies, and however often it was stopped.
#include <atomic>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::string kEmberlock = EMBERLOCK_PROGRAM;
constexpr int kFrames = 10;
constexpr int kChunk = 3;
const std::string kOptions = " --voxels 24 --device cpu --effects none";

/// mpirun as it has to be asked on any machine that tests run on.
std::string mpirun(const std::string& ranks) {
  return EMBERLOCK_MPIRUN + std::string(" --allow-run-as-root --oversubscribe ") + ranks + " ";
}

/// The session, and what its frames become by `reconstruct` in the batch's chunks.
struct Plain {
  test::TempFolder temp;
  fs::path session = temp / "film/session";
  std::vector<std::string> volumes;

  Plain() {
    run("simulate flame --cells 8 --rig virtual:4 --image 64x64 --frames " + std::to_string(kFrames) +
        " --out " + (temp / "film").string());
    for (int first = 0; first < kFrames; first += kChunk) {
      const int last = std::min(first + kChunk, kFrames) - 1;
      const fs::path out = temp / std::to_string(first);
      run(fmt::format("reconstruct {} --frames {}:{} --out {}{}", session.string(), first, last, out.string(),
                      kOptions));
      for (int frame = first; frame <= last; ++frame)
        volumes.push_back(test::bytes_of(out / fmt::format("frame-{}/volume.vdb", frame)));
    }
  }
  static void run(const std::string& words) {
    const Shell done = shell(kEmberlock + " " + words);
    if (done.status != 0) throw std::runtime_error(words + ": " + done.output);
  }
};

const Plain& plain() {
  static const Plain plain;
  return plain;
}

class Batch : public testing::Test {
 protected:
  [[nodiscard]] std::string command(const std::string& further = "") const {
    return fmt::format("{} batch {} --frames 0:{} --chunk {} --out {}{} {}", kEmberlock,
                       plain().session.string(), kFrames - 1, kChunk, out_.string(), kOptions, further);
  }
  /// One numbered sequence of what the plain sequences gave, and one report.
  void expect_same_volumes() const {
    for (int frame = 0; frame < kFrames; ++frame) {
      const fs::path link = out_ / fmt::format("volume_{:04}.vdb", frame);
      ASSERT_TRUE(fs::is_symlink(link)) << link;
      EXPECT_EQ(test::bytes_of(link), plain().volumes[static_cast<std::size_t>(frame)]) << frame;
      EXPECT_TRUE(fs::exists(out_ / fmt::format("frame-{}/report.json", frame)));
    }
    for (const char* file : {"frames.json", "frames.csv", "batch.csv", "report.html"})
      EXPECT_TRUE(fs::exists(out_ / "sequence" / file)) << file;
    EXPECT_THAT(names_in("work"), testing::IsEmpty());
    EXPECT_THAT(names_in("workers"), testing::IsEmpty());
    const Shell measured = shell(kEmberlock + " export " + out_.string() + " --format nvdb --out " +
                                 (temp_ / "exported").string());
    EXPECT_EQ(measured.status, 0) << measured.output;
  }
  [[nodiscard]] std::vector<std::string> names_in(const char* part) const {
    std::vector<std::string> names;
    std::error_code ec;
    for (fs::directory_iterator it(out_ / "batch" / part, ec), end; !ec && it != end; it.increment(ec))
      names.push_back(it->path().filename().string());
    return names;
  }
  [[nodiscard]] std::size_t volumes_begun() const {
    std::size_t count = names_in("done").size();
    for (const std::string& work : names_in("work"))
      for (const std::string& name : names_in(("work/" + work).c_str())) count += name.starts_with("frame-");
    return count;
  }

  /// Runs a command until `moment`, and then what is to happen; its result.
  Shell run_and_at(const std::string& words, const std::function<bool()>& moment,
                   const std::function<void()>& act) const {
    Shell result;
    std::atomic<bool> ended = false;
    std::thread running([&] {
      result = shell(words);
      ended = true;
    });
    EXPECT_TRUE(test::wait_until([&] { return moment() || ended; }));
    act();
    running.join();
    return result;
  }
  /// The process that has a claim whose chunk has volumes already.
  [[nodiscard]] std::optional<pid_t> pid_at_work() const {
    for (const std::string& work : names_in("work"))
      for (const std::string& name : names_in(("work/" + work).c_str()))
        if (name.starts_with("frame-")) {
          const std::size_t started = work.rfind('-');
          const std::size_t pid = work.rfind('-', started - 1);
          return std::stoi(work.substr(pid + 1, started - pid - 1));
        }
    return std::nullopt;
  }

  test::TempFolder temp_{test::TempFolder::On::disk};
  const fs::path out_ = temp_ / "out";
};

TEST_F(Batch, OneProcessAloneGivesThePlainVolumesAndRepeatsNothing) {
  const Shell run = shell(command());
  ASSERT_EQ(run.status, 0) << run.output;
  expect_same_volumes();
  const auto before = fs::last_write_time(out_ / "volume_0004.vdb");
  const Shell again = shell(command());
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_EQ(fs::last_write_time(out_ / "volume_0004.vdb"), before);
}

TEST_F(Batch, TwoRanksShareTheWorkAndTheFirstTellsOfIt) {
  // Whoever is at work first waits until the other has done something: on a busy machine it might do all.
  std::optional<pid_t> pid;
  const Shell run = run_and_at(
      mpirun("-n 2") + command(), [&] { return (pid = pid_at_work()).has_value(); },
      [&] {
        if (!pid) return;
        ::kill(*pid, SIGSTOP);
        const std::size_t done = names_in("done").size();
        EXPECT_TRUE(test::wait_until([&] { return names_in("done").size() > done; }));
        ::kill(*pid, SIGCONT);
      });
  ASSERT_EQ(run.status, 0) << run.output;
  expect_same_volumes();
  const std::string who = test::bytes_of(out_ / "sequence" / "batch.csv");
  EXPECT_THAT(who, HasSubstr(",0,0,")) << who;
  EXPECT_THAT(who, HasSubstr(",0,1,")) << who;
  EXPECT_THAT(run.output, HasSubstr("rank 0: 10 of 10 frames are volumes, 0 failed; 4 of 4 chunks"));
  EXPECT_THAT(run.output, Not(HasSubstr("rank 1: 10 of 10")));
}

TEST_F(Batch, AKilledRankCostsNoMoreThanItsChunk) {
  std::optional<pid_t> pid;
  const Shell run = run_and_at(
      mpirun("--enable-recovery -n 2") + command(), [&] { return (pid = pid_at_work()).has_value(); },
      [&] {
        if (pid) ::kill(*pid, SIGKILL);
      });
  expect_same_volumes();
  EXPECT_EQ(names_in("lost").size(), 1U) << run.output;
  EXPECT_THAT(run.output, HasSubstr("taken over"));
}

TEST_F(Batch, AKilledRunGoesOnOnAnotherNumberOfRanks) {
  std::optional<pid_t> pid;
  const Shell killed = run_and_at(
      command(), [&] { return !names_in("done").empty() && (pid = pid_at_work()); },
      [&] {
        if (pid) ::kill(*pid, SIGKILL);
      });
  EXPECT_NE(killed.status, 0);
  EXPECT_LT(names_in("done").size(), 4U) << killed.output;
  const Shell run = shell(mpirun("-n 3") + command());
  ASSERT_EQ(run.status, 0) << run.output;
  expect_same_volumes();
}

TEST_F(Batch, AStoppedRunKeepsTheFramesThatAreDone) {
  std::optional<pid_t> pid;
  const Shell stopped = run_and_at(
      "exec " + command(), [&] { return (pid = pid_at_work()).has_value(); },
      [&] {
        if (pid) ::kill(*pid, SIGTERM);
      });
  EXPECT_EQ(stopped.status, 1) << stopped.output;
  EXPECT_THAT(stopped.output, HasSubstr("ended early, as asked"));
  EXPECT_THAT(names_in("work"), testing::IsEmpty());
  EXPECT_THAT(names_in("claims"), testing::IsEmpty());
  ASSERT_EQ(names_in("partial").size(), 1U);
  EXPECT_TRUE(fs::exists(out_ / "sequence" / "report.html")) << "of what is done";
  const Shell status = shell(kEmberlock + " batch status " + out_.string());
  EXPECT_EQ(status.status, 0);
  EXPECT_THAT(status.output, HasSubstr("of 10 frames are volumes"));
  const Shell run = shell(mpirun("-n 2") + command());
  ASSERT_EQ(run.status, 0) << run.output;
  expect_same_volumes();
  EXPECT_THAT(names_in("lost"), testing::IsEmpty());
}

TEST_F(Batch, AFullDiskStopsItCleanlyAndMoreRoomLetsItGoOn) {
  const std::string disk = (temp_ / "disk").string();
  fs::create_directory(disk);
  const auto on_disk = [&](const std::string& words) {
    return fmt::format("unshare --mount{} sh -c '{}'", ::geteuid() == 0 ? "" : " --map-root-user", words);
  };
  // The ledger and a chunk or so fit; what is there moves to the real disk for the rest.
  const std::string batch = fmt::format("{} batch {} --frames 0:{} --chunk {} --out {}/out{}", kEmberlock,
                                        plain().session.string(), kFrames - 1, kChunk, disk, kOptions);
  const Shell full =
      shell(on_disk(fmt::format("mount -t tmpfs -o size={}k none {}; {}; echo ended by $?; cp -a {}/out {}",
                                1400, disk, batch, disk, out_.string())));
  EXPECT_THAT(full.output, HasSubstr("No space left on device"));
  EXPECT_THAT(full.output, HasSubstr("ended by 1")) << full.output;
  EXPECT_THAT(names_in("claims"), testing::IsEmpty()) << full.output;
  EXPECT_THAT(names_in("lost"), testing::IsEmpty());
  EXPECT_GT(volumes_begun() + names_in("partial").size(), 0U) << full.output;
  const Shell run = shell(mpirun("-n 2") + command());
  ASSERT_EQ(run.status, 0) << run.output;
  expect_same_volumes();
}

}  // namespace
}  // namespace emberlock
