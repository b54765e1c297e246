// SPDX-License-Identifier: Apache-2.0
// The only file that includes OpenVDB's headers: they take half a minute to compile.
#include "recon/export/volume_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#include <openvdb/openvdb.h>
#pragma GCC diagnostic pop

#include "recon/export/medium_grid.h"
#include "recon/export/vdb_identity.h"
#include "recon/export/volume_kind.h"

namespace emberlock::recon {
namespace {

constexpr const char* kDimensions = "emberlock_dimensions";
constexpr int kLargestDimension = 4096;
/// OpenVDB refuses voxels whose volume is below 3e-15 of its units: smaller ones are written in millimetres,
/// with this key.
constexpr const char* kMetresPerUnit = "emberlock_metres_per_unit";
constexpr double kSmallestVoxel = 2e-5;  // metres

double metres_per_unit(const Grid& grid) {
  return static_cast<double>(grid.edge) < kSmallestVoxel ? 1e-3 : 1;
}

template <class GridType, class ValueAt>
typename GridType::Ptr sparse_grid(const Grid& grid, const std::string& name, const std::string& unit,
                                   ValueAt value_at) {
  auto out = GridType::create();
  out->setName(name);
  out->insertMeta("unit", openvdb::StringMetadata(unit));
  out->insertMeta(kDimensions, openvdb::Vec3IMetadata({grid.nx, grid.ny, grid.nz}));
  const double metres = metres_per_unit(grid);
  if (metres != 1) out->insertMeta(kMetresPerUnit, openvdb::DoubleMetadata(metres));
  out->setTransform(openvdb::math::Transform::createLinearTransform(static_cast<double>(grid.edge) / metres));
  out->transform().postTranslate(openvdb::Vec3d(static_cast<double>(grid.origin[0]) / metres,
                                                static_cast<double>(grid.origin[1]) / metres,
                                                static_cast<double>(grid.origin[2]) / metres));
  auto accessor = out->getAccessor();
  const auto background = out->background();
  for (int k = 0; k < grid.nz; ++k) {
    for (int j = 0; j < grid.ny; ++j) {
      for (int i = 0; i < grid.nx; ++i) {
        const auto value = value_at(grid.index(i, j, k));
        if (value != background) accessor.setValueOn({i, j, k}, value);
      }
    }
  }
  return out;
}

openvdb::GridBase::Ptr grid_of(const Grid& grid, const std::string& name, const std::string& unit,
                               const std::vector<float>& v) {
  if (v.size() == grid.size())
    return sparse_grid<openvdb::FloatGrid>(grid, name, unit, [&](std::size_t i) { return v[i]; });
  return sparse_grid<openvdb::Vec3SGrid>(
      grid, name, unit, [&](std::size_t i) { return openvdb::Vec3s(v[3 * i], v[3 * i + 1], v[3 * i + 2]); });
}

Error damaged(const std::filesystem::path& path, std::string what) {
  return {ErrorKind::bad_input, std::move(what), path.string(),
          "Name a volume.vdb that `emberlock reconstruct` wrote"};
}

Result<Grid> geometry(const openvdb::GridBase& from, const std::filesystem::path& path) {
  const auto dimensions = from.getMetadata<openvdb::Vec3IMetadata>(kDimensions);
  if (!dimensions) return damaged(path, std::string("has no ") + kDimensions);
  const openvdb::Vec3i n = dimensions->value();
  Grid grid;
  for (int axis = 0; axis < 3; ++axis) {
    if (n[axis] < 2 || n[axis] > kLargestDimension) return damaged(path, "dimensions out of range");
  }
  const auto said = from.getMetadata<openvdb::DoubleMetadata>(kMetresPerUnit);
  const double unit = said ? said->value() : 1;
  if (!(unit > 0) || !std::isfinite(unit))
    return damaged(path, std::string(kMetresPerUnit) + " is no length");
  const openvdb::Vec3d origin = from.transform().indexToWorld(openvdb::Vec3d(0, 0, 0));
  for (int axis = 0; axis < 3; ++axis) grid.origin[axis] = static_cast<float>(unit * origin[axis]);
  grid.edge = static_cast<float>(unit * from.voxelSize()[0]);
  grid.nx = n[0];
  grid.ny = n[1];
  grid.nz = n[2];
  return grid;
}

bool inside(const Grid& grid, const openvdb::Coord& c) {
  return c.x() >= 0 && c.y() >= 0 && c.z() >= 0 && c.x() < grid.nx && c.y() < grid.ny && c.z() < grid.nz;
}

/// An opened file that is as it was written.
Result<std::unique_ptr<openvdb::io::File>> opened(const std::filesystem::path& path) {
  EMBERLOCK_RETURN_IF_ERROR(check_volume_file(path));
  openvdb::initialize();
  auto file = std::make_unique<openvdb::io::File>(path.string());
  file->open(false);  // by delayed loading blocks would be found by sizes in metadata, which nothing checks
  return file;
}

/// The values of a grid at its key points.
template <class GridType, class Put>
Status take_values(const GridType& from, const Grid& grid, const std::string& name,
                   const std::filesystem::path& path, const Put& put) {
  for (auto it = from.cbeginValueOn(); it; ++it) {
    const openvdb::Coord c = it.getCoord();
    if (!it.isVoxelValue() || !inside(grid, c)) return damaged(path, name + " leaves its dimensions");
    put(grid.index(c.x(), c.y(), c.z()), *it);
  }
  return {};
}

Status check_size(const Grid& grid, const std::filesystem::path& path) {
  if (static_cast<double>(grid.edge) >= kSmallestVoxel * 1e-3) return {};
  return Error{ErrorKind::bad_input, "voxels of less than 20 nm can't be written", path.string(),
               "Give fewer voxels, or lengths in metres"};
}

/// `end` stands behind what OpenVDB reads.
Status write_file(const openvdb::GridPtrVec& grids, openvdb::MetaMap about, const std::filesystem::path& path,
                  std::string_view end, const Certification& certification) try {
  const SigningKey* const key = certification.key.get();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text,
                             session::certificate_text(certification.certificate, key));
  about.insertMeta(kCertificateKey, openvdb::StringMetadata(text));
  openvdb::io::File file(path.string());
  file.write(grids, about);
  file.close();
  std::ofstream behind(path, std::ios::binary | std::ios::app);
  behind.exceptions(std::ios::failbit | std::ios::badbit);
  behind << end;
  behind.close();
  identify_by_content(path);
  return seal_volume(path, key);
} catch (const std::bad_alloc&) {
  throw;  // of memory, not of the disk
} catch (const std::exception& e) {
  return Error{ErrorKind::io, std::string("cannot write: ") + e.what(), path.string(),
               "Check that the folder is writable and the disk has room"};
}

/// The values of a grid of either type.
Result<std::vector<float>> all_values(const openvdb::GridBase::Ptr& base, const Grid& grid,
                                      const std::filesystem::path& path) {
  const std::string name = base->getName();
  const auto scalar = openvdb::gridPtrCast<openvdb::FloatGrid>(base);
  const auto vector = openvdb::gridPtrCast<openvdb::Vec3SGrid>(base);
  if (!scalar && !vector) return damaged(path, name + " is neither FloatGrid nor Vec3SGrid");
  std::vector<float> values(grid.size() * (scalar ? 1 : 3));
  const auto put_one = [&](std::size_t p, float value) { values[p] = value; };
  const auto put_three = [&](std::size_t p, const openvdb::Vec3s& v) {
    for (int c = 0; c < 3; ++c) values[3 * p + static_cast<std::size_t>(c)] = v[c];
  };
  EMBERLOCK_RETURN_IF_ERROR(scalar ? take_values(*scalar, grid, name, path, put_one)
                                   : take_values(*vector, grid, name, path, put_three));
  return values;
}

Result<std::vector<float>> values_in(openvdb::io::File& file, const std::string& name,
                                     const std::filesystem::path& path) {
  const openvdb::GridBase::Ptr base = file.readGrid(name);
  EMBERLOCK_ASSIGN_OR_RETURN(const Grid grid, geometry(*base, path));
  return all_values(base, grid, path);
}

/// Makes two corners around a grid's active box active too. Where Blender before 5.0 is built without
/// NanoVDB, as Debian's is, colours don't fade towards the outside of that box: it divides them by an opacity
/// that does.
void put_zeros_around(openvdb::Vec3SGrid& grid) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) return;
  box.expand(1);
  grid.tree().setValueOn(box.min(), openvdb::Vec3s(0));
  grid.tree().setValueOn(box.max(), openvdb::Vec3s(0));
}

/// Extinction that takes less than 1e-5 of the light a voxel becomes none. Blender 3.4 multiplies a step's
/// light by (1 - exp(-s)) / s, in single precision: for a trace of extinction that is no light at all.
std::vector<float> without_traces(std::vector<float> extinction, const Grid& grid) {
  constexpr float kTrace = 1e-5F;
  for (float& sigma : extinction)
    if (sigma * grid.edge < kTrace) sigma = 0;
  return extinction;
}

constexpr const char* kScattering = "emberlock_scattering";
constexpr const char* kAlbedo = "emberlock_albedo";
constexpr const char* kAsymmetry = "emberlock_asymmetry";
constexpr const char* kLight = "emberlock_light";
constexpr const char* kLightPlace = "emberlock_light_place";
constexpr const char* kLightStrength = "emberlock_light_strength";
constexpr const char* kLightAmbient = "emberlock_light_ambient";

constexpr std::pair<std::string_view, Scattering::Order> kOrders[] = {
    {"single", Scattering::Order::single}, {"multiple", Scattering::Order::multiple}};
constexpr std::pair<std::string_view, Light::Source> kSources[] = {
    {"even", Light::Source::even}, {"distant", Light::Source::distant}, {"nearby", Light::Source::nearby}};

/// What a medium scatters, as metadata: nothing of what is off.
openvdb::MetaMap metadata_of(const Lighting& lighting) {
  openvdb::MetaMap about;
  for (const auto& [word, order] : kOrders) {
    if (lighting.scattering.order != order) continue;
    about.insertMeta(kScattering, openvdb::StringMetadata(std::string(word)));
    about.insertMeta(kAlbedo, openvdb::DoubleMetadata(lighting.scattering.albedo));
    about.insertMeta(kAsymmetry, openvdb::DoubleMetadata(lighting.scattering.asymmetry));
  }
  const Light& light = lighting.light;
  const auto insert = [&](const char* key, const std::array<double, 3>& v) {
    about.insertMeta(key, openvdb::Vec3DMetadata({v[0], v[1], v[2]}));
  };
  for (const auto& [word, source] : kSources) {
    if (light.source != source) continue;
    about.insertMeta(kLight, openvdb::StringMetadata(std::string(word)));
    insert(kLightPlace, light.place);
    insert(kLightStrength, light.strength);
    insert(kLightAmbient, light.ambient);
  }
  return about;
}

/// Metadata of a file that foreign hands may have made. The first that can't be read is an Error, and the
/// values from there on are nothing.
class ReadMetadata {
 public:
  ReadMetadata(const openvdb::MetaMap& from, const std::filesystem::path& path) : from_(from), path_(path) {}

  [[nodiscard]] bool has(const char* key) const { return from_[key] != nullptr; }
  double number(const char* key) {
    const auto found = from_.getMetadata<openvdb::DoubleMetadata>(key);
    if (!found) refuse(key, "is missing or no number");
    return found ? found->value() : 0;
  }
  std::array<double, 3> three(const char* key) {
    const auto found = from_.getMetadata<openvdb::Vec3DMetadata>(key);
    if (!found) refuse(key, "is missing or not three numbers");
    if (!found) return {};
    const openvdb::Vec3d v = found->value();
    return {v[0], v[1], v[2]};
  }
  /// What a word of the table stands for.
  template <class Value, std::size_t kSize>
  Value one_of(const std::pair<std::string_view, Value> (&table)[kSize], const char* key) {
    const auto found = from_.getMetadata<openvdb::StringMetadata>(key);
    for (const auto& [word, value] : table)
      if (found && found->value() == word) return value;
    refuse(key, "is no word that is known");
    return Value{};
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  void refuse(const char* key, const char* what) {
    if (status_.ok()) status_ = damaged(path_, std::string(key) + ' ' + what);
  }

  const openvdb::MetaMap& from_;
  const std::filesystem::path& path_;
  Status status_;
};

/// Where a volume comes from, as metadata.
openvdb::MetaMap metadata_of(const Provenance& from) {
  openvdb::MetaMap about = metadata_of(from.lighting);
  const auto insert = [&](const char* key, const std::string& text) {
    if (!text.empty()) about.insertMeta(key, openvdb::StringMetadata(text));
  };
  insert("creator", from.program);
  insert("emberlock_input", from.input);
  insert("emberlock_up", from.up);
  if (from.frame)
    about.insertMeta("emberlock_frame", openvdb::Int64Metadata(static_cast<std::int64_t>(*from.frame)));
  return about;
}

}  // namespace

Status write_volume(const Volume& volume, const std::filesystem::path& path,
                    const std::vector<NamedGrid>& further, const Lighting& lighting,
                    const Certification& certification) {
  openvdb::initialize();
  EMBERLOCK_RETURN_IF_ERROR(check_size(volume.grid, path));
  const auto& emission = volume.emission;
  auto emission_grid = sparse_grid<openvdb::Vec3SGrid>(
      volume.grid, "emission", "grey levels (0..255) per metre", [&](std::size_t i) {
        return openvdb::Vec3s(emission[3 * i], emission[3 * i + 1], emission[3 * i + 2]);
      });
  emission_grid->setVectorType(openvdb::VEC_INVARIANT);  // a colour: not rotated by transforms
  auto density_grid = sparse_grid<openvdb::FloatGrid>(volume.grid, "density", "1/m", [&](std::size_t i) {
    return volume.extinction.empty() ? 0.0F : volume.extinction[i];
  });
  density_grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  openvdb::GridPtrVec grids{emission_grid, density_grid};
  for (const NamedGrid& grid : further)
    grids.push_back(grid_of(volume.grid, grid.name, grid.unit, grid.values));
  if (!volume.inside.empty()) grids.push_back(grid_of(volume.grid, kMedium, "1", medium_values(volume)));
  return write_file(grids, metadata_of(lighting), path, kEndOfVolume, certification);
}

Result<Volume> read_volume(const std::filesystem::path& path) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, opened(path));
  if (!file->hasGrid("emission") || !file->hasGrid("density"))
    return damaged(path, "has no emission or no density");
  const auto emission = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file->readGrid("emission"));
  const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(file->readGrid("density"));
  if (!emission || !density) return damaged(path, "emission is no Vec3SGrid or density no FloatGrid");
  Volume volume;
  EMBERLOCK_ASSIGN_OR_RETURN(volume.grid, geometry(*emission, path));
  volume.emission.assign(3 * volume.grid.size(), 0.0F);
  EMBERLOCK_RETURN_IF_ERROR(
      take_values(*emission, volume.grid, "emission", path, [&](std::size_t p, const openvdb::Vec3s& rgb) {
        for (int c = 0; c < 3; ++c) volume.emission[3 * p + static_cast<std::size_t>(c)] = rgb[c];
      }));
  if (density->activeVoxelCount() > 0) volume.extinction.assign(volume.grid.size(), 0.0F);
  EMBERLOCK_RETURN_IF_ERROR(take_values(*density, volume.grid, "density", path,
                                        [&](std::size_t p, float value) { volume.extinction[p] = value; }));
  if (!file->hasGrid(kMedium)) return volume;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<float> filled,
                             all_values(file->readGrid(kMedium), volume.grid, path));
  EMBERLOCK_ASSIGN_OR_RETURN(volume.inside, voxels_of_medium(filled, volume.grid, path));
  return volume;
} catch (const std::exception& e) {
  return damaged(path, e.what());
}

Result<Lighting> read_lighting(const std::filesystem::path& path) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, opened(path));
  const openvdb::MetaMap::Ptr about = file->getMetadata();
  ReadMetadata read(*about, path);
  Lighting lighting;
  if (read.has(kScattering))
    lighting.scattering = {read.one_of(kOrders, kScattering), read.number(kAlbedo), read.number(kAsymmetry)};
  if (read.has(kLight))
    lighting.light = {read.one_of(kSources, kLight), read.three(kLightPlace), read.three(kLightStrength),
                      read.three(kLightAmbient)};
  EMBERLOCK_RETURN_IF_ERROR(read.status());
  if (const Status in_range = check(lighting); !in_range.ok()) return damaged(path, in_range.error().what);
  return lighting;
} catch (const std::exception& e) {
  return damaged(path, e.what());
}

Result<std::vector<float>> read_grid(const std::filesystem::path& path, const std::string& name) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, opened(path));
  if (!file->hasGrid(name)) return damaged(path, "has no grid " + name);
  return values_in(*file, name, path);
} catch (const std::exception& e) {
  return damaged(path, e.what());
}

Result<std::optional<std::vector<float>>> read_values(const std::filesystem::path& path,
                                                      const std::string& name, const Grid& grid) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, opened(path));
  if (!file->hasGrid(name)) return std::optional<std::vector<float>>();
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<float> values, values_in(*file, name, path));
  if (values.size() != grid.size()) return damaged(path, name + " is of another size than emission");
  return std::optional(std::move(values));
} catch (const std::exception& e) {
  return damaged(path, e.what());
}

Result<SharedVolume> read_shared_volume(const std::filesystem::path& path) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, opened(path));
  SharedVolume volume;
  const openvdb::GridPtrVecPtr grids = file->getGrids();
  for (const openvdb::GridBase::Ptr& base : *grids) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Grid grid, geometry(*base, path));
    if (volume.grids.empty()) volume.grid = grid;
    if (!same_place(volume.grid, grid)) return damaged(path, base->getName() + " is of another grid");
    EMBERLOCK_ASSIGN_OR_RETURN(std::vector<float> values, all_values(base, grid, path));
    const auto unit = base->getMetadata<openvdb::StringMetadata>("unit");
    volume.grids.push_back({base->getName(), unit ? unit->value() : "", "", std::move(values)});
  }
  EMBERLOCK_RETURN_IF_ERROR(fold_medium(volume, path));
  return volume;
} catch (const std::bad_alloc&) {
  throw;  // of memory, not of the file
} catch (const std::exception& e) {
  return damaged(path, e.what());
}

Status write_vdb(const SharedVolume& volume, const std::filesystem::path& path, VdbSamples samples) {
  openvdb::initialize();
  EMBERLOCK_RETURN_IF_ERROR(check_size(volume.grid, path));
  const openvdb::MetaMap about = metadata_of(volume.provenance);
  const bool later = samples == VdbSamples::half_an_edge_later;
  openvdb::GridPtrVec grids;
  const auto add = [&](const SharedGrid& from) {
    const bool thin = later && from.name == "density";
    openvdb::GridBase::Ptr grid = grid_of(volume.grid, from.name, from.unit,
                                          thin ? without_traces(from.values, volume.grid) : from.values);
    const bool scalar = grid->isType<openvdb::FloatGrid>();
    if (scalar) grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    if (!scalar) grid->setVectorType(openvdb::VEC_INVARIANT);
    if (!scalar && later) put_zeros_around(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid));
    if (!from.meaning.empty()) grid->insertMeta("meaning", openvdb::StringMetadata(from.meaning));
    for (auto it = about.beginMeta(); it != about.endMeta(); ++it) grid->insertMeta(it->first, *it->second);
    if (later) grid->transform().preTranslate(openvdb::Vec3d(-0.5));
    grids.push_back(std::move(grid));
  };
  for (const SharedGrid& from : volume.grids) add(from);
  if (volume.find("density") == nullptr) add({"density", "1/m", "", std::vector<float>(volume.grid.size())});
  return write_file(grids, about, path, later ? kEndOfLaterVolume : kEndOfVolume, volume.certification);
}

}  // namespace emberlock::recon
