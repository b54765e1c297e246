// SPDX-License-Identifier: Apache-2.0
#include "recon/batch/plan.h"

#include <algorithm>
#include <exception>
#include <functional>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "recon/batch/whole_number.h"

namespace emberlock::recon {
namespace {

constexpr const char* kFormat = "emberlock batch";

std::string range_of(const std::vector<std::uint64_t>& frames) {
  const std::uint64_t every = frames.size() > 1 ? frames[1] - frames[0] : 1;
  return fmt::format("{}:{}{}", frames.front(), frames.back(),
                     every > 1 ? fmt::format(", each of {}", every) : "");
}

std::string given(const std::map<std::string, std::string>& options, const std::string& name) {
  const auto found = options.find(name);
  return found == options.end() ? "not given" : "\"" + found->second + "\"";
}

}  // namespace

int usual_chunk(std::size_t frames) {
  constexpr std::size_t kChunks = 64;
  return static_cast<int>(std::clamp<std::size_t>((frames + kChunks - 1) / kChunks, 5, 20));
}

std::vector<Chunk> chunks_of(const BatchPlan& plan) {
  std::vector<Chunk> chunks;
  const auto size = static_cast<std::size_t>(plan.chunk);
  for (std::size_t i = 0; i < plan.frames.size(); i += size) {
    const auto first = plan.frames.begin() + static_cast<std::ptrdiff_t>(i);
    const auto count = static_cast<std::ptrdiff_t>(std::min(size, plan.frames.size() - i));
    Chunk chunk{"", {first, first + count}};
    chunk.name = fmt::format("{:07}-{:07}", chunk.frames.front(), chunk.frames.back());
    chunks.push_back(std::move(chunk));
  }
  return chunks;
}

std::string to_json(const BatchPlan& plan) {
  const nlohmann::ordered_json json = {
      {"format", kFormat},   {"version", 1},          {"input", plan.input},     {"session", plan.session},
      {"chunk", plan.chunk}, {"voxels", plan.voxels}, {"options", plan.options}, {"frames", plan.frames}};
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Result<BatchPlan> parse_plan(std::string_view text, const std::string& where) try {
  const auto json = nlohmann::json::parse(text);
  if (json.at("format") != kFormat || json.at("version") != 1)
    return Error{ErrorKind::bad_input, "is not a batch's plan of this version", where, "Give another --out"};
  BatchPlan plan;
  json.at("input").get_to(plan.input);
  json.at("session").get_to(plan.session);
  plan.chunk = whole_number<int>(json.at("chunk"));
  plan.voxels = whole_number<int>(json.at("voxels"));
  json.at("options").get_to(plan.options);
  for (const auto& frame : json.at("frames")) plan.frames.push_back(whole_number<std::uint64_t>(frame));
  const bool rising =
      std::adjacent_find(plan.frames.begin(), plan.frames.end(), std::greater_equal<>()) == plan.frames.end();
  if (plan.frames.empty() || !rising || plan.chunk < 1 || plan.voxels < 1)
    return Error{ErrorKind::bad_input, "holds no frames, or numbers out of range", where,
                 "Give another --out"};
  return plan;
} catch (const std::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where, "Give another --out"};
}

std::string other_option(const std::map<std::string, std::string>& before,
                         const std::map<std::string, std::string>& now) {
  std::set<std::string> names;
  for (const auto& options : {before, now})
    for (const auto& [name, value] : options) names.insert(name);
  for (const std::string& name : names)
    if (given(before, name) != given(now, name))
      return fmt::format("{} was {}, and is {}", name, given(before, name), given(now, name));
  return {};
}

Status same_run(const BatchPlan& planned, const BatchPlan& asked, const std::string& where) {
  const auto differs = [&](std::string what) -> Status {
    return Error{ErrorKind::bad_input, std::move(what), where,
                 "Give what that run was given, to go on with it, or another --out"};
  };
  if (planned.session != asked.session)
    return differs(fmt::format("holds a batch of another session: {} ({})", planned.input, planned.session));
  if (planned.frames != asked.frames)
    return differs(
        fmt::format("holds a batch of frames {}, not {}", range_of(planned.frames), range_of(asked.frames)));
  if (asked.chunk != 0 && planned.chunk != asked.chunk)
    return differs(fmt::format("holds a batch in chunks of {} frames, not {}", planned.chunk, asked.chunk));
  const std::string other = other_option(planned.options, asked.options);
  return other.empty() ? Status() : differs("holds a batch of other options: " + other);
}

}  // namespace emberlock::recon
