// SPDX-License-Identifier: Apache-2.0
// Consoles that watch: what they are told, and that one that stalls, talks nonsense or goes costs the others
// nothing.
#include <algorithm>
#include <map>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/http_server.h"
#include "tests/support/wait.h"
#include "tests/support/watch_client.h"

namespace emberlock::daemon {
namespace {

using nlohmann::json;
using test::wait_until;
using test::WatchClient;
using testing::HasSubstr;

class ServerWatchThreads : public test::HttpServerTest {
 protected:
  void serve(HttpServerOptions options = {}) { HttpServerTest::serve(with_token(std::move(options))); }
  std::shared_ptr<const v1::Picture> picture(const std::string& camera, std::uint64_t frame,
                                             std::size_t bytes = 1000) {
    auto made = std::make_shared<v1::Picture>();
    made->set_camera_id(camera);
    made->set_frame_id(frame);
    made->set_jpeg(std::string(bytes, 'j'));
    return made;
  }
  /// The next of these as JSON; empty once the server ended.
  static json text(WatchClient& client) {
    while (const auto message = client.hear()) {
      if (message->opcode == 1) return json::parse(message->bytes);
    }
    return {};
  }
  struct Binary {
    json header;
    std::string bytes;
  };
  static Binary split(const std::string& message) {
    std::uint32_t size = 0;
    for (unsigned i = 0; i < 4; ++i)
      size |= static_cast<std::uint32_t>(static_cast<unsigned char>(message[i])) << 8 * i;
    return {json::parse(message.substr(4, size)), message.substr(4 + size)};
  }
  static Binary binary(WatchClient& client) {
    while (const auto message = client.hear()) {
      if (message->opcode == 2) return split(message->bytes);
    }
    return {};
  }
  /// Whether it is told that the rig is locked.
  static bool hears_of_the_lock(WatchClient& client) {
    json told = text(client);
    while (told.is_object() && told["status"]["phase"] != "LOCKED") told = text(client);
    return told.is_object();
  }
};

TEST_F(ServerWatchThreads, TheHistoryOfRoundsIsToldWhenItChangedAndNotWithEveryStatus) {
  v1::DaemonStatus status;
  const auto add_round = [&](std::uint32_t round) {
    v1::RoundPoint& point = *status.mutable_alignment()->add_history();
    point.set_round(round);
    point.set_at_s(round);
  };
  add_round(1);
  add_round(2);
  api.board().show(status);
  serve();
  WatchClient console(port);
  EXPECT_EQ(text(console)["rounds"]["history"].size(), 2U);
  const json first = text(console);
  EXPECT_TRUE(first.contains("status"));
  EXPECT_FALSE(first["status"]["alignment"].contains("history"));
  status.set_reason("Nothing new of rounds.");
  api.board().show(status);
  EXPECT_EQ(text(console)["status"]["reason"], "Nothing new of rounds.");
  add_round(3);
  api.board().show(status);
  EXPECT_EQ(text(console)["rounds"]["history"][2]["round"], 3);
  EXPECT_TRUE(text(console).contains("status"));
  status.mutable_alignment()->clear_history();  // as the next alignment begins
  api.board().show(status);
  EXPECT_EQ(text(console)["rounds"], json::object());
}

TEST_F(ServerWatchThreads, AConsoleIsToldWhatIsAndWhatChanges) {
  show(v1::IDLE);
  api.board().notice(v1::GREEN, "Started.");
  serve();
  WatchClient console(port);
  ASSERT_TRUE(console.open());
  EXPECT_EQ(text(console)["status"]["phase"], "IDLE");
  EXPECT_EQ(text(console)["notice"]["text"], "Started.");
  show(v1::ALIGNING);
  EXPECT_EQ(text(console)["status"]["phase"], "ALIGNING");
}

TEST_F(ServerWatchThreads, PicturesComeWhileTheyAreWantedAndOfTheCamerasWanted) {
  show(v1::IDLE);
  serve();
  WatchClient console(port);
  text(console);
  EXPECT_FALSE(api.board().pictures_wanted());
  console.say(R"({"watch": {"camera_ids": ["b"], "rate_hz": 10}})");
  ASSERT_TRUE(wait_until([&] { return api.board().pictures_wanted(); }));
  api.board().show(picture("a", 1));
  api.board().show(picture("b", 2));
  const Binary shown = binary(console);
  EXPECT_EQ(shown.header, json({{"kind", "picture"},
                                {"camera_id", "b"},
                                {"frame_id", 2},
                                {"monotonic_ns", 0},
                                {"width", 0},
                                {"height", 0}}));
  EXPECT_EQ(shown.bytes, std::string(1000, 'j'));
  console.say(R"({"watch": null})");
  EXPECT_TRUE(wait_until([&] { return !api.board().pictures_wanted(); }));
}

TEST_F(ServerWatchThreads, AnIterationComesAsNumbersThenPicturesThenTheVolume) {
  serve();
  auto preview = std::make_shared<v1::IterationPreview>();
  preview->set_reconstruction("r");
  preview->mutable_iteration()->set_iteration(3);
  preview->set_frame(12);
  preview->set_camera_id("CAM 1");
  preview->set_captured_jpeg("captured");
  preview->set_rendered_jpeg("rendered");
  preview->mutable_volume()->set_nx(2);
  preview->mutable_volume()->mutable_box()->add_size(0.5);
  preview->mutable_volume()->set_voxels("voxels");
  v1::VolumeLayer& layer = *preview->mutable_volume()->add_layers();
  layer.set_kind(v1::VolumeLayer::TEMPERATURE);
  layer.set_low(1400);
  layer.set_high(1900);
  layer.set_quick(true);
  layer.set_voxels("kelvin");
  api.board().show(preview);
  WatchClient console(port);
  json numbers = text(console);
  while (!numbers.contains("iteration")) numbers = text(console);
  EXPECT_EQ(
      numbers,
      json::parse(
          R"({"iteration":{"reconstruction":"r","iteration":{"iteration":3},"camera_id":"CAM 1","frame":"12"}})"));
  const Binary captured = binary(console);
  EXPECT_EQ(captured.header["kind"], "captured");
  EXPECT_EQ(captured.header["camera_id"], "CAM 1");
  EXPECT_EQ(captured.bytes, "captured");
  EXPECT_EQ(binary(console).header["kind"], "rendered");
  const Binary volume = binary(console);
  EXPECT_EQ(volume.header["nx"], 2);
  EXPECT_EQ(volume.header["box"]["size"][0], 0.5);
  EXPECT_EQ(volume.header["layers"],
            json::parse(R"([{"kind": "TEMPERATURE", "low": 1400, "high": 1900, "quick": true}])"));
  EXPECT_EQ(volume.bytes, "voxelskelvin");
}

TEST_F(ServerWatchThreads, WhoTalksNonsenseIsPutOutAndTheOthersStay) {
  serve();
  WatchClient other(port);
  for (const std::string& nonsense :
       {std::string("{"), std::string("{\"watch\": 3}"), std::string("{\"watch\": {\"rate_hz\": -1}}"),
        std::string(), std::string(100'000, '{')}) {
    WatchClient console(port);
    console.say(nonsense);
    while (console.hear()) continue;  // until it is put out
  }
  {
    WatchClient console(port);
    console.say("{\"watch\": null}", 2);  // as binary
    while (console.hear()) continue;
  }
  ASSERT_TRUE(wait_until([&] { return server->viewers() == 1; }));
  show(v1::LOCKED);
  EXPECT_TRUE(hears_of_the_lock(other));
}

// The newest always gets in; who makes room is told why, so that its page doesn't come back by itself.
TEST_F(ServerWatchThreads, BeyondTheMostConsolesOneThatNeverSaidWhatItWantsMakesRoom) {
  serve({.viewers = 2});
  WatchClient idle(port);
  WatchClient spoken(port);
  spoken.wish("{\"watch\": null}");
  WatchClient third(port);
  ASSERT_TRUE(third.open());
  EXPECT_EQ(server->viewers(), 2U);
  std::optional<WatchClient::Message> last;
  while (auto message = idle.hear()) last = std::move(message);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->opcode, 8);
  EXPECT_THAT(last->bytes, HasSubstr("another console was opened"));
  show(v1::LOCKED);
  EXPECT_TRUE(hears_of_the_lock(spoken)) << "who spoke stays";
}

TEST_F(ServerWatchThreads, AnotherSitesPageMayNotWatch) {
  serve();
  const WatchClient console(port, test::kLetIn + "Origin: http://evil.example\r\n");
  EXPECT_THAT(console.answer(), HasSubstr("403"));
}

TEST_F(ServerWatchThreads, AConsoleThatGivesNoSignOfLifeIsGone) {
  serve({.patience = milliseconds(200)});
  std::optional<WatchClient> silent;
  // A busy machine may be so slow that its request is cut off.
  ASSERT_TRUE(wait_until([&] { return silent.emplace(port).open(); }));
  EXPECT_TRUE(wait_until([&] { return server->viewers() == 0; }));
}

// 11 cameras, 50 consoles, of which one never reads. The others get every picture, and of those that the one
// missed nothing is kept.
TEST_F(ServerWatchThreads, OfFiftyConsolesOneStallsAndTheOthersSeeEverything) {
  constexpr std::size_t kConsoles = 49, kCameras = 11, kRounds = 15, kBytes = 40'000;
  serve();
  WatchClient stalled(port);
  stalled.wish(R"({"watch": {"rate_hz": 1000}})");
  std::vector<WatchClient> consoles;
  for (std::size_t i = 0; i < kConsoles; ++i) {
    consoles.emplace_back(port).wish(R"({"watch": {"rate_hz": 1000}})");
  }
  ASSERT_EQ(server->viewers(), kConsoles + 1);
  std::vector<std::weak_ptr<const v1::Picture>> shown;
  std::vector<std::map<std::string, std::uint64_t>> seen(kConsoles);
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    for (std::size_t camera = 0; camera < kCameras; ++camera) {
      const auto made = picture("camera " + std::to_string(camera), round, kBytes);
      shown.push_back(made);
      api.board().show(made);
    }
    ASSERT_TRUE(wait_until([&] {
      std::size_t whole = 0;
      for (std::size_t i = 0; i < kConsoles; ++i) {
        while (const auto message = consoles[i].hear_now()) {
          if (message->opcode != 2) continue;
          const json header = split(message->bytes).header;
          seen[i][header["camera_id"]] = header["frame_id"];
        }
        whole += seen[i].size() == kCameras &&
                 std::all_of(seen[i].begin(), seen[i].end(),
                             [&](const auto& camera) { return camera.second == round; });
      }
      return whole == kConsoles;
    })) << round;
  }
  // Of each camera at most: the newest, and the one that the stalled console was sent last.
  EXPECT_TRUE(wait_until([&] {
    return std::count_if(shown.begin(), shown.end(), [](const auto& one) { return !one.expired(); }) <=
           static_cast<std::ptrdiff_t>(2 * kCameras);
  }));
  EXPECT_EQ(server->viewers(), kConsoles + 1);
}

}  // namespace
}  // namespace emberlock::daemon
