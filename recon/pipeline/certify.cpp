// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/certify.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "recon/calibrate/rig.h"
#include "recon/pipeline/session_scene.h"
#include "session/files.h"
#include "session/reader.h"
#include "session/shutter_times.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

/// Adds files with their hashes, each of which takes its share of the progress.
class HashesFiles {
 public:
  HashesFiles(FileHashes& hashes, const Observer& observer, std::size_t files)
      : hashes_(hashes), observer_(observer), files_(static_cast<double>(std::max<std::size_t>(1, files))) {}
  Status add(const fs::path& path, const std::string& name,
             google::protobuf::RepeatedPtrField<v1::HashedFile>& to) {
    const Observer part = part_of(observer_, done_ / files_, (done_ + 1) / files_);
    ++done_;
    EMBERLOCK_ASSIGN_OR_RETURN(const FileHash hash, hashes_.of(path, part));
    v1::HashedFile& file = *to.Add();
    file.set_file(name);
    file.set_bytes(hash.bytes);
    file.set_sha256(hash.sha256);
    return {};
  }

 private:
  FileHashes& hashes_;
  const Observer& observer_;
  double files_, done_ = 0;
};

/// The segment that holds a frame: as the manifest lists it, or as it was transcoded since.
fs::path segment_of(const fs::path& folder, const v1::CameraStream& camera, std::size_t frame) {
  for (const v1::Segment& segment : camera.segments()) {
    if (frame < segment.first_frame() || frame - segment.first_frame() >= segment.frames()) continue;
    std::error_code ec;
    for (const char* ending : {".mkv", ".nut"})
      if (fs::path path = (folder / segment.file()).replace_extension(ending); fs::exists(path, ec))
        return path;
  }
  return {};
}

/// The files that a volume of these frames is made of, in the order of their names.
std::set<fs::path> files_shown(const session::SessionReader& reader,
                               const std::vector<std::optional<FilmedFrame>>& filmed) {
  const fs::path& folder = reader.folder();
  std::set<fs::path> files;
  const auto add = [&](const fs::path& path) {
    std::error_code ec;
    if (!path.empty() && fs::is_regular_file(path, ec)) files.insert(path);
  };
  add(session::manifest_path(folder));
  add(session::events_path(folder));
  add(session::shutter_times_path(folder));
  add(session::certificate_path(folder));
  add(folder / "import.json");
  for (std::size_t i = 0; i < filmed.size(); ++i) {
    const v1::CameraStream& camera = reader.manifest().cameras(static_cast<int>(i));
    add(session::index_path(folder, camera.camera_id()));
    if (filmed[i]) add(segment_of(folder, camera, filmed[i]->frame));
  }
  return files;
}

void tell_worst_pair(v1::SyncEvidence& sync) {
  for (const auto& a : sync.cameras())
    for (const auto& b : sync.cameras()) {
      const double apart = a.late_s() - b.late_s();
      if (&a == &b || !a.has_late_s() || !b.has_late_s() || apart < 0) continue;
      if (sync.has_worst_pair_s() && apart <= sync.worst_pair_s()) continue;
      sync.set_worst_pair_s(apart);
      sync.set_worst_pair_sigma_s(std::hypot(a.sigma_s(), b.sigma_s()));
      sync.clear_worst_pair();
      sync.add_worst_pair(a.camera_id());
      sync.add_worst_pair(b.camera_id());
    }
}

/// By times.json; of staggered cameras by the manifest; else by the last decision of an alignment among the
/// session's events.
v1::SyncEvidence sync_of(const session::SessionReader& reader, bool by_times,
                         const std::vector<std::optional<FilmedFrame>>& filmed) {
  v1::SyncEvidence sync;
  const v1::Manifest& manifest = reader.manifest();
  const auto add = [&](int camera, std::optional<double> late, double sigma) {
    v1::SyncEvidence::Camera& told = *sync.add_cameras();
    told.set_camera_id(manifest.cameras(camera).camera_id());
    if (late && std::isfinite(*late)) told.set_late_s(*late);
    if (std::isfinite(sigma)) told.set_sigma_s(sigma);
  };
  const bool late = std::any_of(filmed.begin(), filmed.end(), [](const auto& f) { return f && f->late; });
  if (late) {
    sync.set_source(by_times ? "times.json" : "manifest.json");
    for (std::size_t i = 0; i < filmed.size(); ++i)
      if (filmed[i] && filmed[i]->late)
        add(static_cast<int>(i), filmed[i]->late->value(), filmed[i]->late_sigma.value());
    if (!by_times) return sync;  // they are to be apart
  } else {
    const auto& events = reader.events();
    const auto last = std::find_if(events.rbegin(), events.rend(), [&](const v1::Event& event) {
      return event.has_decision() && event.decision().cameras_size() == manifest.cameras_size();
    });
    if (last == events.rend()) return sync;
    sync.set_source("events.binpb");
    for (int i = 0; i < manifest.cameras_size(); ++i) {
      const v1::DecisionEvent::Camera& seen = last->decision().cameras(i);
      // Its error is positive when it films earlier.
      add(i, seen.has_error_s() ? std::optional(-seen.error_s()) : std::nullopt, seen.sigma_s());
    }
  }
  tell_worst_pair(sync);
  return sync;
}

/// Of a camera that is placed.
void tell_calibration(const v1::Calibration& calibration, const CameraModel& camera,
                      v1::CameraCalibration& told) {
  told.set_sha256(sha256(calibration.SerializeAsString()));
  told.set_fx(calibration.fx());
  told.set_fy(calibration.fy());
  told.set_corner_sigma(calibration.corner_sigma());
  const Eigen::Vector3d centre = camera.center();
  for (const double c : centre) told.add_centre_m(c);
  constexpr int kCentre = 9;  // of Calibration.sigma
  for (int axis = 0; axis < 3 && calibration.sigma_size() >= kCentre + 3; ++axis)
    told.add_centre_sigma_m(calibration.sigma(kCentre + axis));
}

void tell_camera(const v1::CameraStream& stream, const std::optional<FilmedFrame>& filmed,
                 v1::FilmedSession::Camera& camera) {
  const v1::Counts& counts = stream.counts();
  camera.set_camera_id(stream.camera_id());
  camera.set_model(stream.model());
  camera.set_width(stream.width());
  camera.set_height(stream.height());
  camera.set_frame_rate_hz(stream.frame_rate_hz());
  camera.set_recorded(counts.recorded());
  camera.set_lost(counts.camera_gap() + counts.transport() + counts.underrun() + counts.queue() +
                  counts.disk());
  if (filmed) camera.set_frame(filmed->frame);
  const ImageSize size{static_cast<int>(stream.width()), static_cast<int>(stream.height())};
  if (const auto model = camera_model_of(stream.calibration(), size, stream.camera_id(), ""))
    tell_calibration(stream.calibration(), *model, *camera.mutable_calibration());
}

Status tell_session(const fs::path& folder, const SceneOptions& options, FileHashes* hashes,
                    const Observer& observer, v1::FilmedSession& told) {
  EMBERLOCK_ASSIGN_OR_RETURN(const session::SessionReader reader, session::SessionReader::open(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto times, session::read_shutter_times(reader));
  v1::Manifest manifest = reader.manifest();
  if (options.rig) {
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, session::read_rig(*options.rig));
    EMBERLOCK_RETURN_IF_ERROR(apply_rig(manifest, rig, options.rig->string()));
  }
  const auto filmed = filmed_frames(reader, times, options);
  told.set_session_id(manifest.session_id());
  told.set_created_utc(manifest.created_utc());
  told.set_software(manifest.software());
  told.set_purpose(manifest.purpose());
  if (!filmed.empty() && filmed[0]) {
    told.set_frame(filmed[0]->frame);
    told.set_filmed_utc_ns(reader.stamps(0)[filmed[0]->frame].system_time.ns);
  }
  for (std::size_t i = 0; i < filmed.size(); ++i)
    tell_camera(manifest.cameras(static_cast<int>(i)), filmed[i], *told.add_cameras());
  *told.mutable_sync() = sync_of(reader, times.has_value(), filmed);
  if (hashes == nullptr) return {};
  const std::set<fs::path> files = files_shown(reader, filmed);
  HashesFiles hashed(*hashes, observer, files.size());
  for (const fs::path& path : files)
    EMBERLOCK_RETURN_IF_ERROR(
        hashed.add(path, path.lexically_relative(folder).generic_string(), *told.mutable_files()));
  return {};
}

/// Below the input's folder as it lies there, elsewhere by its name alone; however both were typed.
std::string name_beside(const fs::path& input, const fs::path& path) {
  fs::path beside = fs::absolute(input).lexically_normal();
  if (!beside.has_filename()) beside = beside.parent_path();  // "take2/"
  const std::string relative =
      fs::absolute(path).lexically_normal().lexically_relative(beside.parent_path()).generic_string();
  return relative.empty() || relative.starts_with("..") ? path.filename().string() : relative;
}

}  // namespace

Result<FileHash> FileHashes::of(const fs::path& path, const Observer& observer) {
  // One file at a time: others mostly wait for the same one.
  const std::lock_guard lock(mutex_);
  std::error_code ec;
  Identity identity{path, fs::file_size(path, ec), fs::last_write_time(path, ec)};
  if (const auto known = known_.find(identity); known != known_.end()) return known->second;
  EMBERLOCK_ASSIGN_OR_RETURN(FileHash hash, hash_file(path, observer));
  return known_.emplace(std::move(identity), std::move(hash)).first->second;
}

Result<v1::VolumeCertificate> origin_of(const fs::path& input, const SceneOptions& options,
                                        const std::vector<fs::path>& further, FileHashes* hashes,
                                        const Observer& observer) {
  v1::VolumeCertificate certificate;
  certificate.set_hashes_left_out(hashes == nullptr);
  const bool session = session::SessionReader::is_session(input);
  certificate.set_origin(session ? v1::VolumeCertificate::SESSION : v1::VolumeCertificate::PICTURES);
  const Observer first_half = part_of(observer, 0, 0.5);
  if (session)
    EMBERLOCK_RETURN_IF_ERROR(
        tell_session(input, options, hashes, first_half, *certificate.mutable_session()));
  if (hashes == nullptr) return certificate;
  std::set<fs::path> outside(further.begin(), further.end());
  for (const fs::path& file : files_of(input, options)) outside.insert(file);
  outside.erase(session ? input : fs::path());
  const Observer second_half = part_of(observer, 0.5, 1);
  HashesFiles hashed(*hashes, second_half, outside.size());
  for (const fs::path& path : outside)
    EMBERLOCK_RETURN_IF_ERROR(hashed.add(path, name_beside(input, path), *certificate.mutable_made_from()));
  return certificate;
}

Result<v1::VolumeCertificate> origin_of_export(const fs::path& vdb) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::optional<CertifiedVolume> source, check_volume(vdb));
  v1::VolumeCertificate certificate;
  certificate.set_origin(v1::VolumeCertificate::VOLUME);
  FileHashes hashes;
  const Observer nobody;
  HashesFiles hashed(hashes, nobody, 1);
  EMBERLOCK_RETURN_IF_ERROR(hashed.add(vdb, vdb.filename().string(), *certificate.mutable_made_from()));
  if (source) *certificate.mutable_exported() = std::move(source->certificate);
  return certificate;
}

void tell_reconstruction(const Report& report, v1::Reconstruction& told) {
  told.set_solver(report.solver);
  told.set_device(report.device.substr(0, report.device.find(':')));
  for (const int n : report.voxels) told.add_voxels(static_cast<std::uint32_t>(n));
  told.set_voxel_edge_m(report.voxel_edge.value());
  told.set_iterations(static_cast<std::uint32_t>(report.iterations));
  for (const EffectReport& effect : report.effects)
    if (effect.on) told.add_effects(effect.name);
  for (const double rmse : report.input_rmse) told.add_input_rmse(rmse);
  if (!report.heldout_rmse) return;
  for (const double rmse : *report.heldout_rmse) told.add_heldout_rmse(rmse);
}

}  // namespace emberlock::recon
