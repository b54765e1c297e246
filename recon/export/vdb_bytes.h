// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <istream>
#include <optional>
#include <string>

namespace emberlock::recon {

static_assert(std::endian::native == std::endian::little, "OpenVDB writes numbers as the machine has them");

/// Reads numbers and texts of an OpenVDB file, none longer than is allowed, up to the file's end.
class VdbBytes {
 public:
  explicit VdbBytes(std::istream& file) : file_(file) {
    file_.seekg(0, std::ios::end);
    end_ = static_cast<std::uint64_t>(std::max<std::streamoff>(file_.tellg(), 0));
    go_to(0);
  }
  template <class Number>
  std::optional<Number> number() {
    std::array<char, sizeof(Number)> bytes{};
    if (!read(bytes.data(), bytes.size())) return std::nullopt;
    Number value{};
    std::memcpy(&value, bytes.data(), bytes.size());
    return value;
  }
  /// A text behind its size.
  std::optional<std::string> text(std::uint32_t longest) {
    const auto size = number<std::uint32_t>();
    if (!size || *size > longest) return std::nullopt;
    return bytes(*size);
  }
  std::optional<std::string> bytes(std::uint64_t count) {
    if (count > left()) return std::nullopt;
    std::string bytes(count, '\0');
    if (!read(bytes.data(), bytes.size())) return std::nullopt;
    return bytes;
  }
  /// Passes over bytes behind their size.
  bool pass() {
    const auto size = number<std::uint32_t>();
    return size && pass(*size);
  }
  bool pass(std::uint64_t count) {
    constexpr std::uint64_t kBuffered = 1 << 16;  // a seek would drop what the stream has read ahead
    if (count > left()) return false;
    if (count > kBuffered) {
      go_to(at_ + count);
    } else {
      file_.ignore(static_cast<std::streamsize>(count));
      at_ += count;
    }
    return file_.good();
  }
  void go_to(std::uint64_t place) {
    at_ = place;
    file_.seekg(static_cast<std::streamoff>(place));
  }
  [[nodiscard]] std::uint64_t at() const { return at_; }
  [[nodiscard]] std::uint64_t end() const { return end_; }
  [[nodiscard]] std::uint64_t left() const { return at_ > end_ ? 0 : end_ - at_; }

 private:
  bool read(char* into, std::uint64_t count) {
    if (count > left()) return false;
    file_.read(into, static_cast<std::streamsize>(count));
    at_ += count;
    return file_.good();
  }

  std::istream& file_;
  std::uint64_t end_ = 0, at_ = 0;
};

}  // namespace emberlock::recon
