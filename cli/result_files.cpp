// SPDX-License-Identifier: Apache-2.0
#include "cli/result_files.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <iterator>
#include <numeric>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "report/sequence_report.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFrame = "frame-";

/// N of a folder "frame-N".
std::optional<std::uint64_t> frame_of(const fs::path& folder) {
  const std::string name = folder.filename().string();
  if (!name.starts_with(kFrame)) return std::nullopt;
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data() + kFrame.size(), name.data() + name.size(), number);
  return error == std::errc() && end == name.data() + name.size() ? std::optional(number) : std::nullopt;
}

std::vector<ResultVolume> frames_in(const fs::path& folder) {
  std::vector<ResultVolume> volumes;
  std::error_code ec;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ec)) {
    const auto frame = frame_of(entry.path());
    const fs::path file = entry.path() / "volume.vdb";
    if (frame && fs::is_regular_file(file, ec)) volumes.push_back({file, frame});
  }
  std::sort(volumes.begin(), volumes.end(),
            [](const ResultVolume& a, const ResultVolume& b) { return a.frame < b.frame; });
  return volumes;
}

/// Those that were tried; nothing where no frames.json tells.
std::vector<std::uint64_t> told_frames(const fs::path& result) {
  std::vector<std::uint64_t> frames;
  const fs::path path = result / "sequence" / "frames.json";
  const auto text = read_file(path);
  if (!text) return frames;
  if (const auto told = report::parse_sequence(*text, path.string()))
    for (const report::SequenceFrame& frame : told->frames) frames.push_back(frame.frame);
  return frames;
}

/// From the first to the last in the widest steps that meet all of them.
std::vector<std::uint64_t> even_steps(std::span<const std::uint64_t> rising) {
  std::uint64_t step = 0;
  for (const std::uint64_t number : rising) step = std::gcd(step, number - rising.front());
  std::vector<std::uint64_t> frames(rising.begin(), rising.begin() + 1);
  while (frames.back() < rising.back()) frames.push_back(frames.back() + step);
  return frames;
}

}  // namespace

std::vector<std::uint64_t> missing_frames(const fs::path& result, std::span<const ResultVolume> volumes) {
  std::vector<std::uint64_t> there, missing;
  for (const ResultVolume& volume : volumes)
    if (volume.frame) there.push_back(*volume.frame);
  if (there.empty()) return missing;
  std::vector<std::uint64_t> all = told_frames(result);
  if (all.empty()) all = even_steps(there);
  std::set_difference(all.begin(), all.end(), there.begin(), there.end(), std::back_inserter(missing));
  return missing;
}

std::string numbers_in_words(std::span<const std::uint64_t> numbers) {
  std::string words;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t end = i + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    if (!words.empty()) words += ", ";
    words += fmt::format("{}", numbers[i]);
    if (end - i > 1) words += fmt::format("{}{}", end - i > 2 ? ".." : ", ", numbers[end - 1]);
    i = end;
  }
  return words;
}

bool is_sequence(const fs::path& result) {
  std::error_code ec;
  return fs::is_directory(result, ec) && !fs::is_regular_file(result / "volume.vdb", ec);
}

void warn_of_missing(std::span<const std::uint64_t> missing) {
  if (missing.empty()) return;
  const bool one = missing.size() == 1;
  std::fprintf(stderr, "%-16s %s %s %s missing\n", "warning", one ? "frame" : "frames",
               numbers_in_words(missing).c_str(), one ? "is" : "are");
}

Result<std::vector<ResultVolume>> volumes_of(const fs::path& result) {
  std::error_code ec;
  const fs::path file = fs::is_directory(result, ec) ? result / "volume.vdb" : result;
  if (fs::is_regular_file(file, ec)) {
    const fs::path place = fs::canonical(file, ec).parent_path();  // where a link of a sequence leads
    return std::vector{ResultVolume{file, frame_of(place)}};
  }
  std::vector<ResultVolume> volumes = frames_in(result);
  if (!volumes.empty()) return volumes;
  const bool there = fs::exists(result, ec);
  return Error{ErrorKind::bad_input, there ? "has no volume.vdb and no frame-N/volume.vdb" : "isn't there",
               result.string(), "Name a folder that `emberlock reconstruct` wrote, or a volume.vdb"};
}

std::string reported(const fs::path& result, const char* key) {
  std::error_code ec;
  const fs::path folder =
      fs::is_directory(result, ec) ? result : fs::weakly_canonical(result, ec).parent_path();
  const auto text = read_file(folder / "report.json");
  const auto json = nlohmann::json::parse(text ? *text : std::string(), nullptr, false);
  const bool tells = json.is_object() && json.contains(key) && json[key].is_string();
  return tells ? json[key].get<std::string>() : std::string();
}

}  // namespace emberlock::cli
