// SPDX-License-Identifier: Apache-2.0
#include "recon/batch/ledger.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "base/file.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

constexpr int kFramesOfAChunk = 3;

const Ledger::LifeOf kAllLive = [](const std::string&) { return Life::alive; };

std::vector<std::string> names_below(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  return names;
}

/// What a frame becomes, whoever does it.
std::string content(const std::string& chunk, int frame) { return chunk + " " + std::to_string(frame); }

void expect_whole(const Ledger& ledger, const std::string& chunk) {
  for (int frame = 0; frame < kFramesOfAChunk; ++frame) {
    const auto text = read_file(ledger.result(chunk) / std::to_string(frame));
    ASSERT_TRUE(text.ok()) << chunk << ' ' << frame;
    EXPECT_EQ(*text, content(chunk, frame));
  }
}

/// A process that works on a ledger: alive, or dead, or alive and taken for dead.
struct SimulatedRank {
  Ledger ledger;
  Life life = Life::alive;  ///< as the others see it
  std::optional<Ledger::Claim> claim = {};
};

/// What can happen to ranks, one step at a time.
class Simulation {
 public:
  Simulation(const fs::path& folder, int ranks, int chunks) : folder_(folder / "ledger") {
    for (int c = 0; c < chunks; ++c) chunks_.push_back("chunk-" + std::to_string(c));
    for (int r = 0; r < ranks; ++r) add_rank();
  }

  void step(std::size_t rank, int what) {
    SimulatedRank& r = ranks_[rank % ranks_.size()];
    if (r.life == Life::gone) return;
    if (!r.claim) {
      take(r);
    } else if (what < 5) {
      write_next_frame(r);
    } else if (what == 5) {
      EXPECT_TRUE(r.ledger.give_back(*r.claim).ok());
      r.claim.reset();
    } else {
      r.life = what == 6 ? Life::gone : Life::silent;
      add_rank();
    }
    expect_every_chunk_to_be_somewhere();
  }
  /// All that live go on until nothing is left to do.
  void finish() {
    while (!ranks_[0].ledger.settled()) {
      add_rank();
      SimulatedRank& r = ranks_.back();
      for (std::size_t other = 0; other + 1 < ranks_.size(); ++other) ranks_[other].life = Life::gone;
      take(r);
      while (r.claim) write_next_frame(r);
    }
  }
  void expect_each_done_once() const {
    const Ledger& ledger = ranks_[0].ledger;
    for (const std::string& chunk : chunks_) {
      const auto published = published_.find(chunk);
      EXPECT_EQ(published == published_.end() ? 0 : published->second, ledger.done(chunk) ? 1 : 0) << chunk;
      if (ledger.done(chunk)) expect_whole(ledger, chunk);
      EXPECT_TRUE(ledger.done(chunk) || losses_of(chunk) >= Ledger::kMostLosses) << chunk;
    }
  }

 private:
  void add_rank() {
    const std::string name = "rank-" + std::to_string(ranks_.size());
    EXPECT_TRUE(Ledger::create(folder_, name, "plan of " + name, chunks_).ok());
    ranks_.push_back({Ledger(folder_, chunks_, name)});
  }
  void take(SimulatedRank& r) {
    const auto claim = value_of(r.ledger.take([&](const std::string& worker) {
      return ranks_[static_cast<std::size_t>(std::stoi(worker.substr(5)))].life;
    }));
    r.claim = claim;
  }
  /// One that was taken for dead may have lost its folder.
  void write_next_frame(SimulatedRank& r) {
    int frame = 0;
    while (fs::exists(r.claim->work / std::to_string(frame))) ++frame;
    if (frame < kFramesOfAChunk) {
      std::ofstream(r.claim->work / std::to_string(frame)) << content(r.claim->chunk, frame);
      if (fs::exists(r.claim->work)) return;
    }
    const auto first = value_of(r.ledger.finish(*r.claim));
    published_[r.claim->chunk] += first ? 1 : 0;
    r.claim.reset();
  }
  [[nodiscard]] std::size_t losses_of(const std::string& chunk) const {
    const auto losses = ranks_[0].ledger.losses();
    return static_cast<std::size_t>(std::count_if(losses.begin(), losses.end(), [&](const std::string& name) {
      return name.starts_with(chunk + ".");
    }));
  }
  void expect_every_chunk_to_be_somewhere() const {
    std::set<std::string> found;
    for (const char* where : {"todo", "claims", "given_up", "done"})
      for (const std::string& name : names_below(folder_ / where))
        found.insert(name.substr(0, name.find('.')));
    EXPECT_THAT(found, testing::IsSupersetOf(chunks_));
  }

  fs::path folder_;
  std::vector<std::string> chunks_;
  std::vector<SimulatedRank> ranks_;
  std::map<std::string, int> published_;
};

TEST(LedgerTest, HoweverRanksTakeFinishGiveBackDieAndWakeEachChunkIsDoneOnceToTheSameBits) {
  EXPECT_TRUE(rc::check([] {
    const TempFolder temp;
    Simulation simulation(temp.path(), *rc::gen::inRange(1, 4), *rc::gen::inRange(1, 5));
    for (const auto& [rank, what] : *rc::gen::container<std::vector<std::pair<std::size_t, int>>>(
             rc::gen::pair(rc::gen::inRange<std::size_t>(0, 12), rc::gen::inRange(0, 8))))
      simulation.step(rank, what);
    simulation.finish();
    simulation.expect_each_done_once();
    RC_ASSERT(!testing::Test::HasFailure());
  }));
}

TEST(LedgerTest, RanksThatAskAtOnceGetEachChunkOnce) {
  const TempFolder temp;
  std::vector<std::string> chunks;
  for (int c = 0; c < 200; ++c) chunks.push_back("chunk-" + std::to_string(c));
  std::vector<std::vector<std::string>> taken(4);
  std::vector<std::thread> ranks;
  for (std::size_t r = 0; r < taken.size(); ++r)
    ranks.emplace_back([&, r] {
      const std::string name = "rank-" + std::to_string(r);
      ASSERT_TRUE(Ledger::create(temp / "ledger", name, "by " + name, chunks).ok());
      Ledger ledger(temp / "ledger", chunks, name);
      for (;;) {
        const auto claim = value_of(ledger.take(kAllLive));
        if (!claim) break;
        taken[r].push_back(claim->chunk);
        ASSERT_TRUE(ledger.finish(*claim).ok());
      }
    });
  for (std::thread& rank : ranks) rank.join();
  std::vector<std::string> all;
  for (const auto& some : taken) all.insert(all.end(), some.begin(), some.end());
  EXPECT_THAT(all, testing::UnorderedElementsAreArray(chunks));
  EXPECT_THAT(names_below(temp.path()), testing::ElementsAre("ledger")) << "those that came second left none";
}

class LedgerOfTwo : public testing::Test {
 protected:
  LedgerOfTwo() {
    EXPECT_TRUE(Ledger::create(folder_, "first", "the plan", chunks_).ok());
    EXPECT_TRUE(Ledger::create(folder_, "second", "another plan", chunks_).ok());
  }
  static void write(const Ledger::Claim& claim, const char* name) {
    std::ofstream(claim.work / name) << content(claim.chunk, 0);
  }
  /// The first worker's, of the first chunk, with a frame.
  Ledger::Claim claim_with_frame() {
    Ledger::Claim claim = value_of(first_.take(kAllLive)).value();
    write(claim, "frame");
    return claim;
  }
  /// The first chunk is taken with the frame that an earlier attempt left.
  static void expect_gone_on_with(Ledger& ledger) {
    const Ledger::Claim again = value_of(ledger.take(kAllLive)).value();
    EXPECT_EQ(again.chunk, "a");
    EXPECT_TRUE(fs::exists(again.work / "frame"));
    EXPECT_TRUE(again.from.empty()) << "nobody died";
  }
  const TempFolder temp_;
  const fs::path folder_ = temp_ / "ledger";
  const std::vector<std::string> chunks_{"a", "b"};
  Ledger first_{folder_, chunks_, "first"}, second_{folder_, chunks_, "second"};
  static Ledger::LifeOf first_is(Life life) {
    return [life](const std::string& w) { return w == "first" ? life : Life::alive; };
  }
};

TEST_F(LedgerOfTwo, KeepsThePlanOfWhoeverMadeIt) {
  EXPECT_EQ(**Ledger::read_plan(folder_), "the plan");
  EXPECT_FALSE(Ledger::read_plan(temp_ / "elsewhere")->has_value());
}

TEST_F(LedgerOfTwo, WhatIsGivenBackIsGoneOnWith) {
  ASSERT_TRUE(first_.give_back(claim_with_frame()).ok());
  expect_gone_on_with(second_);
}

TEST_F(LedgerOfTwo, EachBeginsAtItsOwnPlace) {
  const auto of = [&](std::size_t place) {
    const auto claim = *first_.take(kAllLive, place);
    EXPECT_TRUE(first_.give_back(*claim).ok());
    return claim->chunk;
  };
  EXPECT_EQ(of(0), "a");
  EXPECT_EQ(of(1), "b");
  EXPECT_EQ(of(7), "b");
  ASSERT_TRUE((*second_.take(kAllLive, 1)).has_value());
  EXPECT_EQ(of(1), "a") << "what is left";
}

TEST_F(LedgerOfTwo, OfOneThatIsGoneEverythingIsKeptAndOfOneThatIsSilentNothing) {
  const Ledger::Claim claim = claim_with_frame();
  ASSERT_EQ((*second_.take(kAllLive))->chunk, "b");
  EXPECT_FALSE((*second_.take(kAllLive)).has_value()) << "the first lives";
  const auto silent = *second_.take(first_is(Life::silent));
  ASSERT_TRUE(silent.has_value());
  EXPECT_EQ(silent->from, "first");
  EXPECT_FALSE(fs::exists(silent->work / "frame"));
  EXPECT_THAT(second_.losses(), testing::ElementsAre("a.first"));
  // It wakes, goes on, and is ahead of the other.
  write(claim, "rest");
  EXPECT_TRUE(*first_.finish(claim));
  EXPECT_FALSE(*second_.finish(*silent));
  EXPECT_TRUE(fs::exists(first_.result("a") / "frame"));
  EXPECT_TRUE(names_below(folder_ / "claims").size() == 1) << "of b";
}

TEST_F(LedgerOfTwo, OneThatDiesBetweenResultAndClaimHasDoneIt) {
  const auto claim = *first_.take(kAllLive);
  fs::rename(claim->work, first_.result("a"));
  ASSERT_EQ((*second_.take(first_is(Life::gone)))->chunk, "b");
  EXPECT_FALSE((*second_.take(first_is(Life::gone))).has_value());
  EXPECT_TRUE(second_.losses().empty());
  EXPECT_FALSE(fs::exists(folder_ / "claims" / "a.first"));
}

TEST_F(LedgerOfTwo, AChunkThatKillsWhoeverDoesItIsGivenUpAndMayBeTriedAgain) {
  const Ledger::LifeOf all_gone = [](const std::string&) { return Life::gone; };
  std::optional<Ledger::Claim> claim = *first_.take(all_gone);
  ASSERT_EQ((*first_.take(all_gone))->chunk, "b");
  ASSERT_TRUE(first_.finish({"b", folder_ / "work" / "b.first"}).ok());
  std::size_t died = 0;
  for (; claim && died < 10; ++died)
    claim = *Ledger(folder_, chunks_, "rank-" + std::to_string(died)).take(all_gone);
  EXPECT_EQ(died, Ledger::kMostLosses);
  EXPECT_TRUE(first_.given_up("a"));
  EXPECT_TRUE(first_.settled());
  ASSERT_TRUE(first_.reopen("a").ok());
  EXPECT_FALSE(first_.settled());
  EXPECT_TRUE(first_.losses().empty());
  EXPECT_EQ((*second_.take(all_gone))->chunk, "a");
}

TEST_F(LedgerOfTwo, AResultIsOpenedAgainWithWhatItHolds) {
  ASSERT_TRUE(*first_.finish(claim_with_frame()));
  ASSERT_TRUE(second_.reopen("a").ok());
  EXPECT_FALSE(first_.done("a"));
  expect_gone_on_with(first_);
}

TEST_F(LedgerOfTwo, TwoRunsThatOpenAResultAtOnceLoseNothingOfIt) {
  ASSERT_TRUE(*first_.finish(claim_with_frame()));
  ASSERT_TRUE(first_.reopen("a").ok());
  ASSERT_TRUE(second_.reopen("a").ok()) << "which found it done before the first opened it";
  EXPECT_TRUE(fs::is_empty(folder_ / "claims"));
  expect_gone_on_with(second_);
}

TEST_F(LedgerOfTwo, OneThatIsDoneAfterAllIsNotGivenUp) {
  const Ledger::Claim claim = claim_with_frame();
  fs::rename(folder_ / "claims" / "a.first", folder_ / "given_up" / "a");  // it was silent, as two before
  EXPECT_TRUE(second_.given_up("a"));
  EXPECT_TRUE(*first_.finish(claim));
  EXPECT_FALSE(second_.given_up("a"));
  ASSERT_TRUE(second_.reopen("a").ok());
  EXPECT_FALSE(second_.given_up("a"));
  EXPECT_FALSE(second_.settled());
}

TEST_F(LedgerOfTwo, AFolderThatCantBeWrittenToIsAnError) {
  fs::remove_all(folder_ / "work");
  std::ofstream(folder_ / "work") << "a file";
  EXPECT_EQ(first_.take(kAllLive).error().kind, ErrorKind::io);
  EXPECT_TRUE(fs::exists(folder_ / "todo" / "a")) << "the chunk is nobody's";
}

/// Whatever of the results is removed is done again, and nothing else is.
TEST(LedgerRestore, AResultThatWasRemovedIsDoneAgain) {
  const std::vector<std::string> chunks{"a", "b", "c", "d"};
  for (unsigned removed = 0; removed < 16; ++removed) {
    const TempFolder temp;
    const fs::path folder = temp / "ledger";
    ASSERT_TRUE(Ledger::create(folder, "w", "plan", chunks).ok());
    Ledger ledger(folder, chunks, "w");
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      const auto claim = ledger.take(kAllLive);
      ASSERT_TRUE(claim.ok() && *claim);
      ASSERT_TRUE(ledger.finish(**claim).ok());
    }
    ASSERT_TRUE(ledger.settled());
    std::vector<std::string> expected;
    for (std::size_t i = 0; i < chunks.size(); ++i)
      if ((removed >> i & 1U) != 0) expected.push_back(chunks[i]);
    for (const std::string& chunk : expected) fs::remove_all(ledger.result(chunk));
    if (removed == 15)  // with all folders, as in a copy without empty ones
      for (const char* part : {"todo", "claims", "work", "partial", "done", "lost", "given_up", "workers"})
        fs::remove_all(folder / part);
    EXPECT_EQ(ledger.restore_missing().value(), expected);
    EXPECT_TRUE(ledger.restore_missing().value().empty());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const auto claim = ledger.take(kAllLive);
      ASSERT_TRUE(claim.ok() && *claim);
      EXPECT_TRUE(ledger.finish(**claim).value());
    }
    EXPECT_TRUE(ledger.settled());
  }
}

}  // namespace
}  // namespace emberlock::recon
