// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/jpeg.h"

#include <memory>

#include <turbojpeg.h>

namespace emberlock::drivers {

DecodedJpeg decode_jpeg(std::span<const std::byte> bytes, ImageSize size) {
  DecodedJpeg decoded{Image(ImageLayout{size, PixelFormat::rgb8, 8}), FrameStatus::damaged};
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  const auto* const from = reinterpret_cast<const unsigned char*>(bytes.data());
  ImageSize sent;
  int subsampling = 0;
  int colours = 0;
  if (!decoder ||
      tjDecompressHeader3(decoder.get(), from, bytes.size(), &sent.width, &sent.height, &subsampling,
                          &colours) != 0 ||
      sent != size) {
    return decoded;
  }
  // Warnings count as failures: libjpeg replaces corrupt data and only warns.
  if (tjDecompress2(decoder.get(), from, bytes.size(), decoded.image.row_as<unsigned char>(0), size.width, 0,
                    size.height, TJPF_RGB, TJFLAG_ACCURATEDCT) == 0) {
    decoded.status = FrameStatus::complete;
  }
  return decoded;
}

}  // namespace emberlock::drivers
