// SPDX-License-Identifier: Apache-2.0
#include "report/sequence_report.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "report/batch_report.h"

namespace emberlock::report {
namespace {

using testing::HasSubstr;

SequenceTold three_frames() {
  SequenceFrame first{.frame = 40,
                      .start = "darkness",
                      .decided = true,
                      .iterations = 12,
                      .loading = Seconds(0.5),
                      .reconstruction = Seconds(4),
                      .writing = Seconds(0.5),
                      .input_rmse = 3.25,
                      .heldout_rmse = 5.0625,
                      .psnr = 30,
                      .ssim = 0.9,
                      .light = 1e-3 / 3,
                      .time = Seconds(5.0 / 3)};
  SequenceFrame second{.frame = 45, .error = "no \"flame\" in <cam 3>"};
  SequenceFrame third = first;
  third.frame = 50;
  third.start = "the frame before, carried on";
  third.reconstruction = Seconds(1);
  third.heldout_rmse = 6;
  third.psnr = std::numeric_limits<double>::infinity();
  third.flicker = recon::Flicker{8, 6};
  return {128, true, 1, {first, second, third}};
}

TEST(SequenceReport, ComesBackFromItsJsonToTheBit) {
  const SequenceTold told = three_frames();
  const auto read = parse_sequence(sequence_json(told), "frames.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(sequence_json(*read), sequence_json(told));
  ASSERT_EQ(read->frames.size(), 3U);
  EXPECT_EQ(read->voxels, 128);
  EXPECT_EQ(read->frames[0].light, told.frames[0].light);
  EXPECT_EQ(read->frames[1].error, told.frames[1].error);
  EXPECT_FALSE(read->frames[2].psnr);  // what isn't finite isn't known
  EXPECT_EQ(read->frames[2].flicker->renders, 6);
}

TEST(SequenceReport, WhatIsNoneIsRefusedAndSaid) {
  for (const char* text :
       {"", "{", "[]", "{}", R"({"format": "emberlock sequence", "version": 2, "voxels": 1, "frames": []})",
        R"({"format": "emberlock sequence", "version": 1, "voxels": "many", "held_out": true, "frames": []})",
        R"({"format": "emberlock sequence", "version": 1, "voxels": 1, "held_out": true, "frames": [{}]})"}) {
    const auto read = parse_sequence(text, "out/sequence/frames.json");
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(read.error().message(), HasSubstr("out/sequence/frames.json"));
  }
}

TEST(SequenceReport, SaysWhatAllFramesReachedAndTook) {
  const std::vector<std::string> words = sequence_words(three_frames());
  EXPECT_THAT(
      words[0],
      HasSubstr("2 of 3 frames became volumes of 128 voxels along the longest edge, in 3.50 s a frame; the "
                "first took 5.00 s"));
  EXPECT_THAT(words[1], HasSubstr("5.53 grey levels on average"));
  EXPECT_THAT(words.back(),
              HasSubstr("the held-out views of the volume change 0.75 times as much as the pictures do"));
  EXPECT_THAT(sequence_words({}), testing::ElementsAre("no frame became a volume"));
}

TEST(SequenceReport, ThePageAndTheTableHoldEachFrame) {
  const std::string page = sequence_html(three_frames(), "take <2>");
  EXPECT_THAT(page, HasSubstr("take &lt;2&gt;"));
  EXPECT_THAT(page, HasSubstr("no &quot;flame&quot; in &lt;cam 3&gt;"));
  EXPECT_THAT(page, HasSubstr("the frame before, carried on"));
  const std::string csv = sequence_csv(three_frames());
  EXPECT_THAT(csv,
              HasSubstr("\n40,\"darkness\",12,0.500,4.000,0.500,3.25,5.0625,30,0.9,0.000333333,,,1.66667\n"));
  EXPECT_THAT(csv, HasSubstr("\n50,\"the frame before, carried on\",12,"));
  EXPECT_EQ(csv.find("\n45,"), std::string::npos);
}

/// Two chunks of three are done, by two ranks.
BatchTold two_chunks() {
  BatchTold told;
  told.sequence = three_frames();
  told.chunks = {{"0000040-0000050", 3, 2, 1, true, 1, "n2", "cuda", Seconds(7)},
                 {"0000055-0000060", 2, 2, 0, true, 0, "n<1>", "cpu", Seconds(4)},
                 {"0000065-0000070", 2, 0, 0, false}};
  return told;
}

TEST(BatchReport, CountsFramesChunksAndRanks) {
  BatchTold told = two_chunks();
  EXPECT_EQ(told.planned(), 7U);
  EXPECT_EQ(told.volumes(), 4U);
  EXPECT_EQ(told.failed(), 1U);
  EXPECT_THAT(batch_words(told),
              testing::ElementsAre("4 of 7 frames are volumes, 1 failed; 2 of 3 chunks are "
                                   "done, by 2 ranks"));
  told.losses = {"0000040-0000050.n3-17-4"};
  told.given_up = {"0000065-0000070"};
  EXPECT_THAT(batch_words(told)[1], HasSubstr("n3-17-4"));
  EXPECT_THAT(batch_words(told)[2], HasSubstr("given up"));
}

TEST(BatchReport, ChunksGoToWhicheverRankIsFree) {
  const std::vector<Seconds> chunks{Seconds(3), Seconds(1), Seconds(2), Seconds(4), Seconds(2)};
  EXPECT_EQ(time_on(1, chunks), Seconds(12));
  EXPECT_EQ(time_on(2, chunks), Seconds(7)) << "3 4 | 1 2 2";
  EXPECT_EQ(time_on(5, chunks), Seconds(4)) << "the longest";
  EXPECT_EQ(time_on(1000, chunks), Seconds(4));
  EXPECT_EQ(time_on(3, {}), Seconds(0));
  RandomStream random(7, 0);
  for (int i = 0; i < 200; ++i) {
    std::vector<Seconds> some(static_cast<std::size_t>(1 + i % 40));
    for (Seconds& chunk : some) chunk = Seconds(random.uniform());
    const double all = time_on(1, some).value();
    const double longest = std::max_element(some.begin(), some.end())->value();
    for (std::size_t ranks = 1; ranks < 50; ranks += 3) {
      const double time = time_on(ranks, some).value();
      const double fair = all / static_cast<double>(ranks);
      EXPECT_GE(time, std::max(fair, longest) - 1e-9);
      EXPECT_LE(time, fair + longest + 1e-9) << "nobody is idle before the last chunk is handed out";
    }
  }
}

TEST(BatchReport, OfOneThatIsDoneItSaysWhatMoreRanksWouldBuy) {
  BatchTold told = two_chunks();
  told.chunks.resize(2);
  EXPECT_EQ(batch_words(told).back(),
            "its chunks take 11 s on one rank, 7 s on 2; more ranks gain nothing, shorter chunks may");
  for (int i = 0; i < 4; ++i) told.chunks.push_back(told.chunks[1]);
  EXPECT_THAT(batch_words(told).back(), HasSubstr("27 s on one rank, 8 s on 4, 7 s on 6; more"));
  told.chunks.resize(1);
  EXPECT_EQ(batch_words(told).size(), 1U);
}

TEST(BatchReport, ThePageAndTheTableSayWhoDidWhat) {
  EXPECT_EQ(batch_csv(two_chunks()),
            "chunk,frames,volumes,failed,rank,host,device,seconds\n"
            "0000040-0000050,3,2,1,1,n2,cuda,7.000\n"
            "0000055-0000060,2,2,0,0,n<1>,cpu,4.000\n"
            "0000065-0000070,2,,,,,,\n");
  const std::string page = batch_html(two_chunks(), "take2");
  EXPECT_THAT(page, HasSubstr("Who did what"));
  EXPECT_THAT(page, HasSubstr("n&lt;1&gt;"));
  EXPECT_THAT(page, HasSubstr("Frames</h2>")) << "of a sequence's page";
}

}  // namespace
}  // namespace emberlock::report
