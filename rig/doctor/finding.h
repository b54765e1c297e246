// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <variant>

#include "base/quantity.h"

// What may be found of a machine, as codes: one list a matter. words.h says them.
namespace emberlock::rig::doctor {

enum class Health {
  ok,
  warn,  ///< it works, less well than it could
  fail,  ///< it won't work
};
std::string_view name(Health health);

enum class GroupFinding { root, no_group, member, joined_later, outsider, last = outsider };
enum class RulesFinding { installed, missing, last = missing };
enum class CameraFinding { driver_failed, locked, none, some, last = some };
enum class StrobeFinding { none, simulated, serial, replayed, by_hand, last = by_hand };
enum class HolderFinding { nobody, ours, others, last = others };
enum class MeddlerFinding { none, kept_off, at_large, last = at_large };
enum class LimitFinding { enough_files, few_files, last = few_files };
enum class UsbFinding { no_usb, enough_memory, little_memory, last = little_memory };
enum class NetworkFinding { no_camera, large_packets, small_packets, last = small_packets };
enum class BufferFinding { enough, small, last = small };
enum class SpaceFinding {
  unwritable,
  below_floor,
  unknown_time,  ///< nobody knows what the cameras will send
  short_time,
  long_time,
  last = long_time,
};
enum class SpeedFinding {
  not_measured,
  unknown_need,
  too_slow,
  little_to_spare,
  enough,
  last = enough,
};
enum class ClockFinding { synchronized, adrift, last = adrift };
enum class GovernorFinding { none, quick, slow, last = slow };
enum class ConfigFinding { no_file, valid, wrong, last = wrong };
enum class DaemonFinding { answers, nobody_there, refused, last = refused };
enum class CudaFinding { not_built, ready, closed, last = closed };

/// In the order in which one would mend things.
using FindingCode =
    std::variant<GroupFinding, RulesFinding, CameraFinding, StrobeFinding, HolderFinding, MeddlerFinding,
                 LimitFinding, UsbFinding, NetworkFinding, BufferFinding, SpaceFinding, SpeedFinding,
                 ClockFinding, GovernorFinding, ConfigFinding, DaemonFinding, CudaFinding>;

/// What a machine's facts come to in one matter. Names and measured numbers are the facts' own.
struct Finding {
  FindingCode code;
  Health health = Health::ok;
  std::size_t which = 0;    ///< of HolderFinding::others and links: its place among the facts' own
  std::uint64_t files = 0;  ///< of LimitFinding::few_files: as many shall be open at once
  int megabytes = 0;        ///< of UsbFinding::little_memory: as many are needed
  Seconds recording{};      ///< of SpaceFinding::short_time and long_time: raw, until the floor is reached
};

}  // namespace emberlock::rig::doctor
