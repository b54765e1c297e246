// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"
#include "emberlock/v1/child.pb.h"
#include "recon/export/temperature_look_up.h"
#include "recon/pipeline/live_run.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::cli {

/// Reports the progress of a reconstruction, or pictures with a flame, to another program, as
/// v1::ChildMessages on a descriptor. When nobody reads any more, reports are dropped and the work continues.
class ProgressStream {
 public:
  /// `fd` stays open and belongs to the caller. From here on this process is killed when its parent dies, and
  /// ignores SIGPIPE.
  static Result<ProgressStream> open(int fd);

  void loading(recon::Device device);
  /// Every volume from here on comes with temperatures, looked up by its colours.
  void look_up(recon::TemperatureLookUp temperatures) { temperatures_ = std::move(temperatures); }
  void progress(double fraction, std::string_view doing);
  /// Sends the numbers at once, and pictures only when they are due, so that they take at most a twentieth of
  /// the solve's time.
  void iteration(const recon::Preview& preview, const recon::Scene& scene,
                 const recon::ComputeOptions& compute);
  /// What a stylization shows: the picture of `status.view` as edited, the volume as that view sees it, and,
  /// if it is given, the volume.
  void stylized(const v1::StylizationStatus& status, const v1::Iteration& iteration,
                const recon::RadianceImage& edited, const recon::RadianceImage& rendered,
                const recon::Volume* volume);
  void edited(const v1::ChildMessage::Edited& edited);
  /// With temperatures and errors as far as the outcome has them.
  void done(const recon::Outcome& outcome, const recon::Scene& scene, const std::string& folder);
  /// done() without its pictures.
  void written(const recon::Report& report, const std::string& folder);
  void failed(const Error& error);
  void live(const recon::LiveVolume& live);
  void ar_picture(v1::ArPicture picture);
  /// Nobody reads any more.
  [[nodiscard]] bool broken() const { return broken_; }

 private:
  using Clock = std::chrono::steady_clock;

  explicit ProgressStream(int fd) : fd_(fd) {}
  void send(const v1::ChildMessage& message);

  int fd_;
  bool broken_ = false;
  std::optional<recon::TemperatureLookUp> temperatures_;
  Clock::time_point pictures_due_;
};

}  // namespace emberlock::cli
