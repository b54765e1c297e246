// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>

#include "drivers/ptp/chdk.h"
#include "drivers/ptp/live_view.h"
#include "drivers/virtual/virtual_clock.h"
#include "tests/fuzz/target.h"

namespace emberlock {
namespace {

/// Sends what the fuzzer made up, cut into pieces: each as long as its first two bytes say, or as was asked
/// for.
class MadeUp final : public drivers::PtpTransport {
 public:
  explicit MadeUp(std::span<const std::byte> bytes) : left_(bytes) {}
  [[nodiscard]] std::size_t packet_bytes() const override { return 64; }
  Status send(std::span<const std::byte> /*transfer*/, Seconds /*deadline*/) override { return {}; }
  Result<drivers::PtpPiece> receive(std::size_t most, Seconds /*deadline*/) override {
    if (left_.size() < 2) return Error{ErrorKind::device, "it is unplugged"};
    const std::size_t length = std::to_integer<std::size_t>(left_[0]) | std::to_integer<std::size_t>(left_[1])
                                                                            << 8;
    const std::size_t size = std::min({length, most, left_.size() - 2});
    const drivers::PtpPiece piece{left_.subspan(2, size), size < most ? drivers::PtpPieceEnd::short_packet
                                                                      : drivers::PtpPieceEnd::more};
    left_ = left_.subspan(2 + size);
    return piece;
  }
  Status recover(std::uint32_t /*transaction*/) override { return {}; }

 private:
  std::span<const std::byte> left_;
};

void look_at(std::span<const std::byte> bytes) {
  const auto view = drivers::parse_live_view(bytes);
  if (!view.ok() || !*view) return;
  const ImageSize size = (*view)->size;
  if ((*view)->bytes.size() < static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height))
    std::abort();
  const Image gray = drivers::image_of(**view, PixelFormat::gray8);
  const Image rgb = drivers::image_of(**view, PixelFormat::rgb8);
  if (rgb.bytes().size() != 3 * gray.bytes().size()) std::abort();
}

void talk(std::span<const std::byte> bytes) {
  drivers::PtpSession session(std::make_unique<MadeUp>(bytes), "camera",
                              std::make_shared<drivers::VirtualClock>());
  if (!session.open().ok()) return;
  drivers::Chdk chdk(session);
  (void)chdk.version();
  (void)chdk.run("return get_mode()");
  (void)chdk.read_message();
  if (chdk.ask_for_live_view().ok()) {
    const auto answer = session.finish(Seconds(1));
    if (answer.ok()) look_at(answer->data);
  }
}

}  // namespace
}  // namespace emberlock

// Whatever a camera answers to CHDK's questions: an error or values, and pictures that lie within what was
// sent. The first byte chooses between a picture alone and a whole conversation.
FUZZ_TARGET(chdk_answer) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  data[0] % 2 == 0 ? emberlock::look_at(bytes) : emberlock::talk(bytes);
  return 0;
}
