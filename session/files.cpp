// SPDX-License-Identifier: Apache-2.0
#include "session/files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <set>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "base/file.h"
#include "base/unique_fd.h"
#include "session/host_clock.h"
#include "session/json_message.h"
#include "session/layout.h"
#include "session/name.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxManifestBytes = std::size_t{64} << 20;
constexpr off_t kReserveBytes = off_t{1} << 20;  // enough for some 10 000 segments in the manifest

fs::path reserve_path(const fs::path& folder) { return folder / "reserve"; }

template <class Values>
bool all_finite(const Values& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

const char* remedy_of(int code) {
  switch (code) {
    case EROFS:
      return "The file system is read-only, as Linux makes it after an error: what was recorded until then "
             "is "
             "kept. See the kernel's log (dmesg), check and mount it anew, or record to another disk";
    case EIO:
      return "The disk fails: what was recorded until then is kept. See the kernel's log (dmesg), or record "
             "to "
             "another disk";
    default:
      return "Check the disk's space and the folder's permissions";
  }
}

Status check_text_in(const std::string& where, const char* field, const std::string& text) {
  Status good = check_text(field, text);
  if (good) return good;
  Error error = good.error();
  error.where = where + ", " + error.where;
  return error;
}

bool is_spread(double sigma) { return std::isfinite(sigma) && sigma >= 0; }

}  // namespace

fs::path manifest_path(const fs::path& folder) { return folder / "manifest.json"; }
fs::path events_path(const fs::path& folder) { return folder / "events.binpb"; }
fs::path index_path(const fs::path& folder, const std::string& camera_id) {
  return folder / camera_id / "index.bin";
}

std::string segment_name(const std::string& camera_id, std::uint32_t segment, Encoding encoding) {
  std::string number = std::to_string(segment);
  number.insert(0, number.size() < 6 ? 6 - number.size() : 0, '0');
  return camera_id + "/" + number + (encoding == Encoding::ffv1 ? ".mkv" : ".nut");
}

fs::path find_segment(const fs::path& folder, const std::string& camera_id, std::uint32_t segment) {
  // transcode() puts the compressed file in place, then removes the other: who saw neither looks again.
  for (const Encoding encoding : {Encoding::ffv1, Encoding::raw_nut, Encoding::ffv1}) {
    std::error_code ec;
    fs::path path = folder / segment_name(camera_id, segment, encoding);
    if (fs::is_regular_file(path, ec)) return path;
  }
  return {};
}

Result<v1::Manifest> parse_manifest(std::string_view json, const std::string& where) {
  v1::Manifest manifest;
  EMBERLOCK_RETURN_IF_ERROR(
      read_json(json, manifest, "a session's manifest", where, "Mend the JSON, or use a newer Emberlock"));
  EMBERLOCK_RETURN_IF_ERROR(check_manifest(manifest, where));
  return manifest;
}

Status check_texts(const v1::Manifest& manifest, const std::string& where) {
  const std::array<std::pair<const char*, const std::string*>, 4> texts{
      {{"session_id", &manifest.session_id()},
       {"created_utc", &manifest.created_utc()},
       {"software", &manifest.software()},
       {"purpose", &manifest.purpose()}}};
  for (const auto& [field, text] : texts) EMBERLOCK_RETURN_IF_ERROR(check_text_in(where, field, *text));
  return {};
}

Status check_manifest(const v1::Manifest& manifest, const std::string& where) {
  if (manifest.format_version() != kSessionFormatVersion) {
    return Error{ErrorKind::bad_input,
                 "format version " + std::to_string(manifest.format_version()) +
                     ", this program reads version " + std::to_string(kSessionFormatVersion),
                 where + ", field format_version", "Use the Emberlock that recorded it"};
  }
  if (manifest.cameras().empty()) {
    return Error{ErrorKind::bad_input, "no cameras", where + ", field cameras", "Record at least one camera"};
  }
  std::set<std::string> ids;
  for (const v1::CameraStream& camera : manifest.cameras()) {
    const std::string field = where + ", camera " + camera.camera_id();
    if (!is_folder_name(camera.camera_id())) {
      return Error{ErrorKind::bad_input, "the camera id can't name a folder", field,
                   "Use letters, digits, space and . _ : - alone, no point in front, at most 200"};
    }
    if (!ids.insert(camera.camera_id()).second) {
      return Error{ErrorKind::bad_input, "the camera id is there twice", field,
                   "Give each camera an id of its own"};
    }
    if (const auto layout = layout_of(camera); !layout) {
      Error error = layout.error();
      error.where = where + ", " + error.where;
      return error;
    }
    if (!std::isfinite(camera.frame_rate_hz()) || camera.frame_rate_hz() < 0) {
      return Error{ErrorKind::bad_input, "must be finite and not negative", field + ", field frame_rate_hz",
                   "Mend the rate"};
    }
    if (!std::isfinite(camera.transport_s()) || camera.transport_s() < 0) {
      return Error{ErrorKind::bad_input, "must be finite and not negative", field + ", field transport_s",
                   "Mend the time"};
    }
    if (!(camera.late_s() >= 0 && camera.late_s() * camera.frame_rate_hz() < 1 &&
          std::isfinite(camera.late_s()))) {
      return Error{ErrorKind::bad_input, "must be within a frame period, not negative",
                   field + ", field late_s", "Mend the time"};
    }
    if (!std::isfinite(camera.late_sigma_s()) || camera.late_sigma_s() < 0) {
      return Error{ErrorKind::bad_input, "must be finite and not negative", field + ", field late_sigma_s",
                   "Mend the time"};
    }
    EMBERLOCK_RETURN_IF_ERROR(HostClock::of(camera.clock(), field));
    if (camera.has_calibration()) EMBERLOCK_RETURN_IF_ERROR(check_calibration(camera.calibration(), field));
  }
  if (manifest.has_box()) EMBERLOCK_RETURN_IF_ERROR(check_box(manifest.box(), where));
  return {};
}

Status check_calibration(const v1::Calibration& c, const std::string& where) {
  const bool whole = c.camera_from_world_size() == 0 || c.camera_from_world_size() == 12;
  const std::initializer_list<double> intrinsics = {c.fx(), c.fy(), c.cx(), c.cy(), c.k1(),
                                                    c.k2(), c.p1(), c.p2(), c.k3()};
  const bool rooted = c.sigma_size() == kCalibrationSigmas + kPoseRootNumbers;
  const bool certain =
      (c.sigma_size() == 0 || c.sigma_size() == kCalibrationSigmas || rooted) &&
      std::all_of(c.sigma().begin(), c.sigma().end() - (rooted ? kPoseRootNumbers : 0), is_spread) &&
      all_finite(c.sigma()) && is_spread(c.corner_sigma());
  if (!certain) {
    return Error{ErrorKind::bad_input,
                 "sigma is neither absent nor 15 finite numbers of 0 or more (or those and 21 finite ones)",
                 where + ".calibration.sigma", "Remove it, or calibrate again"};
  }
  if (whole && all_finite(c.camera_from_world()) && all_finite(intrinsics)) return {};
  return Error{ErrorKind::bad_input, "a number isn't finite, or camera_from_world hasn't 12 of them",
               where + ".calibration", "Mend or remove the calibration"};
}

Status check_box(const v1::Box& box, const std::string& where) {
  const bool positive = std::all_of(box.size().begin(), box.size().end(), [](double v) { return v > 0; });
  if (box.center_size() == 3 && box.size_size() == 3 && all_finite(box.center()) && all_finite(box.size()) &&
      positive) {
    return {};
  }
  return Error{ErrorKind::bad_input, "center and size must be three finite numbers each, sizes above 0",
               where + ": box", "Mend or remove the box"};
}

Result<v1::Manifest> read_manifest(const fs::path& folder) {
  const fs::path path = manifest_path(folder);
  std::error_code ec;
  if (!fs::exists(path, ec)) {
    return Error{ErrorKind::bad_input, "not a session: it holds no manifest.json", folder.string(),
                 "Name the folder that a recording made"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json, read_file(path, kMaxManifestBytes));
  return parse_manifest(json, path.string());
}

Status write_manifest(const fs::path& folder, const v1::Manifest& manifest) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json, json_of(manifest, Defaults::left_out, "the manifest",
                                                             manifest_path(folder).string()));
  return write_file_atomically(manifest_path(folder), json);
}

Status keep_reserve(const fs::path& folder) {
  const fs::path path = reserve_path(folder);
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
  if (!fd) return errno_error(path, "cannot create");
  errno = ::posix_fallocate(fd.get(), 0, kReserveBytes);
  if (errno != 0) return errno_error(path, "cannot keep room for the manifest");
  return {};
}

void drop_reserve(const fs::path& folder) {
  std::error_code ec;
  fs::remove(reserve_path(folder), ec);
}

Status write_fully(int fd, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno_error(path, "cannot write");
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

Error errno_error(const fs::path& path, const std::string& action) {
  const int code = errno;
  return {ErrorKind::io, action + ": " + std::generic_category().message(code), path.string(),
          remedy_of(code)};
}

}  // namespace emberlock::session
