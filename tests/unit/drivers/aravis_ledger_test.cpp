// SPDX-License-Identifier: Apache-2.0
// How frames of GigE Vision and USB3 Vision cameras are numbered, and what becomes of each is counted.
#include <gtest/gtest.h>

#include "drivers/aravis/frame_ledger.h"
#include "drivers/aravis/pixel_format.h"

namespace emberlock::drivers::aravis {
namespace {

std::uint64_t number(FrameLedger& ledger, std::uint64_t id, FrameOutcome outcome = FrameOutcome::delivered) {
  return ledger.record(id, outcome);
}

std::uint64_t all_of(const FrameCounts& c) { return c.delivered + c.damaged + c.lost() + c.passed_over; }

TEST(FrameLedger, SixteenBitNumbersPassTheirEndWithoutAZero) {
  FrameLedger ledger;
  EXPECT_EQ(number(ledger, 65534), 0U);
  EXPECT_EQ(number(ledger, 65535), 1U);
  EXPECT_EQ(number(ledger, 1), 2U);
  EXPECT_EQ(number(ledger, 2), 3U);
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 4}));
}

TEST(FrameLedger, AGapOverTheEndOfSixteenBitsHasItsLength) {
  FrameLedger ledger;
  number(ledger, 65530);
  EXPECT_EQ(number(ledger, 5), 10U);  // 65531 .. 65535 and 1 .. 4 are missing
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 2, .camera_gap = 9}));
}

TEST(FrameLedger, WideNumbersGoOnBeyondSixteenBits) {
  FrameLedger ledger;
  number(ledger, 65535);
  EXPECT_EQ(number(ledger, 65536), 1U);
  EXPECT_EQ(number(ledger, 1'000'000'000'000), 1'000'000'000'000 - 65535);
}

TEST(FrameLedger, ACountThatBeginsAnewAddsNoGap) {
  FrameLedger ledger;
  number(ledger, 500);
  ledger.begin_anew();  // a start
  EXPECT_EQ(number(ledger, 7), 1U);
  EXPECT_EQ(number(ledger, 1), 2U);  // a power cut that nobody saw
  number(ledger, 70000);
  EXPECT_EQ(number(ledger, 12), 70002U);
  EXPECT_EQ(ledger.counts().lost(), 70000U - 2);
}

TEST(FrameLedger, FramesWithoutANumberExplainTheGapTheyLieIn) {
  FrameLedger ledger;
  number(ledger, 10);
  ledger.unnumbered(FrameOutcome::transport);
  ledger.unnumbered(FrameOutcome::resend);
  EXPECT_EQ(number(ledger, 14), 4U);  // 11 .. 13: one more than was heard of
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 2, .camera_gap = 1, .transport = 1, .resend = 1}));
}

TEST(FrameLedger, APieceAtTheEdgeOfAnUnderrunIsOfTheUnderrun) {
  FrameLedger ledger;
  number(ledger, 10);
  ledger.unnumbered(FrameOutcome::transport);
  EXPECT_EQ(ledger.record(14, FrameOutcome::delivered, FrameOutcome::underrun), 4U);
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 2, .underrun = 3}));
}

TEST(FrameLedger, TwoPiecesOfOneFrameAreOneFrame) {
  FrameLedger ledger;
  number(ledger, 10);
  ledger.unnumbered(FrameOutcome::transport);
  ledger.unnumbered(FrameOutcome::transport);
  EXPECT_EQ(number(ledger, 12), 2U);
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 2, .transport = 1}));
}

TEST(FrameLedger, FramesWithoutANumberBeforeTheFirstAndAfterTheLastCountToo) {
  FrameLedger ledger;
  ledger.unnumbered(FrameOutcome::transport);
  EXPECT_EQ(number(ledger, 3), 1U);
  ledger.unnumbered(FrameOutcome::transport);
  ledger.begin_anew();
  EXPECT_EQ(ledger.counts(), (FrameCounts{.delivered = 1, .transport = 2}));
}

TEST(FrameLedger, TheNextNumberIsTheSumOfAllCounts) {
  FrameLedger ledger;
  std::uint64_t id = 65000;
  for (int i = 0; i < 2000; ++i) {
    id = (id + static_cast<std::uint64_t>(i % 4 == 0 ? 2 : 1) - 1) % 65535 + 1;
    ledger.record(id, static_cast<FrameOutcome>(i % 7),
                  i % 3 == 0 ? FrameOutcome::underrun : FrameOutcome::camera_gap);
    if (i % 11 == 0) ledger.unnumbered(FrameOutcome::resend);
    if (i % 501 == 0) ledger.begin_anew();
    EXPECT_EQ(ledger.next_number(), all_of(ledger.counts()));
  }
}

TEST(AravisPixelFormat, NamesMeanPackings) {
  EXPECT_EQ(packing_of("Mono12Packed")->packing, PixelPacking::gray12_gev_packed);
  EXPECT_EQ(packing_of("Mono12p")->packing, PixelPacking::gray12_packed);
  EXPECT_EQ(packing_of("BayerGB12")->packing, PixelPacking::bayer12);
  EXPECT_EQ(packing_of("BayerGB12")->phase, BayerPhase::gbrg);
  for (const char* unknown : {"Mono1p", "BayerRG12p", "BayerRG10Packed", "Coord3D_ABC32f", "", "Bayer"}) {
    EXPECT_FALSE(packing_of(unknown).has_value()) << unknown;
  }
}

TEST(AravisPixelFormat, OnlyWhatAnImageHoldsBitForBitLiesAsOne) {
  const ImageSize size{4, 4};
  EXPECT_TRUE(lies_as_image({size, PixelPacking::gray8}));
  EXPECT_TRUE(lies_as_image({size, PixelPacking::bayer8, BayerPhase::rggb}));
  EXPECT_FALSE(lies_as_image({size, PixelPacking::bayer8, BayerPhase::bggr}));
  EXPECT_FALSE(lies_as_image({{4, 3}, PixelPacking::bayer8, BayerPhase::rggb}));
  EXPECT_FALSE(lies_as_image({size, PixelPacking::gray12}));  // its upper bits aren't promised to be zero
  EXPECT_FALSE(lies_as_image({size, PixelPacking::bgr8}));
}

}  // namespace
}  // namespace emberlock::drivers::aravis
