// SPDX-License-Identifier: Apache-2.0
// After OpenVDB 10.0's io/Archive.cc (writeGrid), tree/RootNode.h, InternalNode.h, LeafNode.h
// (readTopology, readBuffers), io/Compression.h (readCompressedValues) and io/DelayedLoadMetadata.cc.
#include "recon/export/vdb_layout.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "recon/export/vdb_bytes.h"
#include "recon/export/vdb_header.h"

namespace emberlock::recon {
namespace {

constexpr std::uint32_t kFormat = 224;
constexpr std::uint32_t kMostNamedBytes = 1024;  // of a name or a type
constexpr std::uint32_t kMostEntries = 4096;     // of metadata
constexpr std::int32_t kMostGrids = 64;
/// A grid of so many voxels may be empty. A larger one is filled to a thousandth at least, and each 512
/// voxels of a leaf take 128 bytes for its masks.
constexpr std::uint64_t kLargestEmptyGrid = std::uint64_t{1} << 23;
constexpr std::uint64_t kMostVoxelsAByte = 1000;

constexpr std::uint32_t kZip = 1, kActiveMask = 2, kBlosc = 4;

/// Bytes of the metadata of each type that is written.
const std::map<std::string_view, std::uint32_t> kSizesOfTypes{
    {"bool", 1}, {"int32", 4}, {"int64", 8}, {"float", 4}, {"double", 8}, {"vec3i", 12}, {"vec3d", 24}};
const std::map<std::string_view, std::uint32_t> kSizesOfMaps{{"UniformScaleMap", 120},
                                                             {"ScaleMap", 120},
                                                             {"UniformScaleTranslateMap", 144},
                                                             {"ScaleTranslateMap", 144}};
const std::map<std::string_view, std::uint32_t> kSizesOfValues{{"Tree_float_5_4_3", 4},
                                                               {"Tree_vec3s_5_4_3", 12}};

std::optional<std::uint32_t> size_in(const std::map<std::string_view, std::uint32_t>& table,
                                     std::string_view key) {
  const auto found = table.find(key);
  if (found == table.end()) return std::nullopt;
  return found->second;
}

std::uint64_t count_on(std::string_view mask) {
  std::uint64_t on = 0;
  for (const char byte : mask)
    on += static_cast<std::uint64_t>(std::popcount(static_cast<unsigned char>(byte)));
  return on;
}

/// Walks through a file as OpenVDB reads it. Each function returns false where something doesn't agree.
class VdbLayout {
 public:
  explicit VdbLayout(std::istream& file) : file_(file) {}

  bool holds() {
    file_.go_to(kVdbMagic.size());
    const auto format = file_.number<std::uint32_t>();
    file_.go_to(kVdbFirstMetadatum);
    if (format != kFormat || !metadata()) return false;
    const auto grids = file_.number<std::int32_t>();
    if (!grids || *grids < 0 || *grids > kMostGrids) return false;
    for (std::int32_t i = 0; i < *grids; ++i)
      if (!grid()) return false;
    return true;
  }
  [[nodiscard]] bool too_many_voxels() const { return too_many_voxels_; }

 private:
  bool metadata() {
    const auto count = file_.number<std::uint32_t>();
    if (!count || *count > kMostEntries) return false;
    for (std::uint32_t i = 0; i < *count; ++i) {
      const auto name = file_.text(kMostNamedBytes);
      const auto type = file_.text(kMostNamedBytes);
      if (!name || !type || *name == "is_saved_as_half_float") return false;
      if (!metadatum(*name, *type)) return false;
    }
    return true;
  }

  bool metadatum(std::string_view name, std::string_view type) {
    const auto size = file_.number<std::uint32_t>();
    if (!size || *size > file_.left()) return false;
    const std::uint64_t end = file_.at() + *size;
    if (name == "emberlock_dimensions" && type == "vec3i") return *size == 12 && dimensions();
    if (type == "__delayedload") return *size == 0 || (leaf_sizes() && file_.at() == end);
    return (type == "string" || size_in(kSizesOfTypes, type) == *size) && file_.pass(*size);
  }

  bool dimensions() {
    const auto n = file_.number<std::array<std::int32_t, 3>>();
    if (!n) return false;
    const std::uint64_t most = kLargestEmptyGrid + kMostVoxelsAByte * file_.end();
    std::uint64_t voxels = 1;
    for (const std::int32_t along : *n) {
      if (along < 0) return true;  // is refused where it is read
      voxels = along == 0 ? 0 : voxels * static_cast<std::uint64_t>(along);
      too_many_voxels_ = too_many_voxels_ || voxels > most;
      if (too_many_voxels_) return false;
    }
    return true;
  }

  /// Of each leaf, a byte and the size of its block.
  bool leaf_sizes() {
    const auto leaves = file_.number<std::uint32_t>();
    constexpr std::uint64_t kLeastOfLeaf = 128;
    if (!leaves || *leaves > file_.end() / kLeastOfLeaf) return false;
    for (const std::uint64_t each : {1, 8}) {
      const auto packed = file_.number<std::uint32_t>();
      if (!packed) return false;
      if (each == 8 && *packed == UINT32_MAX) return true;
      constexpr std::uint64_t kPadded = 128;  // OpenVDB pads what is shorter
      if (*packed == 0 ? !file_.pass(each * *leaves) : !blosc(*packed, std::max(kPadded, each * *leaves)))
        return false;
    }
    return true;
  }

  /// Passes over a block of Blosc's, which states its own sizes: 16 bytes of header.
  bool blosc(std::uint64_t packed, std::uint64_t most) {
    struct Header {
      std::uint32_t versions, bytes, block, packed;
    };
    if (packed < sizeof(Header) || packed > file_.left()) return false;
    const auto header = file_.number<Header>();
    return header && header->packed == packed && header->bytes <= most &&
           header->block <= std::max(1U, header->bytes) && file_.pass(packed - sizeof(Header));
  }

  bool grid() {
    const auto name = file_.text(kMostNamedBytes);
    const auto type = file_.text(kMostNamedBytes);
    const auto parent = file_.text(kMostNamedBytes);
    const auto begin = file_.number<std::int64_t>();
    const auto blocks = file_.number<std::int64_t>();
    const auto end = file_.number<std::int64_t>();
    if (!name || !type || parent != "" || !end || !is_here(*begin)) return false;
    const auto value = size_in(kSizesOfValues, *type);
    const auto compression = file_.number<std::uint32_t>();
    if (!value || !compression || *compression > (kZip | kActiveMask | kBlosc)) return false;
    value_ = *value;
    compression_ = *compression;
    return metadata() && map() && tree() && is_here(*blocks) && leaves() && is_here(*end);
  }

  [[nodiscard]] bool is_here(std::int64_t place) const {
    return place >= 0 && static_cast<std::uint64_t>(place) == file_.at();
  }

  bool map() {
    const auto type = file_.text(kMostNamedBytes);
    const auto size = type ? size_in(kSizesOfMaps, *type) : std::nullopt;
    return size && file_.pass(*size);
  }

  bool tree() {
    masks_.clear();
    const auto buffers = file_.number<std::int32_t>();
    if (buffers != 1 || !file_.pass(value_)) return false;
    const auto tiles = file_.number<std::uint32_t>();
    const auto children = file_.number<std::uint32_t>();
    if (tiles != 0U || !children || *children > 1) return false;
    if (*children == 0) return true;
    using Place = std::array<std::int32_t, 3>;
    return file_.number<Place>() == Place{0, 0, 0} && node(5);
  }

  /// A node of 2^(3 log2) children that are nodes or leaves, none of them an active tile.
  bool node(int log2) {
    const std::uint64_t values = std::uint64_t{1} << (3 * log2);
    const auto children = file_.bytes(values / 8);
    const auto active = file_.bytes(values / 8);
    if (!children || !active || count_on(*active) != 0 || !block(values, 0)) return false;
    for (std::uint64_t left = count_on(*children); left > 0; --left)
      if (!(log2 == 5 ? node(4) : leaf())) return false;
    return true;
  }

  bool leaf() {
    const auto mask = file_.number<Mask>();
    if (mask) masks_.push_back(*mask);
    return mask.has_value();
  }

  bool leaves() {
    return std::all_of(masks_.begin(), masks_.end(), [this](const Mask& mask) {
      return file_.number<Mask>() == mask && block(512, count_on({mask.data(), mask.size()}));
    });
  }

  /// Passes over the values of a node or leaf, of which so many are active.
  bool block(std::uint64_t values, std::uint64_t active) {
    const auto kind = file_.number<std::uint8_t>();
    constexpr std::uint8_t kAllValues = 6;
    if (!kind || *kind > kAllValues) return false;
    const std::uint64_t inactive = *kind == 2 || *kind == 4 ? 1 : *kind == 5 ? 2 : 0;
    const bool selects = *kind >= 3 && *kind <= 5;
    if (!file_.pass(inactive * value_ + (selects ? values / 8 : 0))) return false;
    const bool only_active = (compression_ & kActiveMask) != 0 && *kind != kAllValues;
    const std::uint64_t bytes = value_ * (only_active ? active : values);
    if ((compression_ & (kZip | kBlosc)) == 0) return file_.pass(bytes);
    const auto packed = file_.number<std::int64_t>();
    if (!packed) return false;
    if (*packed <= 0) return *packed == -static_cast<std::int64_t>(bytes) && file_.pass(bytes);
    const auto size = static_cast<std::uint64_t>(*packed);
    return (compression_ & kBlosc) != 0 ? blosc(size, bytes) : file_.pass(size);
  }

  using Mask = std::array<char, 64>;

  VdbBytes file_;
  std::uint64_t value_ = 0;  // bytes of one
  std::uint32_t compression_ = 0;
  std::vector<Mask> masks_;  // of the grid's leaves
  bool too_many_voxels_ = false;
};

}  // namespace

Status check_vdb_layout(std::istream& file, const std::string& where) {
  VdbLayout layout(file);
  if (layout.holds()) return {};
  return Error{ErrorKind::bad_input,
               layout.too_many_voxels() ? "states more voxels than a file of its size has"
                                        : "isn't laid out as Emberlock writes volumes",
               where, "Name a volume.vdb that `emberlock reconstruct` wrote"};
}

}  // namespace emberlock::recon
