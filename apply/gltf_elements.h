// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <tiny_gltf.h>

namespace emberlock::apply {

/// The elements of an accessor, wherever they lie in its buffer: sparse ones (glTF 2.0, 3.6.2.3) and
/// quantised ones (KHR_mesh_quantization) too. What can't be read is refused (unreadable.h).
class GltfElements {
 public:
  /// `type`: the one that is expected, such as TINYGLTF_TYPE_VEC3. `where` is named in errors.
  GltfElements(const tinygltf::Model& model, int accessor, int type, const std::string& where);
  GltfElements(GltfElements&&) noexcept = default;  // a copy's elements would be the original's
  GltfElements& operator=(GltfElements&&) noexcept = default;

  [[nodiscard]] std::size_t size() const { return count_; }
  /// A component of an element; of a normalised integer its share, 0..1 or -1..1.
  [[nodiscard]] double at(std::size_t element, std::size_t component) const;
  /// The elements as unsigned integers. Refused where they are of another type.
  [[nodiscard]] std::vector<std::uint32_t> indices(const std::string& where) const;

 private:
  void replace_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor, std::size_t size,
                      const std::string& where);

  const unsigned char* data_ = nullptr;
  std::size_t stride_ = 0, count_ = 0, component_size_ = 0;
  int kind_ = 0;
  bool normalised_ = false;
  std::vector<unsigned char> own_;  // of a sparse accessor
};

}  // namespace emberlock::apply
