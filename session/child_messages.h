// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/child.pb.h"

namespace emberlock::session {

/// A child that sends more in one message is not understood. Two pictures and 64^3 voxels take a tenth.
inline constexpr std::size_t kLargestChildMessage = std::size_t{4} << 20;

/// The message behind its length as a varint.
std::string framed(const v1::ChildMessage& message);

/// Makes messages of the bytes of a pipe, in whatever pieces they come.
class ChildMessageParser {
 public:
  /// Calls `take` with each message that is whole now. An Error when the bytes are none of ours; nothing that
  /// follows can be understood then.
  Status add(std::string_view bytes, const std::function<void(v1::ChildMessage&&)>& take);

 private:
  std::string held_;
};

}  // namespace emberlock::session
