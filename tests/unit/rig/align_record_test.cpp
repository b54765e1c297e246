// SPDX-License-Identifier: Apache-2.0
// Which sessions are no alignment that can be replayed, and what their errors name.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/record.h"
#include "tests/support/recording.h"

namespace emberlock::rig {
namespace {

using testing::HasSubstr;
using testing::Not;

/// The error of a replay of a session that holds these notes, and no settings.
std::string replay_error(const std::vector<std::string>& notes) {
  const test::TempFolder temp;
  auto writer = session::SessionWriter::create(temp / "s", test::manifest_of({ImageLayout{{64, 48}}}));
  EXPECT_TRUE(writer.ok());
  for (const std::string& text : notes) {
    v1::Event note;
    note.set_note(text);
    EXPECT_TRUE(writer->append(note));
  }
  EXPECT_TRUE(writer->finish());
  const auto replayed = replay_align(temp / "s");
  EXPECT_FALSE(replayed.ok());
  if (replayed.ok()) return "";
  EXPECT_EQ(replayed.error().kind, ErrorKind::bad_input);
  return replayed.error().message();
}

TEST(AlignRecord, OneOfAVersionBefore020IsNamed) {
  for (const std::vector<std::string>& notes :
       {std::vector<std::string>{R"({"align": {"policy": "timed", "tolerance": 0.0011}})"},
        {"late frame: 3 0.5 a", R"({"align": null})"}}) {
    const std::string error = replay_error(notes);
    EXPECT_THAT(error, HasSubstr("before 0.2.0"));
    EXPECT_THAT(error, HasSubstr("eplay it with the version that recorded it"));
  }
}

TEST(AlignRecord, OtherNotesAreNoSettings) {
  for (const std::string& note :
       {std::string(), std::string("late frame: 3 0.5 a"), std::string("{\"align"),
        std::string("{\"aligned\": 1}"), std::string("[\"align\"]"), std::string(100'000, '[')}) {
    const std::string error = replay_error({note});
    EXPECT_THAT(error, HasSubstr("emberlock align --record")) << note.substr(0, 40);
    EXPECT_THAT(error, Not(HasSubstr("0.2.0"))) << note.substr(0, 40);
  }
}

}  // namespace
}  // namespace emberlock::rig
