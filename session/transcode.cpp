// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <system_error>
#include <utility>

#include "base/in_parallel.h"
#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/rewrite.h"
#include "session/salvage.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// Replaces one uncompressed segment. The reader prefers the compressed file as soon as it exists.
Status transcode_segment(const fs::path& folder, const v1::CameraStream& stream, CameraReader& reader,
                         std::size_t first, std::size_t end, const Observer& observer) {
  const std::uint32_t number = reader.records()[first].segment;
  const fs::path raw = folder / segment_name(stream.camera_id(), number, Encoding::raw_nut);
  const fs::path target = folder / segment_name(stream.camera_id(), number, Encoding::ffv1);
  std::error_code ec;
  if (!fs::exists(raw, ec)) return {};
  if (fs::exists(target, ec)) {  // by an interrupted run, or foreign: must be readable
    const std::span records(reader.records());
    Status whole = read_back(target, reader.layout(), records.subspan(first, end - first), observer);
    if (!whole && whole.error().kind == ErrorKind::refused) return whole;
    fs::remove(whole ? raw : target, ec);
    if (whole) return {};
  }
  SegmentRewrite rewrite{{}, Encoding::ffv1, Hertz(stream.frame_rate_hz())};
  for (std::size_t i = first; i < end; ++i) rewrite.frames.push_back(i);
  EMBERLOCK_RETURN_IF_ERROR(rewrite_segment(reader, rewrite, target, observer));
  fs::remove(raw, ec);
  return {};
}

Status transcode_camera(const fs::path& folder, v1::CameraStream& stream, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, read_index(folder, stream.camera_id()));
  CameraReader reader(folder, stream.camera_id(), layout, std::move(index.records));
  const auto& records = reader.records();
  const auto count = static_cast<double>(records.size());
  for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
    end = end_of_segment(records, first);
    EMBERLOCK_RETURN_IF_ERROR(transcode_segment(
        folder, stream, reader, first, end,
        part_of(observer, static_cast<double>(first) / count, static_cast<double>(end) / count)));
  }
  list_segments(folder, records, stream);
  return {};
}

}  // namespace

Status transcode(const fs::path& folder, const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(read_manifest(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  // Who held it before may have written it.
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  if (manifest.state() == v1::Manifest::RECORDING) {
    return Error{ErrorKind::bad_input, "the recording isn't finished", folder.string(), "Salvage it first"};
  }
  const auto cameras = static_cast<std::size_t>(manifest.cameras_size());
  EMBERLOCK_RETURN_IF_ERROR(in_parallel(cameras, observer, [&](std::size_t i, const Observer& seen) {
    return transcode_camera(folder, *manifest.mutable_cameras(static_cast<int>(i)), seen);
  }));
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  static_cast<void>(observe(observer, 1, "compressed"));
  return {};
}

}  // namespace emberlock::session
