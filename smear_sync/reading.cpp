// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/reading.h"

#include "base/one_to_one.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<SmearState, std::string_view, 8> kStateNames{{{{SmearState::dot, "dot"},
                                                                  {SmearState::no_dot, "no_dot"},
                                                                  {SmearState::comb, "comb"},
                                                                  {SmearState::steady, "steady"},
                                                                  {SmearState::saturated, "saturated"},
                                                                  {SmearState::blind, "blind"},
                                                                  {SmearState::ambiguous, "ambiguous"},
                                                                  {SmearState::no_lamp, "no_lamp"}}}};

}  // namespace

std::string_view name(SmearState state) { return kStateNames.second_of(state).value_or("unknown"); }

std::string_view name(Side side) { return side == Side::above ? "above" : "below"; }

}  // namespace emberlock::smear
