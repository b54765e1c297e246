// SPDX-License-Identifier: Apache-2.0
// Parts of a leader's takes, as a host that lends its cameras names and finds them.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/clock.h"
#include "daemon/engine/finished_part.h"
#include "tests/support/small_daemon.h"

namespace emberlock::daemon {
namespace {

namespace fs = std::filesystem;

const Borrower kLeader{"dome at lab-1", "its certificate"};
const std::string kLongName(200, 'n');

v1::PartRequest part_request(const std::string& name, const std::string& session_id) {
  v1::PartRequest request;
  request.set_leader(kLeader.name);
  request.set_name(name);
  request.set_from_ns(SteadyClock().now().ns);
  request.set_alone_s(60);
  request.mutable_manifest()->set_session_id(session_id);
  request.mutable_manifest()->set_created_utc("2026-11-28T13:00:00Z");
  request.mutable_manifest()->set_purpose("flame");
  request.mutable_manifest()->set_led_by(kLeader.name);
  return request;
}

v1::FindPartRequest find_request(const std::string& name, const std::string& session_id) {
  v1::FindPartRequest request;
  request.set_leader(kLeader.name);
  request.set_name(name);
  request.set_session_id(session_id);
  return request;
}

TEST(Lending, ATakeIsRecordedWhateverHasItsNameAndFoundByIt) {
  const test::TempFolder temp;
  test::SmallDaemon daemon(test::small_config(temp.path()));
  const fs::path folder = daemon.config.recording.folder;
  const ImageLayout layout{{16, 12}, PixelFormat::gray8, 8};
  using Take = std::function<void(const fs::path&)>;
  const Take nothing = [](const fs::path&) {};
  const Take empty = [](const fs::path& at) { fs::create_directory(at); };
  const Take file = [](const fs::path& at) { test::put_bytes(at, "x"); };
  const Take notes = [](const fs::path& at) {
    fs::create_directory(at);
    test::put_bytes(at / "notes.txt", "x");
  };
  const Take link = [](const fs::path& at) { fs::create_symlink("nowhere", at); };
  const Take session = [&](const fs::path& at) { test::record(at, layout, 1, test::small_disk_options()); };
  const Take broken = [](const fs::path& at) {
    fs::create_directory(at);
    test::put_bytes(at / "manifest.json", "{");
  };
  struct Row {
    std::string name;
    std::vector<std::pair<std::string, Take>> taken;
    std::string becomes;
  };
  const std::vector<Row> rows{
      {"free", {{"free", nothing}}, "free"},
      {"fre\u0302sh", {{"free", nothing}}, "fr\u00eash"},
      {"empty", {{"empty", empty}}, "empty 2"},
      {"file", {{"file", file}}, "file 2"},
      {"notes", {{"notes", notes}}, "notes 2"},
      {"link", {{"link", link}}, "link 2"},
      {"session", {{"session", session}}, "session 2"},
      {"broken", {{"broken", broken}}, "broken 2"},
      {"two", {{"two", file}, {"two 2", empty}}, "two 3"},
      {"three", {{"three", session}, {"three 2", link}, {"three 3", notes}}, "three 4"},
      {"hole", {{"hole", empty}, {"hole 3", empty}}, "hole 2"},
      {"fre\u0301sh", {{"fr\u00e9sh", file}}, "fr\u00e9sh 2"},
      {"fr\u00e8sh", {{"fre\u0300sh", empty}}, "fr\u00e8sh 2"},
      {kLongName, {{kLongName, file}}, kLongName.substr(0, 198) + " 2"},
  };
  for (const Row& row : rows) {
    for (const auto& [name, take] : row.taken) take(folder / name);
    const std::string id = "id of " + row.name.substr(0, 20);
    const auto part = daemon.conductor->record_part(kLeader, part_request(row.name, id));
    ASSERT_TRUE(part.ok()) << row.name << ": " << part.error().message();
    EXPECT_EQ(part->session(), row.becomes);
    ASSERT_TRUE(daemon.conductor->stop_recording().ok()) << row.name;
    ASSERT_TRUE(daemon.reach(v1::IDLE)) << row.name;
    // Its answer was lost: the leader knows the take's name only.
    const auto found = find_finished_part(daemon.store, find_request(row.name, id));
    ASSERT_TRUE(found.ok()) << row.name << ": " << found.error().message();
    EXPECT_EQ(found->session(), row.becomes);
    EXPECT_EQ(find_finished_part(daemon.store, find_request(row.name, "another id")).error().kind,
              row.name == "broken" ? ErrorKind::bad_input : ErrorKind::out_of_data);
  }
  const Borrower twin{kLeader.name, "another certificate"};
  EXPECT_EQ(daemon.conductor->record_part(twin, part_request("twin", "id")).error().kind, ErrorKind::refused);
  EXPECT_EQ(daemon.conductor->find_running_part(twin, "id of free").error().kind, ErrorKind::refused);
}

}  // namespace
}  // namespace emberlock::daemon
