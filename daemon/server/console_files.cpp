// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/console_files.h"

#include <array>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <openssl/sha.h>

#include "base/file.h"

namespace emberlock::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
}};

std::string_view type_of(const std::string& extension) {
  for (const auto& [known, type] : kTypes) {
    if (extension == known) return type;
  }
  return "application/octet-stream";
}

std::string tag_of(const std::string& content) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(content.data()), content.size(), digest.data());
  std::string tag = "\"";
  for (std::size_t i = 0; i < 12; ++i) tag += fmt::format("{:02x}", digest[i]);
  return tag + '"';
}

}  // namespace

Result<ConsoleFiles> ConsoleFiles::read(const fs::path& folder) {
  ConsoleFiles console;
  std::error_code error;
  std::size_t bytes = 0;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (!entry->is_regular_file() || entry->is_symlink()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(std::string content, read_file(entry->path(), kLargest));
    bytes += content.size();
    if (bytes > kLargest)
      return Error{ErrorKind::bad_input, "more than a console holds", folder.string(),
                   "name the folder that the console was built into"};
    const std::string name = "/" + fs::relative(entry->path(), folder).generic_string();
    // The build includes a hash of their content in these file names.
    const bool hashed = name.starts_with("/assets/");
    File file{.content = std::move(content),
              .type = type_of(entry->path().extension().string()),
              .tag = {},
              .caching = hashed ? "public, max-age=31536000, immutable" : "no-cache"};
    file.tag = tag_of(file.content);
    console.files_.emplace(name, std::move(file));
  }
  if (error)
    return Error{ErrorKind::io, error.message(), folder.string(), "install the console, or name its folder"};
  return console;
}

const ConsoleFiles::File* ConsoleFiles::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? std::string_view("/index.html") : path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace emberlock::daemon
