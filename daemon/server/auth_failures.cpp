// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/auth_failures.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace emberlock::daemon {
namespace {

struct Words {
  Refusal refusal;
  std::string_view name;
  std::string_view said;
};
constexpr std::array<Words, kRefusals> kWords{{
    {Refusal::nothing_shown, "nothing_shown", "shows neither token nor cookie"},
    {Refusal::wrong_token, "wrong_token", "shows a wrong token"},
    {Refusal::wrong_link, "wrong_link", "follows a link that isn't valid, or isn't any more"},
    {Refusal::unknown_session, "unknown_session", "shows the cookie of no session that lasts"},
    {Refusal::foreign_host, "foreign_host", "asks by a foreign name (DNS rebinding?)"},
    {Refusal::foreign_origin, "foreign_origin", "asks from another site's page"},
}};

/// Whether a wrong secret was presented.
bool is_guess(Refusal refusal) {
  return refusal == Refusal::wrong_token || refusal == Refusal::wrong_link ||
         refusal == Refusal::unknown_session;
}

}  // namespace

std::string_view name_of(Refusal refusal) { return kWords[static_cast<std::size_t>(refusal)].name; }

AuthFailures::Source& AuthFailures::source_of(const std::string& name, TimePoint now) {
  const auto known = sources_.find(name);
  if (known == sources_.end() && sources_.size() >= kMostSources)
    sources_.erase(std::min_element(sources_.begin(), sources_.end(), [](const auto& a, const auto& b) {
      return a.second.last < b.second.last;
    }));
  Source& source = sources_[name];
  if (now - source.last > kForget) source.guesses = 0;
  source.last = now;
  return source;
}

AuthFailures::Outcome AuthFailures::note(std::string_view way, const std::string& name, Refusal refusal,
                                         TimePoint now) {
  const std::lock_guard lock(mutex_);
  ++counts_[std::string(way)][static_cast<std::size_t>(refusal)];
  // A browser that was never let in, or a monitor that tests the port, isn't logged.
  if (refusal == Refusal::nothing_shown) return {};
  Source& source = source_of(name, now);
  Outcome outcome;
  if (is_guess(refusal) && ++source.guesses > kFree) {
    const int doublings = std::min(source.guesses - kFree - 1, 30);
    outcome.delay = Seconds(std::min(kLongestDelay.value(), std::ldexp(kFirstDelay.value(), doublings)));
  }
  outcome.line = line_about(source, fmt::format("turned away by {}: {}", way, name), refusal, now);
  return outcome;
}

std::optional<std::string> AuthFailures::line_about(Source& source, const std::string& name, Refusal refusal,
                                                    TimePoint now) {
  if (source.logged && now - *source.logged < kLogApart) {
    ++source.unlogged;
    return std::nullopt;
  }
  if (minute_.ns == 0 || now - minute_ >= kLogApart) {
    minute_ = now;
    lines_ = 0;
  }
  if (++lines_ > kMostLines) {
    ++source.unlogged;
    return std::nullopt;
  }
  const std::uint64_t before = source.unlogged;
  source.unlogged = 0;
  source.logged = now;
  std::string line = fmt::format("{} {}", name, kWords[static_cast<std::size_t>(refusal)].said);
  if (before > 0) line += fmt::format("; it was turned away {} times since that was last said", before);
  return line;
}

std::map<std::string, std::array<std::uint64_t, kRefusals>> AuthFailures::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace emberlock::daemon
