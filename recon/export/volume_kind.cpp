// SPDX-License-Identifier: Apache-2.0
#include "recon/export/volume_kind.h"

#include <algorithm>
#include <fstream>
#include <string>

#include "base/kind_of_file.h"
#include "recon/export/certificate.h"
#include "recon/export/vdb_header.h"
#include "recon/export/vdb_identity.h"
#include "recon/export/vdb_layout.h"

namespace emberlock::recon {
namespace {

Error not_a_volume(const std::filesystem::path& path, std::string what) {
  return {ErrorKind::bad_input, std::move(what), path.string(),
          "Name a volume.vdb that `emberlock reconstruct` wrote"};
}

/// The first or last bytes; fewer where the file has fewer.
std::string part_of_file(std::ifstream& file, std::streamoff size, std::streamoff from,
                         std::streamoff count) {
  from = std::max<std::streamoff>(from, 0);
  std::string bytes(static_cast<std::size_t>(std::clamp<std::streamoff>(size - from, 0, count)), '\0');
  file.seekg(from);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

Status check_kind(VolumeKind kind, const std::filesystem::path& path) {
  switch (kind) {
    case VolumeKind::volume:
      return {};
    case VolumeKind::half_an_edge_later:
      return not_a_volume(path, "is an export for Blender before 5.0, whose values lie half an edge off");
    case VolumeKind::cut_short:
      return not_a_volume(path, "is cut short");
    case VolumeKind::foreign:
      return not_a_volume(path, "is an OpenVDB file that Emberlock hasn't written");
    case VolumeKind::not_openvdb:
      break;
  }
  return not_a_volume(path, "isn't an OpenVDB file");
}

}  // namespace

Result<VolumeKind> kind_of_volume(const std::filesystem::path& path) {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(path));
  std::ifstream file(path, std::ios::binary);
  if (!file) return not_a_volume(path, "can't be read");
  file.seekg(0, std::ios::end);
  const std::streamoff size = std::max<std::streamoff>(file.tellg(), 0);
  constexpr std::streamoff kHead = 1 << 16;  // holds the file's metadata or the first grid's
  const std::string head = part_of_file(file, size, 0, kHead);
  constexpr std::streamoff kTail = kEndOfLaterVolume.size();
  const std::string tail = part_of_file(file, size, size - kTail, kTail);
  const std::size_t magic = std::min(kVdbMagic.size(), head.size());
  if (head.empty() || std::string_view(head).substr(0, magic) != kVdbMagic.substr(0, magic))
    return head.empty() ? VolumeKind::cut_short : VolumeKind::not_openvdb;
  if (tail.ends_with(kEndOfLaterVolume)) return VolumeKind::half_an_edge_later;
  if (tail.ends_with(kEndOfVolume)) return VolumeKind::volume;
  const bool header_ends = size > static_cast<std::streamoff>(kVdbFirstMetadatum);
  return header_ends && head.find("emberlock_") == std::string::npos ? VolumeKind::foreign
                                                                     : VolumeKind::cut_short;
}

Status check_volume_file(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const VolumeKind kind, kind_of_volume(path));
  EMBERLOCK_RETURN_IF_ERROR(check_kind(kind, path));
  const Result<bool> sealed = check_seal_of_volume(path);
  if (!sealed) {
    Error changed = sealed.error();
    changed.kind = ErrorKind::bad_input;
    return changed;
  }
  if (!*sealed && !is_identified_by_content(path))
    return not_a_volume(path, "carries no certificate, and its identifier isn't that of its bytes");
  std::ifstream file(path, std::ios::binary);
  return check_vdb_layout(file, path.string());
}

}  // namespace emberlock::recon
