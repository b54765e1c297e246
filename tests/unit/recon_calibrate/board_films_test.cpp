// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/board_films.h"

#include <gmock/gmock.h>

#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using testing::ElementsAre;

// A "board" of two corners whose first pixel's grey says where it is: 0 is nowhere.
BoardSearch search_by_grey() {
  return {{BoardKind::charuco, 2, 1}, [](const ImageView& picture) -> std::vector<BoardCorner> {
            const double x = picture.sample(0, 0);
            if (x == 0) return {};
            return {{0, {x, 10}}, {1, {x + 5, 10}}};
          }};
}

constexpr ImageLayout kSmall{{64, 48}, PixelFormat::gray8, 8};

/// A session of cameras whose frames' greys are told; -1 is a frame that the camera lost.
void record_greys(const std::filesystem::path& folder, const std::vector<std::vector<int>>& cameras) {
  auto writer = value_of(session::SessionWriter::create(
      folder, test::manifest_of(std::vector<ImageLayout>(cameras.size(), kSmall)),
      test::small_disk_options()));
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (std::size_t i = 0; i < cameras[c].size(); ++i) {
      if (cameras[c][i] < 0) continue;
      Frame frame = test::noise_frame(kSmall, i);
      Image image(kSmall);
      image.row_as<std::uint8_t>(0)[0] = static_cast<std::uint8_t>(cameras[c][i]);
      frame.image = std::make_shared<const Image>(std::move(image));
      ASSERT_TRUE(writer.write(c, frame).ok());
    }
  }
  ASSERT_TRUE(writer.finish().ok());
}

TEST(BoardFilms, InstantsWhereTheBoardStandsAreTakenOncePerPose) {
  const test::TempFolder folder;
  // Stands, jumps, stands, jumps away; the other camera lost a frame.
  record_greys(folder / "film", {{20, 20, 20, 60, 60, 60, 0, 0}, {0, 30, 30, 90, -1, 90, 90, 0}});
  const auto reading = value_of(find_boards_in_session(folder / "film", search_by_grey()));
  ASSERT_TRUE(reading.film);
  EXPECT_EQ(reading.film->instants, 8U);
  EXPECT_EQ(reading.film->looked, 8U);
  EXPECT_EQ(reading.film->seen, 7U);
  EXPECT_EQ(reading.film->taken, 2U);
  const BoardSightings& s = reading.sightings;
  EXPECT_THAT(s.instants, ElementsAre("1", "3")) << "both cameras see these; the rest shows the same";
  ASSERT_EQ(s.cameras.size(), 2U);
  EXPECT_EQ(s.cameras[1].id, "cam1");
  ASSERT_EQ(s.sightings.size(), 4U);
  EXPECT_EQ(s.sightings[0].corners[0].pixel.x(), 20);
  for (const auto& sighting : s.sightings) EXPECT_LT(sighting.instant, 2U);
}

TEST(BoardFilms, AFrameIsNotTakenForAnotherInstants) {
  const test::TempFolder folder;
  record_greys(folder / "film", {{20, 20, 20, 20}, {-1, -1, 50, 50}});
  const auto reading =
      value_of(find_boards_in_session(folder / "film", search_by_grey(), {.looks = 1, .stillness = 0}));
  ASSERT_EQ(reading.sightings.instants.size(), 1U);
  EXPECT_EQ(reading.sightings.instants[0], "2") << "the other camera has no frame before";
}

TEST(BoardFilms, ABoardThatAlwaysMovesIsAnErrorThatSaysByHowMuch) {
  const test::TempFolder folder;
  record_greys(folder / "film", {{20, 23, 26, 29, 32}});
  EXPECT_THAT(find_boards_in_session(folder / "film", search_by_grey()),
              FailsWith("by 3.0 pixels a frame", "--still"));
  const auto allowed =
      value_of(find_boards_in_session(folder / "film", search_by_grey(), {.stillness = 3.1}));
  EXPECT_EQ(allowed.film->taken, 5U);
  const auto fewer = value_of(
      find_boards_in_session(folder / "film", search_by_grey(), {.instants = 2, .looks = 2, .stillness = 0}));
  EXPECT_EQ(fewer.film->looked, 4U);
  EXPECT_EQ(fewer.film->taken, 2U);
}

TEST(BoardFilms, AFilmWithoutABoardIsAnError) {
  const test::TempFolder folder;
  record_greys(folder / "film", {{0, 0, 0}});
  EXPECT_THAT(find_boards_in_session(folder / "film", search_by_grey()),
              FailsWith("found at none of 3 instants"));
  EXPECT_FALSE(find_boards_in_session(folder / "nothing", search_by_grey()).ok());
}

TEST(BoardFilms, InstantsAreSpreadOverThePicture) {
  BoardSightings sightings;
  sightings.cameras = {{"a", {80, 60}}, {"b", {80, 60}}};
  const std::vector<double> places = {0, 1, 40, 41, 79, 20};
  for (std::size_t i = 0; i < places.size(); ++i) {
    sightings.instants.push_back(std::to_string(i));
    sightings.sightings.push_back({0, i, "", {{0, {places[i], 0}}}});
  }
  sightings.sightings.push_back({1, 2, "", {{0, {5, 5}}}});  // two cameras see this one
  EXPECT_THAT(spread_instants(sightings, 3), ElementsAre(0, 2, 4));
  EXPECT_THAT(spread_instants(sightings, 4), ElementsAre(0, 2, 4, 5));
  EXPECT_THAT(spread_instants(sightings, 100), ElementsAre(0, 1, 2, 3, 4, 5))
      << "all differ by 1 of 100 pixels";
}

}  // namespace
}  // namespace emberlock::recon
