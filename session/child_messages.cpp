// SPDX-License-Identifier: Apache-2.0
#include "session/child_messages.h"

#include <cstdint>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/util/delimited_message_util.h>

namespace emberlock::session {
namespace {

constexpr std::size_t kLongestPrefix = 4;  // bytes; 28 bits cover every length that is accepted

struct Prefix {
  std::size_t length = 0;
  std::size_t bytes = 0;
};

/// nullopt while the prefix is incomplete.
Result<std::optional<Prefix>> read_prefix(std::string_view bytes) {
  Prefix prefix;
  for (const char c : bytes) {
    const auto byte = static_cast<std::uint8_t>(c);
    prefix.length |= static_cast<std::size_t>(byte & 0x7F) << (7 * prefix.bytes++);
    if (prefix.length > kLargestChildMessage) {
      return Error{ErrorKind::bad_input, fmt::format("a message of over {} bytes", kLargestChildMessage)};
    }
    if ((byte & 0x80) == 0) return std::optional(prefix);
    if (prefix.bytes == kLongestPrefix) return Error{ErrorKind::bad_input, "a length that is none"};
  }
  return std::optional<Prefix>();
}

}  // namespace

std::string framed(const google::protobuf::MessageLite& message) {
  std::ostringstream out;
  google::protobuf::util::SerializeDelimitedToOstream(message, &out);
  return std::move(out).str();
}

template <class Message>
Status MessageParser<Message>::add(std::string_view bytes, const std::function<void(Message&&)>& take) {
  held_.append(bytes);
  std::size_t done = 0;
  for (;;) {
    const std::string_view rest = std::string_view(held_).substr(done);
    EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<Prefix> prefix, read_prefix(rest));
    if (!prefix || rest.size() - prefix->bytes < prefix->length) break;
    Message message;
    if (!message.ParseFromArray(rest.data() + prefix->bytes, static_cast<int>(prefix->length)))
      return Error{ErrorKind::bad_input, "bytes that are no message"};
    take(std::move(message));
    done += prefix->bytes + prefix->length;
  }
  held_.erase(0, done);
  return {};
}

template class MessageParser<v1::ChildMessage>;
template class MessageParser<v1::EditRequest>;
template class MessageParser<v1::LiveInput>;

}  // namespace emberlock::session
