// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/console_sessions.h"

#include <algorithm>
#include <utility>

#include <openssl/sha.h>

#include "rig/access.h"

namespace emberlock::daemon {

// Secrets are looked up by their digest, so that the duration of the search reveals nothing.
ConsoleSessions::Digest ConsoleSessions::digest_of(std::string_view secret) {
  Digest digest{};
  SHA256(reinterpret_cast<const unsigned char*>(secret.data()), secret.size(), digest.data());
  return digest;
}

void ConsoleSessions::serve_at(std::string url) {
  const std::lock_guard lock(mutex_);
  url_ = std::move(url);
}

Result<std::string> ConsoleSessions::make_link(TimePoint now) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string secret, rig::random_secret());
  const std::lock_guard lock(mutex_);
  if (url_.empty())
    return Error{ErrorKind::refused, "this daemon serves no console", "console",
                 "say http_listen = \"127.0.0.1:7140\" in [server] of its configuration"};
  links_.push_back({digest_of(secret), now});
  if (links_.size() > kMostLinks) links_.pop_front();
  return url_ + "/open?link=" + secret;
}

std::optional<std::string> ConsoleSessions::follow(std::string_view link, TimePoint now) {
  const Digest digest = digest_of(link);
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(links_.begin(), links_.end(), [&](const Link& one) { return one.digest == digest; });
  if (found == links_.end()) return std::nullopt;
  const bool in_time = now - found->made <= kLinkLife;
  links_.erase(found);
  return in_time ? open_locked(now) : std::nullopt;
}

std::optional<std::string> ConsoleSessions::open(TimePoint now) {
  const std::lock_guard lock(mutex_);
  return open_locked(now);
}

std::optional<std::string> ConsoleSessions::open_locked(TimePoint now) {
  auto secret = rig::random_secret();
  if (!secret) return std::nullopt;
  sessions_.push_front({digest_of(*secret), ++opened_, now});
  if (sessions_.size() > kMostSessions) sessions_.pop_back();
  return std::move(*secret);
}

std::optional<std::uint64_t> ConsoleSessions::find(std::string_view secret, TimePoint now) {
  if (secret.empty()) return std::nullopt;
  const Digest digest = digest_of(secret);
  const std::lock_guard lock(mutex_);
  while (!sessions_.empty() && now - sessions_.back().shown > kSessionLife) sessions_.pop_back();
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [&](const Session& one) { return one.digest == digest; });
  if (found == sessions_.end()) return std::nullopt;
  found->shown = now;
  sessions_.splice(sessions_.begin(), sessions_, found);
  return found->number;
}

}  // namespace emberlock::daemon
