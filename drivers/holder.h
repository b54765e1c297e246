// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"

namespace emberlock::drivers {

/// A process that has a device open.
struct Holder {
  int pid = 0;
  std::string program;  ///< as the kernel names it: "gvfsd-gphoto2"
};

/// Another process that has this file open (links are followed). nullopt if there is none, or if it may not
/// be inspected.
std::optional<Holder> holder_of(const std::filesystem::path& device);

/// The same for a socket, given its inode as listed in /proc/net.
std::optional<Holder> holder_of_socket(const std::string& inode);

/// The error for a device that another process holds; names the process if possible.
Error held_error(const std::filesystem::path& device, const std::string& where);

}  // namespace emberlock::drivers
