// SPDX-License-Identifier: Apache-2.0
// The sound track of a video file, as loud as it is and when it is.
#include "session/media/sound.h"

#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>

#include "base/image.h"
#include "tests/support/recording.h"
#include "tests/support/sound_writer.h"
#include "tests/support/video_writer.h"

namespace emberlock::session {
namespace {

class SoundOfAVideo : public testing::Test {
 protected:
  void SetUp() override {
    test::VideoWriter writer(folder_ / "mute.mkv", {32, 32}, {});
    for (int i = 0; i < 48; ++i) writer.write(Image({.size = {32, 32}}));
    writer.close();
  }
  test::TempFolder folder_;
};

TEST_F(SoundOfAVideo, IsLoudWhereItClapsCountedFromTheFirstFrame) {
  for (const double begin : {0.0, 0.25}) {
    test::add_sound(folder_ / "mute.mkv", folder_ / "loud.mkv", test::claps({0.7}, 1.5, 16000), 16000,
                    Seconds(begin));
    const auto sound = read_sound(folder_ / "loud.mkv");
    ASSERT_TRUE(sound.ok()) << sound.error().message();
    const auto loudest = std::max_element(sound->levels.begin(), sound->levels.end());
    const double at = sound->begin.value() + 1e-3 * static_cast<double>(loudest - sound->levels.begin());
    EXPECT_NEAR(at, begin + 0.7, 0.003);
    EXPECT_GT(*loudest, 0.1);
    EXPECT_LT(sound->levels[600], 0.02);
  }
}

TEST_F(SoundOfAVideo, ThatHasNoneIsEmptyAndOfNoVideoAnError) {
  const auto mute = read_sound(folder_ / "mute.mkv");
  ASSERT_TRUE(mute.ok()) << mute.error().message();
  EXPECT_TRUE(mute->levels.empty());
  std::ofstream(folder_ / "notes.txt") << "not a video at all, but quite a long text";
  EXPECT_FALSE(read_sound(folder_ / "notes.txt").ok());
  EXPECT_FALSE(read_sound(folder_ / "absent.mkv").ok());
}

}  // namespace
}  // namespace emberlock::session
