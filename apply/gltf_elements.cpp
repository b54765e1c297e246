// SPDX-License-Identifier: Apache-2.0
#include "apply/gltf_elements.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "apply/gltf_parts.h"
#include "apply/unreadable.h"

namespace emberlock::apply {
namespace {

template <class T>
T read_as(const unsigned char* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// `count` elements of `size` bytes, `stride` apart, of a view of a buffer. Refused where they go beyond it.
const unsigned char* bytes_of(const tinygltf::Model& model, int number, std::size_t offset, std::size_t count,
                              std::size_t stride, std::size_t size, const std::string& what,
                              const std::string& where) {
  const tinygltf::BufferView& view = entry(model.bufferViews, number, "bufferView");
  const tinygltf::Buffer& buffer = entry(model.buffers, view.buffer, "buffer");
  const std::size_t all = buffer.data.size();
  if (view.byteOffset > all || view.byteLength > all - view.byteOffset || offset > view.byteLength ||
      (count > 0 && (count - 1 > (view.byteLength - offset) / stride ||
                     (count - 1) * stride + size > view.byteLength - offset)))
    refuse(what + " goes beyond its buffer", where, "The file is cut short");
  return buffer.data.data() + view.byteOffset + offset;
}

std::size_t component_size_of(int kind) {
  return static_cast<std::size_t>(
      std::max(0, tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(kind))));
}

}  // namespace

GltfElements::GltfElements(const tinygltf::Model& model, int accessor, int type, const std::string& where) {
  const tinygltf::Accessor& a = entry(model.accessors, accessor, "accessor");
  const std::string name = fmt::format("accessor {}", accessor);
  if (a.type != type) refuse(name + " is of another type", where);
  count_ = a.count;
  kind_ = a.componentType;
  normalised_ = a.normalized;
  component_size_ = component_size_of(kind_);
  const std::size_t size =
      component_size_ * static_cast<std::size_t>(
                            std::max(0, tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type))));
  if (size == 0) refuse(name + " is of no known type", where);
  stride_ = size;
  if (a.bufferView >= 0 || !a.sparse.isSparse) {
    const int stride = a.ByteStride(entry(model.bufferViews, a.bufferView, "bufferView"));
    if (stride <= 0 || static_cast<std::size_t>(stride) < size) refuse(name + " has no step", where);
    stride_ = static_cast<std::size_t>(stride);
    data_ = bytes_of(model, a.bufferView, a.byteOffset, count_, stride_, size, name, where);
  }
  if (a.sparse.isSparse) replace_sparse(model, a, size, where);
}

/// Copies the elements, zeros where they have no buffer, and puts the sparse ones in their places.
void GltfElements::replace_sparse(const tinygltf::Model& model, const tinygltf::Accessor& a, std::size_t size,
                                  const std::string& where) {
  const auto& sparse = a.sparse;
  if (count_ > 3 * kMostTriangles || sparse.count < 0 || static_cast<std::size_t>(sparse.count) > count_ ||
      sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0)
    refuse("a sparse accessor is out of range", where);
  const int kind = sparse.indices.componentType;
  if (kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    refuse("indices are of no unsigned type", where);
  const auto replaced = static_cast<std::size_t>(sparse.count);
  const std::size_t step = component_size_of(kind);
  const unsigned char* const places =
      bytes_of(model, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset),
               replaced, step, step, "a sparse accessor's index", where);
  const unsigned char* const values =
      bytes_of(model, sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), replaced,
               size, size, "a sparse accessor's value", where);
  own_.resize(count_ * size);
  for (std::size_t i = 0; data_ != nullptr && i < count_; ++i)
    std::memcpy(own_.data() + i * size, data_ + i * stride_, size);
  for (std::size_t i = 0; i < replaced; ++i) {
    const unsigned char* const from = places + i * step;
    const std::size_t place = step == 1   ? read_as<std::uint8_t>(from)
                              : step == 2 ? read_as<std::uint16_t>(from)
                                          : read_as<std::uint32_t>(from);
    if (place >= count_) refuse("a sparse accessor's index is out of range", where);
    std::memcpy(own_.data() + place * size, values + i * size, size);
  }
  data_ = own_.data();
  stride_ = size;
}

double GltfElements::at(std::size_t element, std::size_t component) const {
  const unsigned char* const from = data_ + element * stride_ + component * component_size_;
  const auto share = [this](double value, double most) {
    return normalised_ ? std::max(-1.0, value / most) : value;
  };
  switch (kind_) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return share(read_as<std::int8_t>(from), 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return share(read_as<std::uint8_t>(from), 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return share(read_as<std::int16_t>(from), 32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return share(read_as<std::uint16_t>(from), 65535);
    case TINYGLTF_COMPONENT_TYPE_INT:
      return read_as<std::int32_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return read_as<std::uint32_t>(from);
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return read_as<double>(from);
    default:
      return static_cast<double>(read_as<float>(from));
  }
}

std::vector<std::uint32_t> GltfElements::indices(const std::string& where) const {
  if (kind_ != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && kind_ != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      kind_ != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    refuse("indices are of no unsigned type", where);
  if (normalised_) refuse("indices are normalised", where);
  std::vector<std::uint32_t> out(count_);
  for (std::size_t i = 0; i < count_; ++i) out[i] = static_cast<std::uint32_t>(at(i, 0));
  return out;
}

}  // namespace emberlock::apply
