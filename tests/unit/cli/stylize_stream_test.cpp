// SPDX-License-Identifier: Apache-2.0
#include "cli/stylize_stream.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "base/unique_fd.h"
#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/stylized_flame.h"
#include "tests/support/typed_input.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The bytes of a bright disc's picture.
std::string disc(int edge) {
  const fs::path file = test::write_object(test::folder_for("disc") / "disc.png", edge,
                                           [](double x, double y) { return x * x + y * y < 1 ? 200 : 0; });
  std::string bytes = *read_file(file);
  fs::remove_all(file.parent_path());
  return bytes;
}

v1::EditRequest object_in(const std::string& view) {
  v1::EditRequest request;
  request.set_operation(R"({"op": "object", "position": [24, 18], "scale": 0.5, "view": ")" + view + "\"}");
  request.set_picture(disc(32));
  return request;
}

TEST(StylizeStream, AnObjectsPictureComesAsBytesAndItsNameIsOurs) {
  const fs::path folder = test::folder_for("bytes");
  v1::EditRequest request = object_in("view0.png");
  request.set_mask(disc(32));
  const auto operation = operation_of(request, folder);
  ASSERT_TRUE(operation) << operation.error().message();
  const auto& object = std::get<apply::ObjectEdit>(*operation);
  EXPECT_EQ(object.file.parent_path(), folder);
  EXPECT_EQ(object.file.extension(), ".png");
  EXPECT_EQ(*read_file(object.file), request.picture());
  EXPECT_EQ(*object.mask, object.file) << "the same bytes are the same file";
  fs::remove_all(folder);
}

TEST(StylizeStream, PathsAndWhatIsNoPictureAreRefused) {
  const fs::path folder = test::folder_for("refused");
  const auto refusal = [&](auto change) {
    v1::EditRequest request = object_in("view0.png");
    change(request);
    const auto operation = operation_of(request, folder);
    return operation ? std::string() : operation.error().message();
  };
  using Request = v1::EditRequest;
  EXPECT_THAT(
      refusal([](Request& r) {
        r.set_operation(R"({"op": "object", "view": "a", "position": [0, 0], "file": "/etc/passwd"})");
      }),
      HasSubstr("file: names a file"));
  EXPECT_TRUE(fs::is_empty(folder)) << "what is refused leaves nothing";
  EXPECT_THAT(refusal([](Request& r) { r.clear_picture(); }), HasSubstr("picture: is missing"));
  EXPECT_THAT(refusal([](Request& r) { r.set_picture("GIF89a"); }), HasSubstr("neither a PNG nor a JPEG"));
  EXPECT_THAT(refusal([](Request& r) { r.set_picture(r.picture().substr(0, 40)); }), HasSubstr("truncated"));
  EXPECT_THAT(refusal([](Request& r) {
                r.clear_picture();
                r.set_mask(disc(8));
              }),
              HasSubstr("without a picture"));
  EXPECT_THAT(refusal([](Request& r) {
                std::string large = r.picture();
                large[18] = '\x10';  // 4128 pixels wide, and nothing of it is decoded
                r.set_picture(large);
              }),
              HasSubstr("4128 x 32"));
  fs::remove_all(folder);
}

/// Everything that was told.
std::vector<v1::ChildMessage> messages_in(const fs::path& file) {
  std::vector<v1::ChildMessage> messages;
  session::ChildMessageParser parser;
  EXPECT_TRUE(parser.add(*read_file(file),
                         [&](v1::ChildMessage&& message) { messages.push_back(std::move(message)); }));
  return messages;
}

class StylizeByRequests : public testing::Test {
 protected:
  StylizeByRequests() : folder_(test::folder_for("requests")) {
    recon::PaperSceneOptions options;
    options.image = {48, 36};
    options.truth_voxels = 16;
    EXPECT_TRUE(test::write_scene(recon::paper_scene(options), folder_ / "scene").ok());
  }
  ~StylizeByRequests() override { fs::remove_all(folder_); }
  [[nodiscard]] test::VerbRun run(const fs::path& out, const std::vector<std::string>& further) const {
    std::vector<std::string> words = {"stylize",
                                      (folder_ / "scene/transforms.json").string(),
                                      "--out",
                                      out.string(),
                                      "--effects",
                                      "none",
                                      "--device",
                                      "cpu",
                                      "--keep-poses",
                                      "--voxels",
                                      "12"};
    words.insert(words.end(), further.begin(), further.end());
    return test::run_verb(add_stylize, words);
  }
  /// What is told while these are asked for.
  std::vector<v1::ChildMessage> ask(const std::vector<v1::EditRequest>& requests) const {
    std::string bytes;
    for (const v1::EditRequest& request : requests) bytes += session::framed(request);
    const test::TypedInput typed(bytes);
    const UniqueFd told(::open((folder_ / "told").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600));
    const test::VerbRun done =
        run(folder_ / "out", {"--passes", "3", "--progress-fd", std::to_string(told.get())});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return messages_in(folder_ / "told");
  }
  fs::path folder_;
};

TEST_F(StylizeByRequests, EachIsAnsweredInTurnAndTheResultReplaysToTheSameBits) {
  v1::EditRequest undo;
  undo.set_operation(R"({"op": "undo"})");
  v1::EditRequest look;
  look.set_view("view3.png");
  const auto told =
      ask({object_in("view0.png"), object_in("nowhere.png"), look, undo, undo, object_in("view1.png")});
  std::vector<v1::ChildMessage::Edited> answers;
  std::vector<v1::IterationPreview> previews;
  for (const v1::ChildMessage& message : told) {
    if (message.has_edited()) answers.push_back(message.edited());
    if (message.has_iteration() && message.iteration().has_stylization())
      previews.push_back(message.iteration());
  }
  ASSERT_EQ(answers.size(), 6U);
  EXPECT_EQ(answers[0].taken().steps(), 1U);
  EXPECT_EQ(answers[0].taken().views_size(), 11);
  EXPECT_THAT(answers[1].refused().what(), HasSubstr("no view of this scene"));
  EXPECT_EQ(answers[2].taken().view(), "view3.png");
  EXPECT_EQ(answers[3].taken().undone(), 1U);
  EXPECT_THAT(answers[4].refused().what(), HasSubstr("nothing to undo"));
  EXPECT_EQ(answers[5].taken().steps(), 1U);
  ASSERT_GE(previews.size(), 2U);
  EXPECT_EQ(previews.front().stylization().view(), "view0.png");
  EXPECT_TRUE(previews.front().stylization().pauses()) << "there is nothing to do yet";
  EXPECT_EQ(previews.back().camera_id(), "view3.png");
  EXPECT_FALSE(previews.back().rendered_jpeg().empty());
  EXPECT_TRUE(told.back().has_done());
  // The one that was refused left no picture, and both others share theirs.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out/objects"), fs::directory_iterator()), 1);
  const test::VerbRun again = run(folder_ / "again", {"--edits", (folder_ / "out/edits.json").string()});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(recon::read_volume(folder_ / "again/volume.vdb")->emission,
            recon::read_volume(folder_ / "out/volume.vdb")->emission);
}

TEST_F(StylizeByRequests, WhereTheCameraSeesAPlaceIsToldWithItsViews) {
  recon::PaperSceneOptions options;
  options.image = {48, 36};
  options.truth_voxels = 16;
  const recon::Scene scene = recon::paper_scene(options);
  const auto told = ask({});
  const auto first = std::find_if(told.begin(), told.end(), [](const v1::ChildMessage& message) {
    return message.has_iteration() && message.iteration().has_stylization();
  });
  ASSERT_NE(first, told.end());
  const auto& views = first->iteration().stylization().views();
  ASSERT_EQ(views.size(), static_cast<int>(scene.views.size()));
  const Eigen::Vector3d place(0.02, -0.03, 0.04);
  for (int v = 0; v < views.size(); ++v) {
    ASSERT_EQ(views[v].pixel_from_world_size(), 12);
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(
        views[v].pixel_from_world().data());
    const Eigen::Vector2d pixel = (matrix * place.homogeneous()).hnormalized();
    EXPECT_LT((pixel - scene.views[static_cast<std::size_t>(v)].camera.project(place)).norm(), 0.01) << v;
  }
}

}  // namespace
}  // namespace emberlock::cli
