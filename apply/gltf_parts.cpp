// SPDX-License-Identifier: Apache-2.0
#include "apply/gltf_parts.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "session/media/frame_decoders.h"
#include "session/text.h"

namespace emberlock::apply {
namespace {

constexpr float kWhiteLevel = 255;

/// Eight bits a channel, interleaved.
std::vector<std::uint8_t> levels_of(const ImageView& picture) {
  const int channels_there = channels(picture.layout.format);
  const int shift = picture.layout.bit_depth - 8;
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * static_cast<std::size_t>(picture.width()) * static_cast<std::size_t>(picture.height()));
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      for (int c = 0; c < 3; ++c)
        rgb.push_back(
            static_cast<std::uint8_t>(picture.sample(x, y, std::min(c, channels_there - 1)) >> shift));
  return rgb;
}

Wrap wrap_of(int gltf) {
  if (gltf == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp;
  return gltf == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror : Wrap::repeat;
}

/// The names of `extensions` of any object.
void add_used(const nlohmann::json& json, std::set<std::string>& names) {
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object() && key == "extras") continue;
    if (json.is_object() && key == "extensions" && value.is_object())
      for (const auto& [name, content] : value.items()) names.insert(name);
    add_used(value, names);
  }
}

}  // namespace

bool is_heeded(const std::string& extension) {
  // Lights and transforms of textures have notes of their own; XMP is metadata.
  static const std::set<std::string> kHeeded{"KHR_materials_emissive_strength",
                                             "KHR_lights_punctual",
                                             "KHR_texture_transform",
                                             "KHR_mesh_quantization",
                                             "KHR_xmp",
                                             "KHR_xmp_json_ld"};
  return kHeeded.contains(extension);
}

std::set<std::string> extensions_left_out(std::string_view text) {
  std::set<std::string> names, notes;
  const auto json = nlohmann::json::parse(text, nullptr, false);
  add_used(json, names);
  if (json.is_object() && json.contains("extensionsUsed"))
    for (const auto& name : json["extensionsUsed"])
      if (name.is_string()) names.insert(name.get<std::string>());
  for (const std::string& name : names)
    if (!is_heeded(name)) notes.insert("the extension " + session::printable(name) + " is left out");
  return notes;
}

Material material_of(const tinygltf::Material& from, const std::string& where) {
  Material out;
  double strength = 1;
  if (const auto at = from.extensions.find("KHR_materials_emissive_strength"); at != from.extensions.end())
    if (at->second.Has("emissiveStrength")) strength = at->second.Get("emissiveStrength").GetNumberAsDouble();
  const auto within = [&](double v, double most) {
    if (!(v >= 0 && v <= most)) refuse("a colour is out of range", where);
    return static_cast<float>(v);
  };
  const auto& base = from.pbrMetallicRoughness.baseColorFactor;
  for (std::size_t c = 0; c < 3; ++c) {
    if (c < base.size()) out.albedo[c] = within(base[c], 1);
    if (c < from.emissiveFactor.size())
      out.emitted[c] = kWhiteLevel * within(strength * from.emissiveFactor[c], 1e6);
  }
  return out;
}

Texture texture_of(const tinygltf::Model& model, int index, std::size_t& texels) {
  const tinygltf::Texture& from = entry(model.textures, index, "texture");
  const tinygltf::Image& file = entry(model.images, from.source, "image");
  const std::string where =
      fmt::format("images[{}]{}", from.source, file.uri.empty() ? "" : " (" + file.uri + ")");
  if (file.image.empty()) refuse("isn't there", where, "Put the picture where the file names it");
  const auto decoded = session::decode_still_image(
      {reinterpret_cast<const char*>(file.image.data()), file.image.size()}, where,
      session::Alpha::dropped);  // alphaMode states what the alpha means
  if (!decoded) throw Unreadable{decoded.error()};
  const ImageView picture = decoded->view();
  Texture out;
  out.width = picture.layout.size.width;
  out.height = picture.layout.size.height;
  texels += static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  if (texels > kMostTexels)
    refuse(fmt::format("its pictures have more than {} pixels", kMostTexels), where, "Shrink them");
  out.rgb = levels_of(picture);
  if (from.sampler >= 0) {
    const tinygltf::Sampler& sampler = entry(model.samplers, from.sampler, "sampler");
    out.across = wrap_of(sampler.wrapS);
    out.down = wrap_of(sampler.wrapT);
  }
  return out;
}

}  // namespace emberlock::apply
