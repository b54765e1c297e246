// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/exported_file.h"

#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "daemon/server/http_request.h"

namespace emberlock::daemon {
namespace {

constexpr std::string_view kExports = "/exports/";
constexpr std::string_view kVideo = "/video/";

bool is_file_name(std::string_view name) {
  return !name.empty() && name.front() != '.' && name.find('/') == std::string_view::npos &&
         name.find('\0') == std::string_view::npos;
}

bool is_plain(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' ||
         c == '.';
}

}  // namespace

std::optional<ExportedFile> open_exported(const ExportFolder& folder_of, std::string_view path) {
  if (!folder_of || !path.starts_with(kExports)) return std::nullopt;
  path.remove_prefix(kExports.size());
  const std::size_t video = path.find(kVideo);
  if (video == std::string_view::npos) return std::nullopt;
  const auto session = unescape(path.substr(0, video));
  auto name = unescape(path.substr(video + kVideo.size()));
  if (!session || !name || !is_file_name(*session) || !is_file_name(*name)) return std::nullopt;
  const auto named = folder_of(*session);
  if (!named) return std::nullopt;
  const UniqueFd folder(::open(named->c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!folder) return std::nullopt;
  // A pipe is opened at once too, and then refused.
  UniqueFd file(::openat(folder.get(), name->c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat is {};
  if (!file || ::fstat(file.get(), &is) != 0 || !S_ISREG(is.st_mode)) return std::nullopt;
  const std::string_view type = name->ends_with(".mp4") ? "video/mp4" : "application/octet-stream";
  return ExportedFile{std::move(file), *std::move(name), type};
}

std::string attachment(std::string_view name) {
  std::string ascii, escaped;
  for (const char c : name) {
    ascii += is_plain(c) || c == ' ' ? c : '_';
    escaped += is_plain(c) ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return fmt::format("attachment; filename=\"{}\"; filename*=UTF-8''{}", ascii, escaped);
}

}  // namespace emberlock::daemon
