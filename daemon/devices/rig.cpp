#include "daemon/devices/rig.h"

#include <utility>

#include "daemon/recordings/store.h"
#include "drivers/camera_thread.h"
#include "drivers/replay/record.h"

namespace emberlock {
namespace {

/// A camera that somebody else keeps, too.
class SharedCamera final : public Camera {
 public:
  explicit SharedCamera(std::shared_ptr<Camera> camera) : camera_(std::move(camera)) {}
  [[nodiscard]] const CameraInfo& info() const override { return camera_->info(); }
  [[nodiscard]] FrameCounts counts() const override { return camera_->counts(); }
  Status start() override { return camera_->start(); }
  void stop() override { camera_->stop(); }
  Result<Frame> next_frame(Seconds deadline) override { return camera_->next_frame(deadline); }
  std::uint64_t pass_over(TimePoint until) override { return camera_->pass_over(until); }
  Status reset_shutter(TimePoint at) override { return camera_->reset_shutter(at); }
  Status trim_rate(PartsPerMillion trim) override { return camera_->trim_rate(trim); }

 private:
  std::shared_ptr<Camera> camera_;
};

v1::CameraStatus::State shown(CameraThread::State state) {
  switch (state) {
    case CameraThread::State::idle:
      return v1::CameraStatus::STOPPED;
    case CameraThread::State::filming:
      return v1::CameraStatus::FILMING;
    case CameraThread::State::lost:
      return v1::CameraStatus::LOST;
    case CameraThread::State::quarantined:
      return v1::CameraStatus::QUARANTINED;
  }
  return v1::CameraStatus::STATE_UNSPECIFIED;
}

}  // namespace

Rig::Rig(RigParts parts, const CameraTap& tap) : parts_(std::move(parts)) {
  devices_.strobe = parts_.strobe.get();
  devices_.clock = parts_.clock.get();
  for (RigCamera& camera : parts_.cameras) {
    if (parts_.pace == Pace::by_itself) {
      CameraThreadOptions options;
      if (tap) {
        options.on_frame = [tap, info = camera.camera->info()](const Frame& frame) { tap(info, frame); };
      }
      camera.camera =
          std::make_shared<CameraThread>(std::make_unique<SharedCamera>(std::move(camera.camera)), options);
    }
    devices_.cameras.push_back(camera.camera.get());
  }
}

std::vector<std::string> Rig::camera_ids() const {
  std::vector<std::string> ids;
  for (const Camera* camera : devices_.cameras) ids.push_back(camera->info().id);
  return ids;
}

std::vector<v1::CameraStatus::State> Rig::camera_states() const {
  std::vector<v1::CameraStatus::State> states;
  for (const Camera* camera : devices_.cameras) {
    const auto* thread = dynamic_cast<const CameraThread*>(camera);
    states.push_back(thread != nullptr ? shown(thread->state()) : v1::CameraStatus::FILMING);
  }
  return states;
}

std::vector<CcdTiming> Rig::timing() const {
  std::vector<CcdTiming> timing;
  for (const RigCamera& camera : parts_.cameras) timing.push_back(camera.timing);
  return timing;
}

void Rig::describe(v1::Manifest& manifest) const {
  for (const RigCamera& camera : parts_.cameras) {
    v1::CameraStream& stream = *manifest.add_cameras();
    stream = to_proto(camera.camera->info());
    if (camera.calibration) *stream.mutable_calibration() = *camera.calibration;
  }
  if (parts_.box) *manifest.mutable_box() = *parts_.box;
}

double Rig::bytes_per_second(Encoding encoding) const {
  std::vector<CameraInfo> cameras;
  for (const Camera* camera : devices_.cameras) cameras.push_back(camera->info());
  return emberlock::bytes_per_second(cameras, encoding);
}

}  // namespace emberlock
