// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace emberlock::test {

/// Bytes in base64 (RFC 4648).
inline std::string base64(const std::string& bytes) {
  static const char* const kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t b = 0; b < 3; ++b)
      word = word << 8 | (i + b < bytes.size() ? static_cast<std::uint8_t>(bytes[i + b]) : 0U);
    for (std::size_t d = 0; d < 4; ++d)
      out += i + d > bytes.size() ? '=' : kDigits[word >> (18 - 6 * d) & 63];
  }
  return out;
}

/// A glTF file of one mesh, number 0, in the file's own axes (y upwards), and these nodes and further
/// members.
struct GltfText {
  std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 0, -1};  ///< x, y, z of each
  std::vector<std::uint16_t> indices = {0, 1, 2};
  std::string nodes = R"([{"mesh": 0}])";
  std::string roots = "[0]";
  std::string further = R"("materials": [{}])";
  std::string primitive = R"("material": 0)";
  std::string attributes = R"("POSITION": 0)";
  std::string accessors = {};   ///< further ones, from number 2 on, each after a comma
  std::size_t told_points = 0;  ///< how many POSITION says; 0: as many as there are
  std::string uri = {};         ///< of the buffer; empty: within the file

  [[nodiscard]] std::string text() const {
    std::string bytes(corners.size() * 4 + indices.size() * 2, '\0');
    std::memcpy(bytes.data(), corners.data(), corners.size() * 4);
    std::memcpy(bytes.data() + corners.size() * 4, indices.data(), indices.size() * 2);
    const auto number = [](std::size_t n) { return std::to_string(n); };
    const std::size_t points = told_points > 0 ? told_points : corners.size() / 3;
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": )" + roots + R"(}], "nodes": )" +
           nodes + R"(, "meshes": [{"primitives": [{"attributes": {)" + attributes + R"(}, "indices": 1, )" +
           primitive +
           R"(}]}], "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": )" +
           number(points) + R"(}, {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": )" +
           number(indices.size()) + "}" + accessors +
           R"(], "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": )" +
           number(corners.size() * 4) + R"(}, {"buffer": 0, "byteOffset": )" + number(corners.size() * 4) +
           R"(, "byteLength": )" + number(indices.size() * 2) + R"(}], "buffers": [{"byteLength": )" +
           number(bytes.size()) + R"(, "uri": ")" +
           (uri.empty() ? "data:application/octet-stream;base64," + base64(bytes) : uri) + R"("}], )" +
           further + "}";
  }
};

}  // namespace emberlock::test
