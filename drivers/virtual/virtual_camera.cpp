// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/virtual_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/log.h"
#include "base/random.h"

namespace emberlock::drivers {
namespace {

enum CameraStream : std::uint64_t {
  kPhaseStream = 11,
  kJitterStream = 12,
  kDeviceClockStream = 13,
  kCrystalStream = 14
};

constexpr double kRounding = 1e-6;    // in counted periods, because instants are whole nanoseconds
constexpr Seconds kLongestWait{1e8};  // keeps instants within 64 bits

std::string_view model(SensorKind kind) {
  switch (kind) {
    case SensorKind::ccd:
      return "Emberlock virtual CCD";
    case SensorKind::rolling_shutter:
      return "Emberlock virtual rolling shutter";
    case SensorKind::global_shutter:
      return "Emberlock virtual global shutter";
  }
  return "Emberlock virtual";
}

}  // namespace

VirtualRoom::VirtualRoom(std::shared_ptr<Clock> clock, const VirtualRigOptions& rig)
    : clock_(std::move(clock)),
      strobe_(std::make_shared<StrobeTimeline>(rig.strobe.rate_error)),
      opened_(clock_->now()) {
  if (rig.light && !rig.light->leads) {
    follower_ = std::make_unique<LightFollower>(rig.light->file, clock_, strobe_);
  }
  set_scene(rig.scene);
}

std::vector<LightPulse> VirtualRoom::light(TimePoint origin, Seconds from, Seconds to) const {
  if (follower_) follower_->look();
  return strobe_->light(origin, from, to);
}

void VirtualRoom::set_scene(VirtualScene scene) {
  const std::lock_guard lock(mutex_);
  scenes_.push_back({clock_->now(), std::make_shared<const VirtualScene>(std::move(scene))});
}

std::shared_ptr<const VirtualScene> VirtualRoom::scene_at(TimePoint t) const {
  const std::lock_guard lock(mutex_);
  const auto after = std::upper_bound(scenes_.begin() + 1, scenes_.end(), t,
                                      [](TimePoint v, const Change& c) { return v < c.at; });
  return (after - 1)->scene;
}

VirtualCamera::VirtualCamera(VirtualCameraOptions options, int number, const VirtualRigOptions& rig,
                             std::shared_ptr<const VirtualRoom> room)
    : options_(std::move(options)),
      room_(std::move(room)),
      info_{.id = options_.id,
            .model = std::string(model(options_.sensor)),
            .layout = options_.layout,
            .frame_rate = options_.nominal_rate,
            .reset = options_.reset,
            .trim = options_.trim,
            .sensor = options_.sensor,
            .transport = options_.transport},
      sensor_(options_, number, rig.seed),
      seed_(stream_seed(rig.seed, options_.id)),
      crystal_(options_.wander, mix64(seed_ ^ kCrystalStream)),
      queue_frames_(static_cast<std::uint64_t>(rig.queue_frames)),
      wall_at_zero_(rig.wall_at_zero),
      device_origin_(1000 * random_uniform(seed_, kDeviceClockStream, 0)),
      period_(options_.timing.frame_period) {}

Status VirtualCamera::start() {
  if (filming_) return {};
  Seconds phase = options_.timing.frame_period * random_uniform(seed_, kPhaseStream, draws_++);
  if (cycles_.empty() && options_.first_phase) phase = *options_.first_phase;
  begin_cycle(room_->clock().now() + phase, next_id_);
  filming_ = true;
  return {};
}

Status VirtualCamera::reset_shutter(TimePoint at) {
  const auto refuse = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::device, std::move(what), "camera " + info_.id, std::move(remedy)};
  };
  if (info_.reset == ShutterReset::none) {
    return refuse("its shutter can't be reset", "choose a camera whose reset is by_hand or on_command");
  }
  if (!filming_) return refuse("it does not film", "start() it before resetting its shutter");
  at = std::max(at, room_->clock().now());
  const std::uint64_t draw = draws_++;
  const Seconds drawn = info_.reset == ShutterReset::by_hand
                            ? options_.timing.frame_period * random_uniform(seed_, kPhaseStream, draw)
                            : options_.reset_jitter * random_normal(seed_, kJitterStream, draw);
  const Seconds latency = std::max(Seconds(0), options_.reset_latency + drawn);
  // The old cycle runs until `at`; its frames read until then are counted and dropped.
  const std::uint64_t first_wanted = read_by(at);
  counts_.passed_over += first_wanted - next_id_;
  begin_cycle(at + latency, first_wanted);
  log(LogCategory::drivers).debug("{}: shutter reset {}", info_.id, draw);
  return {};
}

Status VirtualCamera::trim_rate(PartsPerMillion trim) {
  const auto refuse = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::device, std::move(what), "camera " + info_.id, std::move(remedy)};
  };
  if (!info_.trim) return refuse("its frame rate can't be trimmed", "choose a camera whose rate can be");
  if (!(abs(trim) <= info_.trim->range)) {
    return refuse("its frame rate can't be trimmed by " + std::to_string(trim.value()) + " ppm",
                  "stay within +-" + std::to_string(info_.trim->range.value()) + " ppm");
  }
  const double rounded = std::round(trim / info_.trim->step) * info_.trim->step.value();
  period_ = options_.timing.frame_period / (1 + rounded * 1e-6);
  if (cycles_.empty()) return {};
  const Cycle now = cycles_.back();
  const TimePoint from = room_->clock().now() + info_.trim->latency - now.period / 2;
  const double reads = std::max(0.0, std::ceil(counted(now.start, from) / now.period));
  cycles_.push_back({read_start(now, reads), now.first_id + static_cast<std::uint64_t>(reads), period_});
  log(LogCategory::drivers).debug("{}: trimmed by {} ppm", info_.id, rounded);
  return {};
}

void VirtualCamera::begin_cycle(TimePoint start, std::uint64_t first_id) {
  cycles_.push_back({start, first_id, period_});
  next_id_ = first_id;
}

Seconds VirtualCamera::counted(TimePoint from, TimePoint to) const {
  return to - from + (crystal_.steady() ? Seconds(0) : crystal_.ahead(to) - crystal_.ahead(from));
}

TimePoint VirtualCamera::read_start(const Cycle& cycle, double i) const {
  const TimePoint by_count = cycle.start + cycle.period * i;
  if (crystal_.steady()) return by_count;
  // Fixed-point iteration: rates differ by millionths, so each step leaves a millionth of the error.
  TimePoint at = by_count;
  for (int step = 0; step < 3; ++step) at = by_count - (crystal_.ahead(at) - crystal_.ahead(cycle.start));
  return at;
}

TimePoint VirtualCamera::read_start(std::uint64_t frame_id) const {
  if (cycles_.empty()) return {};
  const auto after = std::upper_bound(cycles_.begin() + 1, cycles_.end(), frame_id,
                                      [](std::uint64_t id, const Cycle& c) { return id < c.first_id; });
  return read_start(*(after - 1), frame_id);
}

TimePoint VirtualCamera::read_start_after(TimePoint after) const {
  if (cycles_.empty()) return {};
  const Cycle& cycle = cycles_.back();
  return read_start(cycle, std::max(0.0, std::ceil(counted(cycle.start, after) / cycle.period)));
}

TimePoint VirtualCamera::read_end(std::uint64_t frame_id) const { return read_start(frame_id) + shifting(); }

std::uint64_t VirtualCamera::read_by(TimePoint t) const {
  // A cycle ends where the next one begins.
  std::uint64_t end = std::numeric_limits<std::uint64_t>::max();
  for (auto cycle = cycles_.rbegin(); cycle != cycles_.rend(); ++cycle) {
    const auto read_end = [&](std::uint64_t id) { return read_start(*cycle, id) + shifting(); };
    const double periods = std::floor(counted(read_end(cycle->first_id), t) / cycle->period - kRounding);
    auto next = cycle->first_id + static_cast<std::uint64_t>(std::max(0.0, periods));
    while (read_end(next) <= t) ++next;  // corrects for the rounding of instants to nanoseconds
    if (next > cycle->first_id) return std::min(next, end);
    end = cycle->first_id;
  }
  return end;
}

void VirtualCamera::drop_overflow() {
  const std::uint64_t delivered = read_by(room_->clock().now() - options_.transport);
  if (delivered <= next_id_ + queue_frames_) return;
  const std::uint64_t oldest = delivered - queue_frames_;
  log(LogCategory::drivers).debug("{}: {} frames lost, the queue was full", info_.id, oldest - next_id_);
  counts_.queue += oldest - next_id_;
  next_id_ = oldest;
}

Result<Frame> VirtualCamera::next_frame(Seconds deadline) {
  if (!filming_) {
    return Error{ErrorKind::device, "it does not film", "camera " + info_.id, "start() it first"};
  }
  const Seconds wait = std::min(std::max(Seconds(0), deadline), kLongestWait);
  Clock& clock = room_->clock();
  const TimePoint until = clock.now() + wait;
  const TimePoint ready = read_end(next_id_) + options_.transport;
  if (ready > until) {
    clock.sleep_until(until);
    return Error{ErrorKind::timed_out, "no frame within " + std::to_string(wait.value()) + " s",
                 "camera " + info_.id,
                 "wait longer than a frame period, and after a reset longer than its latency"};
  }
  clock.sleep_until(ready);
  drop_overflow();
  ++counts_.delivered;
  return draw(next_id_++);
}

std::uint64_t VirtualCamera::pass_over(TimePoint until) {
  if (!filming_) return 0;
  const std::uint64_t first_wanted =
      std::max(next_id_, read_by(std::min(until, room_->clock().now()) - options_.transport));
  const std::uint64_t dropped = first_wanted - std::exchange(next_id_, first_wanted);
  counts_.passed_over += dropped;
  return dropped;
}

std::shared_ptr<const VirtualScene> VirtualCamera::scene_of(std::uint64_t frame_id) const {
  return room_->scene_at(read_start(frame_id));
}

std::vector<LightPulse> VirtualCamera::light_on(std::uint64_t frame_id) const {
  const smear::CcdTiming& t = options_.timing;
  return room_->light(read_start(frame_id), -t.frame_period, Rows(t.shifts) * t.row_time);
}

Seconds VirtualCamera::exposure(const VirtualScene& scene) const {
  if (options_.exposure) return *options_.exposure;
  return scene.exposure > Seconds(0) ? scene.exposure : options_.timing.frame_period;
}

Frame VirtualCamera::draw(std::uint64_t frame_id) {
  const TimePoint begin = read_start(frame_id);
  const auto scene = scene_of(frame_id);
  const Seconds exposed = exposure(*scene);
  Image image = sensor_.expose(scene, light_on(frame_id), {frame_id, begin - exposed, exposed});

  const TimePoint arrival = read_end(frame_id) + options_.transport;
  // The camera's clock uses the same crystal as its frames.
  const double own_rate = 1 / (options_.nominal_rate * options_.timing.frame_period);
  FrameStamp stamp;
  stamp.frame_id = frame_id;
  stamp.device_time = TimePoint{} + (device_origin_ + counted(room_->opened(), begin) * own_rate);
  stamp.system_time = {wall_at_zero_.ns + arrival.ns};
  stamp.monotonic_time = arrival;
  return {stamp, std::make_shared<const Image>(std::move(image))};
}

}  // namespace emberlock::drivers
