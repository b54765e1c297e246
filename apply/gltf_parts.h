// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include "apply/gltf_file.h"
#include "apply/unreadable.h"

namespace emberlock::apply {

// What the reader of glTF files takes from parts of one. What can't be used is refused (unreadable.h).

template <class T>
const T& entry(const std::vector<T>& all, int index, const std::string& what) {
  if (index < 0 || static_cast<std::size_t>(index) >= all.size())
    refuse(fmt::format("{} {} isn't there", what, index), what);
  return all[static_cast<std::size_t>(index)];
}

/// Whether the reader takes what an extension of glTF adds, or the extension changes no picture.
bool is_heeded(const std::string& extension);
/// One sentence for each other extension that a file lists or uses, by its name. `json`: the file's.
std::set<std::string> extensions_left_out(std::string_view json);

/// Its factors; the texture is left to texture_of().
Material material_of(const tinygltf::Material& from, const std::string& where);

/// The picture of a texture, whose file's bytes the loader kept. `texels`: how many others took, to which it
/// adds.
Texture texture_of(const tinygltf::Model& model, int index, std::size_t& texels);

}  // namespace emberlock::apply
