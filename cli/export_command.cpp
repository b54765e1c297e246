// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/certificate_options.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/result_files.h"
#include "recon/export/nanovdb_file.h"
#include "recon/export/volume_file.h"
#include "recon/export/vti_file.h"
#include "recon/pipeline/certify.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct ExportArguments {
  std::string result, out;
  std::string format = "vdb";
  std::optional<std::pair<std::size_t, std::size_t>> frames;  ///< the first and the last
  std::vector<std::string> grids;                             ///< all if empty
  std::string key;                                            ///< a PEM file; empty: unsigned
};

struct FileFormat {
  const char* ending;
  Status (*write)(const recon::SharedVolume& volume, const fs::path& path);
};
const std::map<std::string, FileFormat>& file_formats() {
  using recon::SharedVolume;
  using recon::VdbSamples;
  static const std::map<std::string, FileFormat> formats{
      {"vdb",
       {".vdb",
        [](const SharedVolume& v, const fs::path& p) { return write_vdb(v, p, VdbSamples::at_index); }}},
      {"blender4",
       {".vdb", [](const SharedVolume& v,
                   const fs::path& p) { return write_vdb(v, p, VdbSamples::half_an_edge_later); }}},
      {"nvdb", {".nvdb", recon::write_nanovdb}},
      {"vti", {".vti", recon::write_vti}}};
  return formats;
}

/// Those of the result that are asked for.
Result<std::vector<ResultVolume>> chosen_volumes(const ExportArguments& a,
                                                 std::vector<ResultVolume> volumes) {
  if (!a.frames) return volumes;
  const auto [first, last] = *a.frames;
  if (!volumes.front().frame)
    return Error{ErrorKind::bad_input, "changes nothing here: the result is a single volume", "--frames",
                 "Leave it away"};
  const std::string has =
      fmt::format("The sequence has {} to {}", *volumes.front().frame, *volumes.back().frame);
  std::erase_if(volumes, [first = first, last = last](const ResultVolume& v) {
    return *v.frame < first || *v.frame > last;
  });
  if (!volumes.empty()) return volumes;
  return Error{ErrorKind::bad_input, fmt::format("there is no frame from {} to {}", first, last), "--frames",
               has};
}

/// Of the frames that are asked for.
void warn_of_frames_missing(const ExportArguments& a, const std::vector<ResultVolume>& all) {
  std::vector<std::uint64_t> missing = missing_frames(a.result, all);
  if (a.frames)
    std::erase_if(missing, [&](std::uint64_t f) { return f < a.frames->first || f > a.frames->second; });
  warn_of_missing(missing);
}

Error lacks_grid(const std::string& name, const recon::SharedVolume& volume, const fs::path& file) {
  std::vector<std::string> names;
  for (const recon::SharedGrid& grid : volume.grids) names.push_back(grid.name);
  return {ErrorKind::bad_input, "has no " + name + ", only " + fmt::format("{}", fmt::join(names, ", ")),
          file.string(),
          name.starts_with("temperature") ? "Reconstruct it with --quantity temperature" : "Leave it away"};
}

/// A volume with `flame` in shares of `white`, and of its grids those that are asked for.
Result<recon::SharedVolume> shared_volume(const ExportArguments& a, const ResultVolume& from, float white,
                                          const std::string& program) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::VolumeCertificate origin, recon::origin_of_export(from.file));
  origin.set_program(program);
  EMBERLOCK_ASSIGN_OR_RETURN(recon::SharedVolume volume, recon::read_shared_volume(from.file));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Lighting lighting, recon::read_lighting(from.file));
  volume.provenance = {program, reported(from.file, "input"), reported(from.file, "up"), from.frame,
                       lighting};
  EMBERLOCK_ASSIGN_OR_RETURN(auto key, key_of(a.key));
  volume.certification = {std::move(origin), std::move(key)};
  if (white > 0) recon::add_flame(volume, white);
  if (a.format == "vti") recon::add_told(volume);
  for (const std::string& name : a.grids)
    if (volume.find(name) == nullptr) return lacks_grid(name, volume, from.file);
  if (!a.grids.empty())
    std::erase_if(volume.grids, [&](const recon::SharedGrid& grid) {
      return std::find(a.grids.begin(), a.grids.end(), grid.name) == a.grids.end();
    });
  return volume;
}

/// Calls `with` for each volume, from `start` to `end` of the bar.
Status each_volume(const std::vector<ResultVolume>& volumes, const std::string& out, const Progress& bar,
                   double start, double end, const std::function<Status(const ResultVolume&)>& with) {
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, "ended early, as asked; nothing is written", out};
    const double share = static_cast<double>(i) / static_cast<double>(volumes.size());
    tell(bar, start + (end - start) * share, volumes[i].file.string());
    EMBERLOCK_RETURN_IF_ERROR(with(volumes[i]));
  }
  return {};
}

/// The highest luminance of all volumes. Error: there is nothing in any of them.
Result<float> white_of(const ExportArguments& a, const std::vector<ResultVolume>& volumes,
                       const Progress& bar) {
  constexpr double kShare = 0.4;  // of the time: reading; the rest reads again and writes
  float white = 0;
  bool empty = true;
  const Status read = each_volume(volumes, a.out, bar, 0, kShare, [&](const ResultVolume& from) -> Status {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::SharedVolume volume, recon::read_shared_volume(from.file));
    white = std::max(white, recon::brightest(volume));
    for (const recon::SharedGrid& grid : volume.grids)
      empty = empty && std::all_of(grid.values.begin(), grid.values.end(), [](float v) { return v == 0; });
    return {};
  });
  if (!read.ok()) return read.error();
  if (!empty) return white;
  return Error{ErrorKind::bad_input, "is empty: no key point has any value", a.result,
               "See what its report.html says of it"};
}

std::string file_name(const ResultVolume& volume, const char* ending) {
  return volume.frame ? fmt::format("flame_{:04}{}", *volume.frame, ending) : fmt::format("flame{}", ending);
}

void print(const ExportArguments& a, const std::vector<ResultVolume>& volumes,
           const recon::SharedVolume& last, float white) {
  std::vector<std::string> grids;
  for (const recon::SharedGrid& grid : last.grids)
    grids.push_back(fmt::format("{} ({})", grid.name, grid.unit));
  std::printf("%-16s %s\n", "grids", fmt::format("{}", fmt::join(grids, ", ")).c_str());
  if (last.find(recon::kFlame) != nullptr)
    std::printf("%-16s 1 stands for a luminance of %.6g grey levels per metre\n", "flame",
                static_cast<double>(white));
  const bool vdb = std::string_view(file_formats().at(a.format).ending) == ".vdb";
  std::printf("%-16s %s\n", "certificate",
              !vdb                     ? "none: files of this format carry none, only OpenVDB's do"
              : last.certification.key ? ("signed by " + last.certification.key->public_key()).c_str()
                                       : "unsigned");
  if (!last.provenance.up.empty()) std::printf("%-16s %s points up\n", "axes", last.provenance.up.c_str());
  std::printf("%-16s %s", "written to",
              (fs::path(a.out) / file_name(volumes.front(), file_formats().at(a.format).ending)).c_str());
  if (volumes.size() > 1) std::printf(" and %zu more", volumes.size() - 1);
  std::printf("\n");
}

Status export_result(const ExportArguments& a, const std::string& program) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ResultVolume> all, volumes_of(a.result));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ResultVolume> volumes, chosen_volumes(a, all));
  const OutputRequest request{a.out, kExport, {a.result}};
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  warn_of_frames_missing(a, all);
  const FileFormat& format = file_formats().at(a.format);
  if (!a.key.empty() && std::string_view(format.ending) != ".vdb")
    return Error{ErrorKind::bad_input, "files of this format carry no certificate to sign", "--key",
                 "Leave it away, or choose --format vdb or blender4"};
  const Progress bar = progress_bar("export");
  const Interrupt interrupt;
  // Of all frames, so that parts of a sequence that are exported one by one have one scale.
  EMBERLOCK_ASSIGN_OR_RETURN(const float white, white_of(a, all, bar));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  recon::SharedVolume volume;
  const Status written = each_volume(volumes, a.out, bar, 0.4, 1, [&](const ResultVolume& from) -> Status {
    EMBERLOCK_ASSIGN_OR_RETURN(volume, shared_volume(a, from, white, program));
    return format.write(volume, folder.path() / file_name(from, format.ending));
  });
  if (!written.ok()) return written.error();
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  tell(bar, 1, "done");
  print(a, volumes, volume, white);
  return {};
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory for one volume", a.result, "Use a machine with more"};
}

}  // namespace

void add_export(const Verb& app) {
  auto arguments = std::make_shared<ExportArguments>();
  ExportArguments& a = *arguments;
  const Verb verb = app.add_verb(
      "export", "A result's volume, or a sequence's, as files for Blender, Houdini, ParaView and renderers");
  verb.add_option("RESULT", a.result, "Folder of reconstruct, also of a sequence (--frames), or a volume.vdb")
      .require();
  verb.add_option("--out", a.out, "Folder for flame.vdb, or flame_0000.vdb and so on").require();
  verb.add_option(
          "--format", a.format,
          "vdb: OpenVDB, for Houdini, Blender from 5.0 and others; blender4: OpenVDB for Blender "
          "before 5.0, which draws voxels half an edge later; nvdb: NanoVDB; vti: VTK image data, for "
          "ParaView")
      .check_choices(names_of(file_formats()))
      .set_type("TEXT")
      .show_default();
  verb.add_option_function(
          "--frames",
          [&a](const std::string& text) {
            a.frames = parse_frames(text);
            if (!a.frames) throw UsageError("--frames: give FIRST:LAST, two frames' numbers");
          },
          "A:B: of a sequence, those from A to B [all]")
      .set_type("TEXT");
  verb.add_option("--grids", a.grids,
                  "Names between commas: emission, density, flame, temperature, ... [all that there are]")
      .split_at_commas()
      .set_type("TEXT");
  add_key_option(verb, a.key);
  verb.set_action([arguments, app] {
    const std::string version = app.version();
    or_fail(export_result(*arguments, version.empty() ? "emberlock" : version));
  });
}

}  // namespace emberlock::cli
