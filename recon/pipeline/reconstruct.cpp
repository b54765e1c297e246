#include "recon/pipeline/reconstruct.h"

#include <new>
#include <system_error>

#include <fmt/format.h>

#include "base/file.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/planned_run.h"
#include "recon/preprocess/radiance.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMarker = "report.json";

}  // namespace

Result<Outcome> reconstruct(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                            const Progress& progress,
                            const std::function<void(const Preview&)>& preview) try {
  const TimePoint start = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.solve.compute.device));
  const Task task{scene, device, [&] { return clock.now() - start; }, preview};
  return has_goal(options) ? run_planned(task, options, progress) : run_settled(task, options, progress);
} catch (const DeviceError& e) {
  return e.error();
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "--voxels", "Give fewer voxels, or a smaller box"};
}

Status check_output(const fs::path& folder) {
  // Creating the staging folder and letting it go asks the same questions as the real thing.
  const auto probe = AtomicDirectory::create(folder, kMarker);
  return probe ? Status() : Status(probe.error());
}

Status write_outcome(const Outcome& outcome, const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(AtomicDirectory staging, AtomicDirectory::create(folder, kMarker));
  EMBERLOCK_RETURN_IF_ERROR(write_volume(outcome.reconstruction.volume, staging.path() / "volume.vdb"));
  std::error_code ec;
  fs::create_directory(staging.path() / "views", ec);
  for (std::size_t i = 0; i < outcome.renders.size(); ++i) {
    const std::string name = fmt::format("{:04}.png", i);
    EMBERLOCK_RETURN_IF_ERROR(write_png(to_rgb8(outcome.renders[i]).view(), staging.path() / "views" / name));
  }
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / kMarker, to_json(outcome.report)));
  return staging.commit();
}

}  // namespace emberlock
