// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace emberlock::paper {

/// A picture of one channel taken apart by scale and orientation (Simoncelli and Freeman 1995, "The Steerable
/// Pyramid"), all bands at full size: a high pass, octaves of four orientations each, a low pass. The squares
/// of the filters add up to one, so that applying each again and adding up gives the picture back. Pictures
/// are padded with black to a size that transforms fast; that is the size of the bands.
class SteerablePyramid {
 public:
  /// Of pictures of this size; at least 8 x 8.
  SteerablePyramid(int width, int height);

  static constexpr int kOrientations = 4;
  [[nodiscard]] std::size_t bands() const { return filters_.size(); }
  /// The band of an octave (0 is the finest) for waves whose crests are turned by orientation * 45 degrees
  /// from the vertical.
  [[nodiscard]] static std::size_t band(int octave, int orientation);

  [[nodiscard]] std::vector<std::vector<float>> analyse(const std::vector<float>& picture) const;
  [[nodiscard]] std::vector<float> synthesise(const std::vector<std::vector<float>>& bands) const;

 private:
  struct Filter {
    std::vector<float> gain;  ///< at the frequencies of the transform
    bool odd = false;         ///< times i: real, though the gain changes its sign with the frequency
  };
  int width_, height_;  ///< of pictures
  int across_, down_;   ///< padded
  std::vector<Filter> filters_;
};

/// Gives values the distribution of `rising`, which is sorted and has as many: the nth smallest becomes the
/// nth. Equal values stay equal: they become the mean of theirs.
void match_histogram(std::vector<float>& values, const std::vector<float>& rising);

}  // namespace emberlock::paper
