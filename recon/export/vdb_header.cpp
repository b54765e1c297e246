// SPDX-License-Identifier: Apache-2.0
#include "recon/export/vdb_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

namespace emberlock::recon {
namespace {

constexpr std::uint32_t kLongestName = 1024;
constexpr std::uint32_t kLongestText = std::uint32_t{64} << 20;
constexpr std::uint32_t kMostMetadata = 4096;

static_assert(std::endian::native == std::endian::little, "OpenVDB writes numbers as the machine has them");

/// Reads sizes and texts, none longer than is allowed, up to the file's end.
class HeaderReader {
 public:
  explicit HeaderReader(std::istream& file) : file_(file) {
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
    if (!size || *size > longest || *size > end_ - at_) return std::nullopt;
    std::string text(*size, '\0');
    if (!read(text.data(), text.size())) return std::nullopt;
    return text;
  }
  /// Passes over bytes behind their size.
  bool pass() {
    const auto size = number<std::uint32_t>();
    if (!size || *size > end_ - at_) return false;
    go_to(at_ + *size);
    return true;
  }
  void go_to(std::uint64_t place) {
    at_ = place;
    file_.seekg(static_cast<std::streamoff>(place));
  }
  [[nodiscard]] std::uint64_t at() const { return at_; }

 private:
  bool read(char* into, std::size_t count) {
    if (at_ > end_ || count > end_ - at_) return false;
    file_.read(into, static_cast<std::streamsize>(count));
    at_ += count;
    return file_.good();
  }

  std::istream& file_;
  std::uint64_t end_ = 0, at_ = 0;
};

Error bad_header(std::string what, const std::string& where) {
  return {ErrorKind::bad_input, std::move(what), where,
          "Name a volume.vdb that `emberlock reconstruct` wrote"};
}

}  // namespace

Result<std::optional<VdbText>> find_vdb_text(std::istream& file, std::string_view key,
                                             const std::string& where) {
  HeaderReader header(file);
  std::array<char, kVdbMagic.size()> magic{};
  std::copy(kVdbMagic.begin(), kVdbMagic.end(), magic.begin());
  if (header.number<std::array<char, 8>>() != magic) return bad_header("isn't an OpenVDB file", where);
  header.go_to(kVdbFirstMetadatum);
  const auto count = header.number<std::uint32_t>();
  if (!count) return bad_header("is cut short in its header", where);
  if (*count > kMostMetadata) return bad_header("has a damaged header", where);
  std::optional<VdbText> found;
  for (std::uint32_t i = 0; i < *count; ++i) {
    const auto name = header.text(kLongestName);
    const auto type = header.text(kLongestName);
    if (!name || !type) return bad_header("is cut short in its header, or that is damaged", where);
    if (*name != key) {
      if (!header.pass()) return bad_header("is cut short in its header, or that is damaged", where);
      continue;
    }
    if (found) return bad_header("has " + *name + " twice", where);
    if (*type != "string") return bad_header("has a damaged " + *name, where);
    const std::uint64_t place = header.at() + sizeof(std::uint32_t);
    auto text = header.text(kLongestText);
    if (!text) return bad_header("is cut short in its " + *name, where);
    found = VdbText{place, std::move(*text)};
  }
  return found;
}

}  // namespace emberlock::recon
