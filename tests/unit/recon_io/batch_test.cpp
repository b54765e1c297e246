// SPDX-License-Identifier: Apache-2.0
// A batch's plan, its ranks, and how they know of one another's death.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "recon/batch/plan.h"
#include "recon/batch/pulse.h"
#include "recon/batch/rank.h"
#include "tests/support/counting_clock.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"
#include "tests/support/wait.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

BatchPlan plan() {
  BatchPlan plan{"s", "s of today", {}, 4, 32, {{"--effects", "none"}}};
  for (std::uint64_t frame = 10; frame < 30; frame += 2) plan.frames.push_back(frame);
  return plan;
}

TEST(BatchPlanTest, ItsChunksHoldEachFrameOnceInOrderAndSortByName) {
  for (int chunk = 1; chunk < 12; ++chunk) {
    BatchPlan cut = plan();
    cut.chunk = chunk;
    std::vector<std::uint64_t> frames;
    std::string last;
    for (const Chunk& c : chunks_of(cut)) {
      EXPECT_LE(c.frames.size(), static_cast<std::size_t>(chunk));
      EXPECT_LT(last, c.name);
      EXPECT_EQ(c.name.find('.'), std::string::npos);
      last = c.name;
      frames.insert(frames.end(), c.frames.begin(), c.frames.end());
    }
    EXPECT_EQ(frames, cut.frames);
  }
}

TEST(BatchPlanTest, IsWrittenAndReadToTheSame) {
  const auto read = value_of(parse_plan(to_json(plan()), "here"));
  EXPECT_TRUE(same_run(read, plan(), "here").ok());
  EXPECT_EQ(read.voxels, 32);
  EXPECT_EQ(read.input, "s");
  for (const char* bad : {"", "{}", "[1]", R"({"format": "emberlock sequence", "version": 1})"})
    EXPECT_EQ(parse_plan(bad, "here").error().kind, ErrorKind::bad_input) << bad;
  for (const char* number : {"99999999999999999999", "1e29", "-1", "3000000000", "2.5"}) {
    std::string text = to_json(plan());
    const std::size_t at = text.find("32");
    ASSERT_NE(at, std::string::npos);
    EXPECT_FALSE(parse_plan(text.replace(at, 2, number), "here").ok()) << number;
  }
  BatchPlan none = plan();
  none.frames = {3, 3};
  EXPECT_FALSE(parse_plan(to_json(none), "here").ok());
}

TEST(BatchPlanTest, AnotherRunIsToldByItsFirstDifference) {
  const auto words = [](const auto& change) {
    BatchPlan asked = plan();
    change(asked);
    const Status same = same_run(plan(), asked, "out");
    return same.ok() ? std::string() : same.error().message();
  };
  EXPECT_EQ(words([](BatchPlan& p) { p.chunk = 0; }), "") << "not asked for";
  EXPECT_EQ(words([](BatchPlan& p) { p.input = "by another path"; }), "");
  EXPECT_THAT(words([](BatchPlan& p) { p.session = "s of yesterday"; }), HasSubstr("another session"));
  EXPECT_THAT(words([](BatchPlan& p) { p.frames.pop_back(); }),
              HasSubstr("frames 10:28, each of 2, not 10:26"));
  EXPECT_THAT(words([](BatchPlan& p) { p.chunk = 5; }), HasSubstr("chunks of 4 frames, not 5"));
  EXPECT_THAT(words([](BatchPlan& p) { p.options["--effects"] = "auto"; }),
              HasSubstr("--effects was \"none\", and is \"auto\""));
  EXPECT_THAT(words([](BatchPlan& p) { p.options["--box"] = "1"; }), HasSubstr("--box was not given"));
}

Rank rank_of(const std::map<std::string, std::string>& environment) {
  return rank_from([&](const char* name) -> const char* {
    const auto found = environment.find(name);
    return found == environment.end() ? nullptr : found->second.c_str();
  });
}

TEST(RankTest, IsToldByTheEnvironmentOfWhoStartedIt) {
  EXPECT_EQ(rank_of({}).count, 1);
  const Rank open_mpi = rank_of({{"OMPI_COMM_WORLD_RANK", "5"},
                                 {"OMPI_COMM_WORLD_SIZE", "8"},
                                 {"OMPI_COMM_WORLD_LOCAL_RANK", "1"},
                                 {"OMPI_COMM_WORLD_LOCAL_SIZE", "4"},
                                 {"SLURM_PROCID", "0"}});  // of the job that mpirun runs in
  EXPECT_EQ(open_mpi.number, 5);
  EXPECT_EQ(open_mpi.count, 8);
  EXPECT_EQ(open_mpi.on_machine, 1);
  EXPECT_EQ(open_mpi.count_on_machine, 4);
  const Rank slurm = rank_of({{"SLURM_PROCID", "3"},
                              {"SLURM_NTASKS", "4"},
                              {"SLURM_LOCALID", "1"},
                              {"SLURM_TASKS_PER_NODE", "2(x2)"},
                              {"SLURM_CPUS_PER_TASK", "6"}});
  EXPECT_EQ(slurm.number, 3);
  EXPECT_EQ(slurm.count, 4);
  EXPECT_EQ(slurm.count_on_machine, 2);
  EXPECT_EQ(slurm.threads, 6);
  EXPECT_EQ(rank_of({{"PMI_RANK", "2"}}).number, 2);
  EXPECT_EQ(rank_of({{"OMPI_COMM_WORLD_RANK", "no number"}}).number, 0);
}

TEST(RankTest, IdleRanksAskRarelyEnoughForTheFolderAndOftenEnoughForTheirPatience) {
  const auto wait = [](int ranks, double patience) {
    Rank rank;
    rank.count = ranks;
    return idle_wait(rank, Seconds(patience)).value();
  };
  EXPECT_EQ(wait(1, 60), 0.1);
  EXPECT_EQ(wait(5, 60), 0.1);
  EXPECT_DOUBLE_EQ(wait(100, 60), 2);
  EXPECT_DOUBLE_EQ(wait(1000, 60), 20);
  EXPECT_DOUBLE_EQ(wait(2000, 60), 20) << "a dead rank is seen within a third more";
  EXPECT_EQ(wait(1000, 0.2), 0.1);
}

TEST(RankTest, RanksOfOneMachineShareItsCoresAndKeepToThoseTheyMayRunOn) {
  Rank rank;
  EXPECT_EQ(threads_of(rank, 16, 16), 16);
  rank.count_on_machine = 4;
  EXPECT_EQ(threads_of(rank, 16, 16), 4);
  EXPECT_EQ(threads_of(rank, 16, 1), 1) << "bound to a core";
  EXPECT_EQ(threads_of(rank, 2, 2), 1) << "more ranks than cores";
  rank.threads = 2;
  EXPECT_EQ(threads_of(rank, 16, 16), 2);
}

TEST(RankTest, ADeviceThatIsNamedIsTaken) {
  EXPECT_EQ(*device_of({}, Device::cpu, false), Device::cpu);
  Rank last;
  last.on_machine = 1000;  // no machine has so many GPUs
  EXPECT_EQ(*device_of(last, Device::automatic, false), Device::cpu);
}

TEST(PulseTest, AProcessOfThisMachineIsAliveUntilItEnds) {
  const test::TempFolder temp;
  const pid_t child = ::fork();
  if (child == 0) {
    ::pause();
    ::_exit(0);
  }
  Worker worker = Worker::here(0, "cpu");
  EXPECT_EQ(runs_here(worker), true);
  worker.started += 1;  // the number's earlier owner
  EXPECT_EQ(runs_here(worker), false);
  worker.boot = "another machine's";
  EXPECT_EQ(runs_here(worker), std::nullopt);

  const test::CountingClock clock;
  const auto pulse = value_of(Pulse::start(temp.path(), Worker::here(1, "cpu"), Seconds(60), clock));
  // The child's own record, made here: the fields of its stat that matter are the kernel's.
  std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
  std::string text{std::istreambuf_iterator<char>(stat), {}}, field;
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  for (int i = 0; i < 20; ++i) fields >> field;
  Worker forked = Worker::here(0, "cpu");
  forked.pid = child;
  forked.started = std::stoull(field);
  std::ofstream(temp / forked.name()) << to_json(forked);
  EXPECT_EQ(pulse->life_of(forked.name()), Life::alive);
  ::kill(child, SIGKILL);
  siginfo_t ended{};
  ::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT);  // a zombie still has its number
  EXPECT_EQ(pulse->life_of(forked.name()), Life::gone);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(pulse->life_of(forked.name()), Life::gone);
}

TEST(PulseTest, OneOfAnotherMachineIsAliveWhileItsFileChangesWhateverItsTime) {
  const test::TempFolder temp;
  test::CountingClock clock(Seconds(0));
  const auto pulse = value_of(Pulse::start(temp.path(), Worker::here(0, "cpu"), Seconds(60), clock));
  Worker other = Worker::here(1, "cpu");
  other.boot = "another machine's";
  other.host = "n2";
  const fs::path file = temp / other.name();
  std::ofstream(file) << to_json(other);
  EXPECT_EQ(pulse->life_of(other.name()), Life::alive) << "at first sight";
  const auto long_ago = fs::last_write_time(file) - std::chrono::hours(10'000);
  for (int beat = 0; beat < 6; ++beat) {  // by a clock that is a year late
    fs::last_write_time(file, long_ago + std::chrono::seconds(beat));
    EXPECT_EQ(pulse->life_of(other.name()), Life::alive) << beat;
    clock.pass(Seconds(59));
  }
  clock.pass(Seconds(2));
  EXPECT_EQ(pulse->life_of(other.name()), Life::silent);
  fs::last_write_time(file, long_ago);
  EXPECT_EQ(pulse->life_of(other.name()), Life::alive) << "it has woken";
  fs::remove(file);
  EXPECT_EQ(pulse->life_of(other.name()), Life::gone) << "in peace";
}

TEST(PulseTest, AFileServerThatDoesntAnswerKillsNobodyAtOnce) {
  const test::TempFolder temp;
  const fs::path workers = temp / "workers";
  fs::create_directory(workers);
  test::CountingClock clock(Seconds(0));
  const auto pulse = value_of(Pulse::start(workers, Worker::here(0, "cpu"), Seconds(60), clock));
  Worker other = Worker::here(1, "cpu");
  other.boot = "another machine's";
  std::ofstream(workers / other.name()) << to_json(other);
  EXPECT_EQ(pulse->life_of(other.name()), Life::alive);
  fs::rename(workers, temp / "away");
  std::ofstream(workers) << "no folder";  // ENOTDIR, as ESTALE
  EXPECT_EQ(pulse->life_of(other.name()), Life::alive);
  clock.pass(Seconds(61));
  EXPECT_EQ(pulse->life_of(other.name()), Life::silent);
  fs::remove(workers);
  fs::rename(temp / "away", workers);
  EXPECT_EQ(pulse->life_of(other.name()), Life::silent) << "its file stayed as it was";
  EXPECT_EQ(pulse->life_of("nobody"), Life::gone);
}

TEST(PulseTest, BeatsWhileItLivesAndLeavesNothing) {
  const test::TempFolder temp;
  const Worker me = Worker::here(3, "cpu");
  {
    const test::CountingClock clock;
    const auto pulse = value_of(Pulse::start(temp.path(), me, Seconds(0.12), clock));
    const auto before = fs::last_write_time(temp / me.name());
    EXPECT_TRUE(test::wait_until([&] { return fs::last_write_time(temp / me.name()) != before; }));
    const auto workers = workers_in(temp.path());
    ASSERT_TRUE(workers.contains(me.name()));
    EXPECT_EQ(workers.at(me.name()).rank, 3);
  }
  EXPECT_TRUE(fs::is_empty(temp.path()));
}

}  // namespace
}  // namespace emberlock::recon
