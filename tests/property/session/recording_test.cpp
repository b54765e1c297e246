// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recording.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "session/index.h"
#include "session/layout.h"
#include "session/reader.h"
#include "session/writer.h"

namespace emberlock::session {
namespace {

ImageLayout any_layout() {
  const auto format = *rc::gen::element(PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                        PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16);
  const int bits = bytes_per_sample(format) == 1 ? 8 : *rc::gen::inRange(9, 17);
  return {{*rc::gen::inRange(2, 70), *rc::gen::inRange(2, 70)}, format, bits};
}

RC_GTEST_PROP(RecordingLaws, WhatIsWrittenIsReadInAnyOrderAtAnyStamps, ()) {
  const test::TempFolder temp;
  const ImageLayout layout = any_layout();
  WriterOptions options = test::small_disk_options(*rc::gen::element(Encoding::ffv1, Encoding::raw_nut));
  options.frames_per_segment = *rc::gen::inRange<std::uint64_t>(1, 6);
  const auto stamps = *rc::gen::container<std::vector<FrameStamp>>(rc::gen::map(
      rc::gen::tuple(rc::gen::arbitrary<std::uint64_t>(), rc::gen::arbitrary<std::int64_t>(),
                     rc::gen::arbitrary<std::int64_t>(),
                     rc::gen::inRange<std::int64_t>(-1'000'000'000'000, 1'000'000'000'000),
                     rc::gen::element(FrameStatus::complete, FrameStatus::damaged)),
      [](const auto& t) {
        return FrameStamp{
            std::get<0>(t), {std::get<1>(t)}, {std::get<2>(t)}, {std::get<3>(t)}, std::get<4>(t)};
      }));
  auto writer = SessionWriter::create(temp / "s", test::manifest_of({layout}), options);
  RC_ASSERT(writer.ok());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    Frame frame = test::noise_frame(layout, i);
    frame.stamp = stamps[i];
    RC_ASSERT(writer->write(0, frame).ok());
  }
  RC_ASSERT(writer->finish().ok());
  auto reader = SessionReader::open(temp / "s");
  RC_ASSERT(reader.ok());
  RC_ASSERT(reader->stamps(0) == stamps);
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    const auto i = *rc::gen::inRange<std::size_t>(0, stamps.size());
    const auto frame = reader->read(0, i);
    RC_ASSERT(frame.ok());
    RC_ASSERT(*frame->image == *test::noise_frame(layout, i).image);
  }
}

RC_GTEST_PROP(RecordingLaws, LayoutsSurviveTheManifest, ()) {
  const ImageLayout layout = any_layout();
  v1::CameraStream stream;
  set_layout(stream, layout);
  const auto back = layout_of(stream);
  RC_ASSERT(back.ok());
  RC_ASSERT(*back == layout);
}

RC_GTEST_PROP(RecordingLaws, AnyBytesBehindTheHeaderOfAnIndexAreTakenWithoutHarm,
              (const std::vector<char>& junk)) {
  const auto parsed = parse_index(encode_index_header() + std::string(junk.begin(), junk.end()), "index.bin");
  RC_ASSERT(parsed.ok());
  RC_ASSERT(parsed->records.size() + parsed->bad_records == junk.size() / kIndexRecordBytes);
  RC_ASSERT(parsed->torn_bytes == junk.size() % kIndexRecordBytes);
}

RC_GTEST_PROP(RecordingLaws, ArrivalsAndGapsFillTheRangeOfIds, ()) {
  auto ids = *rc::gen::unique<std::vector<std::uint32_t>>(rc::gen::arbitrary<std::uint32_t>());
  RC_PRE(!ids.empty());
  std::sort(ids.begin(), ids.end());
  Arrivals arrivals;
  for (const std::uint32_t id : ids) arrivals.add(id);
  RC_ASSERT(arrivals.delivered() + arrivals.missing() == std::uint64_t{ids.back()} - ids.front() + 1);
}

}  // namespace
}  // namespace emberlock::session
