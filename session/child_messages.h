// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/child.pb.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::session {

/// The largest accepted message of a child process, or to one. Two pictures and 64^3 voxels with four layers
/// take a third of it.
inline constexpr std::size_t kLargestChildMessage = std::size_t{4} << 20;

/// The message, preceded by its length as a varint.
std::string framed(const google::protobuf::MessageLite& message);

/// Splits the bytes of a pipe into messages. The bytes may arrive in pieces of any size.
template <class Message>
class MessageParser {
 public:
  /// Appends bytes and calls `take` with each message that is now complete. An Error when the bytes aren't in
  /// this format; the rest of the stream can't be read then.
  Status add(std::string_view bytes, const std::function<void(Message&&)>& take);

 private:
  std::string held_;
};
using ChildMessageParser = MessageParser<v1::ChildMessage>;
using EditRequestParser = MessageParser<v1::EditRequest>;
using LiveInputParser = MessageParser<v1::LiveInput>;
extern template class MessageParser<v1::ChildMessage>;
extern template class MessageParser<v1::EditRequest>;
extern template class MessageParser<v1::LiveInput>;

}  // namespace emberlock::session
