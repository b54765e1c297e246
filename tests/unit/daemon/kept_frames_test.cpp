// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/kept_frames.h"

#include <string>

#include <gmock/gmock.h>

namespace emberlock::daemon {
namespace {

v1::IterationPreview volume_of(std::uint64_t frame, std::size_t bytes) {
  v1::IterationPreview preview;
  preview.set_frame(frame);
  preview.set_captured_jpeg("captured");
  preview.mutable_volume()->set_voxels(std::string(bytes / 2, 'v'));
  preview.mutable_volume()->add_layers()->set_voxels(std::string(bytes / 2, 't'));
  return preview;
}

v1::FrameRequest request(const std::string& reconstruction, std::uint64_t frame) {
  v1::FrameRequest request;
  request.set_reconstruction(reconstruction);
  request.set_frame(frame);
  return request;
}

TEST(KeptFrames, AreFoundByReconstructionAndFrame) {
  KeptFrames frames;
  frames.begin("one");
  frames.keep(volume_of(12, 8));
  ASSERT_TRUE(frames.find(request("one", 12)));
  EXPECT_EQ(frames.find(request("one", 12))->volume().voxels(), "vvvv");
  EXPECT_EQ(frames.find(request("one", 12))->captured_jpeg(), "");
  EXPECT_FALSE(frames.find(request("one", 13)));
  EXPECT_FALSE(frames.find(request("two", 12)));
  frames.begin("two");
  EXPECT_FALSE(frames.find(request("two", 12)));
}

TEST(KeptFrames, BeyondTheBoundTheOldestGo) {
  KeptFrames frames(20);
  frames.begin("one");
  for (std::uint64_t frame = 0; frame < 3; ++frame) frames.keep(volume_of(frame, 8));
  EXPECT_FALSE(frames.find(request("one", 0)));
  EXPECT_TRUE(frames.find(request("one", 1)));
  EXPECT_TRUE(frames.find(request("one", 2)));
}

}  // namespace
}  // namespace emberlock::daemon
