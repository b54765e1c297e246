// SPDX-License-Identifier: Apache-2.0
#include "recon/export/vti_file.h"

#include <bit>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <pugixml.hpp>

namespace emberlock::recon {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they are in memory");

using BlockSize = std::uint64_t;  // before each block of the appended data

std::uint64_t bytes_of(const SharedGrid& grid) { return grid.values.size() * sizeof(float); }

/// A word or a sentence: its bytes as numbers, and a zero.
void append_text(pugi::xml_node field, const char* name, const std::string& text) {
  if (text.empty()) return;
  pugi::xml_node array = field.append_child("Array");
  array.append_attribute("type") = "String";
  array.append_attribute("Name") = name;
  array.append_attribute("NumberOfTuples") = 1;
  array.append_attribute("format") = "ascii";
  std::string numbers;
  for (const char c : text) numbers += fmt::format("{} ", static_cast<int>(static_cast<unsigned char>(c)));
  array.text() = (numbers + "0").c_str();
}

void append_field(pugi::xml_node image, const SharedVolume& volume) {
  pugi::xml_node field = image.append_child("FieldData");
  const Provenance& from = volume.provenance;
  append_text(field, "program", from.program);
  append_text(field, "input", from.input);
  append_text(field, "up", from.up);
  append_text(field, "scattering", words(from.lighting.scattering));
  append_text(field, "light", words(from.lighting.light));
  if (from.frame) {
    pugi::xml_node array = field.append_child("DataArray");
    array.append_attribute("type") = "Int64";
    array.append_attribute("Name") = "frame";
    array.append_attribute("NumberOfTuples") = 1;
    array.append_attribute("format") = "ascii";
    array.text() = static_cast<unsigned long long>(*from.frame);
  }
  for (const SharedGrid& grid : volume.grids)
    append_text(field, ("meaning of " + grid.name).c_str(), grid.meaning);
}

void append_array(pugi::xml_node points, const SharedGrid& grid, bool three, std::uint64_t offset) {
  pugi::xml_node array = points.append_child("DataArray");
  array.append_attribute("type") = "Float32";
  array.append_attribute("Name") = grid.name.c_str();
  if (three) {
    array.append_attribute("NumberOfComponents") = 3;
    array.append_attribute("ComponentName0") = "red";
    array.append_attribute("ComponentName1") = "green";
    array.append_attribute("ComponentName2") = "blue";
  }
  array.append_attribute("format") = "appended";
  array.append_attribute("offset") = static_cast<unsigned long long>(offset);
  if (grid.unit.empty()) return;
  pugi::xml_node unit = array.append_child("InformationKey");
  unit.append_attribute("name") = "UNITS_LABEL";
  unit.append_attribute("location") = "vtkDataArray";
  unit.text() = grid.unit.c_str();
}

/// Everything but the appended values and the end.
std::string vti_head(const SharedVolume& volume) {
  const Grid& g = volume.grid;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", g.nx - 1, g.ny - 1, g.nz - 1);
  pugi::xml_document document;
  pugi::xml_node file = document.append_child("VTKFile");
  file.append_attribute("type") = "ImageData";
  file.append_attribute("version") = "1.0";
  file.append_attribute("byte_order") = "LittleEndian";
  file.append_attribute("header_type") = "UInt64";
  pugi::xml_node image = file.append_child("ImageData");
  image.append_attribute("WholeExtent") = extent.c_str();
  const auto at = [&](int axis) { return static_cast<double>(g.origin[axis]); };
  image.append_attribute("Origin") = fmt::format("{} {} {}", at(0), at(1), at(2)).c_str();
  image.append_attribute("Spacing") = fmt::format("{0} {0} {0}", static_cast<double>(g.edge)).c_str();
  append_field(image, volume);
  pugi::xml_node piece = image.append_child("Piece");
  piece.append_attribute("Extent") = extent.c_str();
  pugi::xml_node points = piece.append_child("PointData");
  if (volume.find(kFlame) != nullptr) points.append_attribute("Scalars") = kFlame;
  std::uint64_t offset = 0;
  for (const SharedGrid& grid : volume.grids) {
    append_array(points, grid, grid.values.size() != g.size(), offset);
    offset += sizeof(BlockSize) + bytes_of(grid);
  }
  std::ostringstream text;
  document.save(text, " ");
  const std::string all = text.str();
  return all.substr(0, all.rfind("</VTKFile>"));
}

}  // namespace

Status write_vti(const SharedVolume& volume, const std::filesystem::path& path) try {
  std::ofstream file(path, std::ios::binary);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  file << vti_head(volume) << R"( <AppendedData encoding="raw">_)";
  for (const SharedGrid& grid : volume.grids) {
    const BlockSize bytes = bytes_of(grid);
    file.write(reinterpret_cast<const char*>(&bytes), sizeof(bytes));
    file.write(reinterpret_cast<const char*>(grid.values.data()), static_cast<std::streamsize>(bytes));
  }
  file << "</AppendedData>\n</VTKFile>\n";
  file.close();
  return {};
} catch (const std::ios::failure& e) {
  return Error{ErrorKind::io, std::string("cannot write: ") + e.what(), path.string(),
               "Check that the folder is writable and the disk has room"};
}

}  // namespace emberlock::recon
