// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <linux/fs.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

// Disks with a real file system, in files: the power is cut by taking the file as it is. For root alone, with
// loop devices.
namespace emberlock::test {

inline void must(const std::string& command) {
  const Shell done = shell(command + " 2>&1");
  if (done.status != 0) throw std::runtime_error(command + ": " + done.output);
}

/// From now on nobody else sees what this process mounts, and nothing stays mounted when it ends. Before any
/// thread is begun.
inline void mount_for_this_process_alone() {
  if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
    throw std::runtime_error("nobody but root may mount disks");
}

/// An ext4 in an image file, mounted as long as this lives.
class LoopDisk {
 public:
  enum class Image { fresh, as_it_is };
  /// `folder` gets NAME.img, of `mebibytes` where it is made, and the mount point NAME.
  LoopDisk(const std::filesystem::path& folder, const std::string& name, Image image, int mebibytes = 0,
           const std::string& options = "loop")
      : image_(folder / (name + ".img")), at_(folder / name) {
    if (image == Image::fresh) {
      must("truncate -s " + std::to_string(mebibytes) + "M " + image_.string());
      must("mkfs.ext4 -q -F -E lazy_itable_init=0,lazy_journal_init=0 " + image_.string());
    }
    std::filesystem::create_directories(at_);
    must("mount -o " + options + " " + image_.string() + " " + at_.string());
  }
  LoopDisk(const LoopDisk&) = delete;
  LoopDisk& operator=(const LoopDisk&) = delete;
  ~LoopDisk() {
    // A process that was killed lets go of its files when its writes are through.
    Shell done;
    const bool unmounted = wait_until([&] {
      done = shell("umount " + at_.string());
      return done.status == 0;
    });
    if (!unmounted) std::fprintf(stderr, "%s", done.output.c_str());
  }

  [[nodiscard]] const std::filesystem::path& image() const { return image_; }
  [[nodiscard]] const std::filesystem::path& at() const { return at_; }

 private:
  std::filesystem::path image_;
  std::filesystem::path at_;
};

/// Two disks, one in a file of the other. Freezing the outer one stops every write to the inner one's file at
/// one instant, so that a copy of it is what a power cut at that instant leaves.
class DiskToCut {
 public:
  DiskToCut(const std::filesystem::path& folder, int mebibytes)
      : folder_(folder),
        outer_(folder, "outer", LoopDisk::Image::fresh, mebibytes * 5 / 4 + 48),
        inner_(outer_.at(), "inner", LoopDisk::Image::fresh, mebibytes) {}

  [[nodiscard]] const std::filesystem::path& at() const { return inner_.at(); }

  /// Cuts the power, and mounts what is left, its journal replayed.
  [[nodiscard]] std::unique_ptr<LoopDisk> cut() const {
    const UniqueFd outer(::open(outer_.at().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (::ioctl(outer.get(), FIFREEZE, 0) != 0) throw std::runtime_error("cannot freeze the outer disk");
    const Shell copied = shell("cp --sparse=always " + inner_.image().string() + " " +
                               (folder_ / "cut.img").string() + " 2>&1");
    if (::ioctl(outer.get(), FITHAW, 0) != 0) throw std::runtime_error("cannot thaw the outer disk");
    if (copied.status != 0) throw std::runtime_error("cannot copy the disk: " + copied.output);
    return std::make_unique<LoopDisk>(folder_, "cut", LoopDisk::Image::as_it_is);
  }

 private:
  std::filesystem::path folder_;
  LoopDisk outer_;
  LoopDisk inner_;
};

}  // namespace emberlock::test
