// SPDX-License-Identifier: Apache-2.0
// A key of the configuration that nothing reads is a promise that isn't kept. Whether one is read is told
// from the sources: a file beside the configuration's own must name both the section and the key's member, or
// the options of another folder that the member belongs to.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::rig {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = EMBERLOCK_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return std::move(text).str();
}

/// What the table sets: {"server", "message_bytes"}, {"rig", "strobe", "request", "baud"}; of one camera
/// {"size"}.
std::vector<std::vector<std::string>> members_of_the_table() {
  static const std::regex pattern(R"(EMBERLOCK_AT\(([a-z][a-z_.>-]*)\))");
  std::string table;
  for (const char* part : {"table.cpp", "table_camera.cpp", "table_rig.cpp"})
    table += text_of(kRoot / "rig/config" / part);
  std::vector<std::vector<std::string>> members;
  for (std::sregex_iterator at(table.begin(), table.end(), pattern), end; at != end; ++at) {
    const std::string path = std::regex_replace((*at)[1].str(), std::regex("->"), ".");
    if (path == "member") continue;  // the macro itself
    std::vector<std::string>& parts = members.emplace_back();
    std::istringstream stream(path);
    for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  }
  return members;
}

std::vector<std::string> sources() {
  std::vector<std::string> texts;
  for (const char* folder : {"daemon", "drivers", "rig", "session", "smear_sync"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const bool is_source = entry.path().extension() == ".cpp" || entry.path().extension() == ".h";
      if (is_source && entry.path().parent_path() != kRoot / "rig/config")
        texts.push_back(text_of(entry.path()));
    }
  }
  return texts;
}

bool has_member(const std::string& text, const std::string& name) {
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const char before = at == 0 ? ' ' : text[at - 1];
    const char after = at + name.size() < text.size() ? text[at + name.size()] : ' ';
    const bool ends = std::isalnum(static_cast<unsigned char>(after)) == 0 && after != '_';
    if (ends && (before == '.' || before == '>')) return true;
  }
  return false;
}
/// Of "log": "config.log", or a LogConfig.
bool has_section(const std::string& text, std::string name) {
  if (has_member(text, name)) return true;
  name[0] = static_cast<char>(std::toupper(name[0]));
  return text.find(name + "Config") != std::string::npos;
}

TEST(ConfigUse, EveryKeyIsReadByWhatItSpeaksTo) {
  const auto members = members_of_the_table();
  const std::vector<std::string> texts = sources();
  ASSERT_GT(members.size(), 60U);
  for (const auto& parts : members) {
    const bool nested = parts.size() > 2;  // options of another folder's, handed on whole
    const bool read = std::any_of(texts.begin(), texts.end(), [&](const std::string& text) {
      return has_member(text, parts.back()) && (nested || parts.size() == 1 || has_section(text, parts[0]));
    });
    EXPECT_TRUE(read) << ::testing::PrintToString(parts);
  }
}

}  // namespace
}  // namespace emberlock::rig
