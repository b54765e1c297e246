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

/// Another process that has this file open, links followed; none where nobody has, or where we may not look.
std::optional<Holder> holder_of(const std::filesystem::path& device);

/// The same of a socket, by its inode as /proc/net lists it.
std::optional<Holder> holder_of_socket(const std::string& inode);

/// The error of a device that another process has, naming it where it can be.
Error held_error(const std::filesystem::path& device, const std::string& where);

}  // namespace emberlock::drivers
