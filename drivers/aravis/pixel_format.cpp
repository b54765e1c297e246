// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/pixel_format.h"

#include <array>
#include <bit>
#include <utility>

namespace emberlock::drivers::aravis {
namespace {

constexpr std::array<std::pair<std::string_view, PixelPacking>, 17> kPackings{{
    {"Mono8", PixelPacking::gray8},
    {"Mono10", PixelPacking::gray10},
    {"Mono12", PixelPacking::gray12},
    {"Mono14", PixelPacking::gray14},
    {"Mono16", PixelPacking::gray16},
    {"Mono10p", PixelPacking::gray10_packed},
    {"Mono12p", PixelPacking::gray12_packed},
    {"Mono12Packed", PixelPacking::gray12_gev_packed},
    {"RGB8", PixelPacking::rgb8},
    {"RGB8Packed", PixelPacking::rgb8},
    {"BGR8", PixelPacking::bgr8},
    {"BGR8Packed", PixelPacking::bgr8},
    {"YUV422_8", PixelPacking::yuyv},
    {"YUV422_YUYV_Packed", PixelPacking::yuyv},
    {"YUV422_8_UYVY", PixelPacking::uyvy},
    {"YUV422Packed", PixelPacking::uyvy},
    {"YCbCr601_422_8", PixelPacking::yuyv},
}};
constexpr std::array<std::pair<std::string_view, PixelPacking>, 4> kMosaics{{
    {"8", PixelPacking::bayer8},
    {"10", PixelPacking::bayer10},
    {"12", PixelPacking::bayer12},
    {"16", PixelPacking::bayer16},
}};
constexpr std::array<std::pair<std::string_view, BayerPhase>, 4> kPhases{{
    {"BayerRG", BayerPhase::rggb},
    {"BayerGR", BayerPhase::grbg},
    {"BayerGB", BayerPhase::gbrg},
    {"BayerBG", BayerPhase::bggr},
}};

}  // namespace

std::optional<PackedPixels> packing_of(std::string_view name) {
  for (const auto& [known, packing] : kPackings) {
    if (name == known) return PackedPixels{{}, packing};
  }
  for (const auto& [prefix, phase] : kPhases) {
    if (!name.starts_with(prefix)) continue;
    for (const auto& [depth, packing] : kMosaics) {
      if (name.substr(prefix.size()) == depth) return PackedPixels{{}, packing, phase};
    }
  }
  return {};
}

bool lies_as_image(const PackedPixels& pixels) {
  switch (pixels.packing) {
    case PixelPacking::gray8:
    case PixelPacking::rgb8:
      return true;
    case PixelPacking::gray16:
      return std::endian::native == std::endian::little;
    case PixelPacking::bayer8:
      return pixels.phase == BayerPhase::rggb && pixels.size.width % 2 == 0 && pixels.size.height % 2 == 0;
    case PixelPacking::bayer16:
      return std::endian::native == std::endian::little && pixels.phase == BayerPhase::rggb &&
             pixels.size.width % 2 == 0 && pixels.size.height % 2 == 0;
    default:  // the others are reordered, or need masking
      return false;
  }
}

}  // namespace emberlock::drivers::aravis
