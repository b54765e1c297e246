// SPDX-License-Identifier: Apache-2.0
// Who only reconstructs: configured without drivers and daemon, nothing includes or links what they need.
// Nothing is compiled here.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;

const fs::path kRoot = EMBERLOCK_SOURCE_DIR;

/// Lines of a source that this build's compiler sees, as far as EMBERLOCK_WITH_DRIVERS and _DAEMON say, both
/// 0.
std::vector<std::string> seen_lines(const fs::path& source) {
  std::vector<std::string> seen;
  std::vector<bool> hidden;  // one a nested #if
  std::ifstream in(source);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#if"))
      hidden.push_back(line == "#if EMBERLOCK_WITH_DRIVERS" || line == "#if EMBERLOCK_WITH_DAEMON");
    if (line.starts_with("#else") && !hidden.empty()) hidden.back() = false;
    if (line.starts_with("#endif") && !hidden.empty()) hidden.pop_back();
    if (std::ranges::find(hidden, true) == hidden.end()) seen.push_back(line);
  }
  return seen;
}

/// Adds what `source` includes in quotation marks, and what that includes.
void collect_headers(const fs::path& source, std::set<std::string>& headers) {
  for (const std::string& line : seen_lines(source)) {
    if (!line.starts_with("#include \"")) continue;
    const std::string header = line.substr(10, line.rfind('"') - 10);
    if (headers.insert(header).second) collect_headers(kRoot / header, headers);
  }
}

class WithoutDevices : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    temp_ = std::make_unique<test::TempFolder>(test::TempFolder::On::disk);
    const Shell configured = shell(
        "cmake -G Ninja -DCMAKE_BUILD_TYPE=Release -DEMBERLOCK_DRIVERS=OFF -DEMBERLOCK_DAEMON=OFF "
        "-DEMBERLOCK_CUDA=OFF -DEMBERLOCK_SOURCES_AS_ONE=1 -S " EMBERLOCK_SOURCE_DIR " -B " +
        temp_->path().string() + "");
    ASSERT_EQ(configured.status, 0) << configured.output;
  }
  static void TearDownTestSuite() { temp_.reset(); }
  static inline std::unique_ptr<test::TempFolder> temp_;
};

TEST_F(WithoutDevices, NoSourceIncludesWhatIsNotThere) {
  std::ifstream file(*temp_ / "compile_commands.json");
  int sources = 0;
  for (const auto& command : nlohmann::json::parse(file)) {
    const fs::path source = command["file"].get<std::string>();
    const std::string from_root = fs::relative(source, kRoot).string();
    if (from_root.starts_with("..") || from_root.starts_with("tests") || from_root.starts_with("build"))
      continue;
    ++sources;
    std::set<std::string> headers{from_root};
    collect_headers(source, headers);
    for (const std::string& header : headers)
      for (const char* absent : {"drivers/", "rig/", "daemon/", "emberlock/v1/services.grpc.pb.h"})
        EXPECT_FALSE(header.starts_with(absent)) << from_root << " comes to " << header;
  }
  EXPECT_GT(sources, 200);
}

TEST_F(WithoutDevices, NoTargetLinksTheirLibraries) {
  std::ifstream file(*temp_ / "links.txt");
  std::map<std::string, std::set<std::string>> links;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string target;
    words >> target;
    for (std::string link; words >> link;) links[target].insert(link);
  }
  EXPECT_TRUE(links.contains("emberlock_recon_core"));
  EXPECT_TRUE(links["emberlock_verbs"].contains("emberlock::cli"));
  for (const auto& [target, linked] : links)
    for (const std::string& each : linked)
      for (const char* absent : {"ARAVIS", "LIBUSB", "LIBSERIALPORT", "UDEV", "LIBSYSTEMD", "gRPC", "grpc",
                                 "OpenSSL::SSL", "TOMLPLUSPLUS", "::drivers", "::rig", "::daemon"})
        EXPECT_EQ(each.find(absent), std::string::npos) << target << " links " << each;
}

}  // namespace
}  // namespace emberlock
