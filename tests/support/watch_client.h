// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tests/support/http_client.h"

namespace emberlock::test {

/// A console, as far as the server can tell: a WebSocket that sees every message that comes, or never reads
/// at all.
class WatchClient {
 public:
  struct Message {
    int opcode = 0;  ///< 1: text, 2: binary, 8: close, 9: ping
    std::string bytes;
  };

  explicit WatchClient(int port, const std::string& headers = kLetIn) : socket_(connect_to(port)) {
    send_all(socket_, "GET /api/v1/watch HTTP/1.1\r\n" + headers +
                          "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    while (answer_.find("\r\n\r\n") == std::string::npos) {
      char byte = 0;
      if (::recv(socket_.get(), &byte, 1, 0) != 1) return;
      answer_ += byte;
    }
  }
  [[nodiscard]] bool open() const { return answer_.starts_with("HTTP/1.1 101"); }
  [[nodiscard]] const std::string& answer() const { return answer_; }
  [[nodiscard]] int descriptor() const { return socket_.get(); }

  void say(std::string_view text, int opcode = 1) {
    constexpr std::array<char, 4> kMask{'\x11', '\x22', '\x33', '\x44'};
    std::string frame(1, static_cast<char>(0x80 | opcode));
    if (text.size() < 126) {
      frame += static_cast<char>(0x80 | text.size());
    } else {
      frame += static_cast<char>(0xff);
      for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>(text.size() >> shift & 0xff);
    }
    frame.append(kMask.data(), kMask.size());
    for (std::size_t i = 0; i < text.size(); ++i) frame += static_cast<char>(text[i] ^ kMask[i % 4]);
    send_all(socket_, frame);
  }

  /// Says it, and waits until the server has heard it: a ping's answer comes after that. What comes until
  /// then is passed over.
  bool wish(std::string_view text) {
    say(text);
    say("", 9);
    auto message = hear();
    while (message && message->opcode != 10) message = hear();
    return message.has_value();
  }

  /// The next message; absent: the server ended, or, without waiting, there is none yet.
  std::optional<Message> hear() { return hear(0); }
  std::optional<Message> hear_now() { return hear(MSG_DONTWAIT); }

 private:
  std::optional<Message> hear(int flags) {
    while (true) {
      if (auto message = take()) {
        if (message->opcode == 8) say("", 8);  // as the protocol wants it
        return message;
      }
      std::array<char, 65536> bytes{};
      const ssize_t got = ::recv(socket_.get(), bytes.data(), bytes.size(), flags);
      if (got <= 0) return std::nullopt;
      heard_.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }
  /// A whole message of those bytes that came; the server masks and cuts none.
  std::optional<Message> take() {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(heard_[i]); };
    if (heard_.size() < 2) return std::nullopt;
    std::uint64_t size = byte(1);
    std::size_t head = 2;
    if (size >= 126) {
      const std::size_t digits = size == 126 ? 2 : 8;
      if (heard_.size() < head + digits) return std::nullopt;
      size = 0;
      for (std::size_t i = 0; i < digits; ++i) size = size << 8 | byte(head + i);
      head += digits;
    }
    if (heard_.size() < head + size) return std::nullopt;
    Message message{byte(0) & 0xf, heard_.substr(head, size)};
    heard_.erase(0, head + size);
    return message;
  }

  UniqueFd socket_;
  std::string answer_;
  std::string heard_;
};

}  // namespace emberlock::test
