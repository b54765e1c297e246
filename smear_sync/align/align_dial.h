// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/align/align.h"

// Aligning by a strobe that somebody sets by hand. Its rate differs from the frames' by what nobody knows, so
// its flashes walk through the frames: each round measures how fast (flash_rate.h), and how far they have
// walked since they were first seen stands for the delay by which other strobes are told to move their
// flashes. What cameras differ by is free of the walk, dots are seen to follow it, and blind cameras come out
// by themselves; where the flashes stand still, somebody is asked to turn the dial a little.
namespace emberlock::smear {

/// How far the strobe's rate may lie from one flash a frame, as a part of it: a frame that is stamped or
/// counted one off moves its phase by as much of a period, which shall be a tenth of the tolerance at most;
/// and 1 / 200, at which one frame in 200 shows two flashes or none. Two of the dial's steps in any case.
double followed_at_most(const AlignOptions& options);

/// The round by the cameras that are believed. One whose dots alone tell another walk than most others' is
/// doubted: it is read the other way, or its dot is a reflection; and by doubted ones alone no rate is told.
AlignRound weigh_flashes(AlignState& state, const AlignRound& round, const AlignOptions& options);

/// What is asked of the dial, by what the round's frames tell of it.
DialAdvice look_at_dial(AlignState& state, const AlignRound& round, const AlignOptions& options);

/// A round in which nothing was learnt but that the dial must be turned: it counts for nothing.
AlignStep wait_for_dial(AlignState state, const AlignRound& round, DialAdvice advice);

/// The round as a strobe would show it that isn't off, and was moved by as much as the flashes have walked.
/// One camera alone tells how far that is, but isn't judged by it; where cameras contradict each other, and
/// no others decide, all of them are doubted.
AlignRound without_walk(AlignState& state, const AlignRound& round, const AlignOptions& options);

/// Where a step wants the flashes elsewhere, they walk there by themselves; if they stand still, the dial is
/// to be turned.
void let_walk(AlignStep& step, const AlignRound& seen, DialAdvice advice, const AlignOptions& options);

}  // namespace emberlock::smear
