#include "smear_sync/reading.h"

namespace emberlock {

std::string_view name(SmearState state) {
  switch (state) {
    case SmearState::dot:
      return "dot";
    case SmearState::no_dot:
      return "no_dot";
    case SmearState::comb:
      return "comb";
    case SmearState::steady:
      return "steady";
    case SmearState::saturated:
      return "saturated";
    case SmearState::blind:
      return "blind";
    case SmearState::ambiguous:
      return "ambiguous";
    case SmearState::no_lamp:
      return "no_lamp";
  }
  return "unknown";
}

std::string_view name(Side side) { return side == Side::above ? "above" : "below"; }

}  // namespace emberlock
