// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "emberlock/v1/child.pb.h"
#include "session/child_messages.h"

// Shell scripts in the place of `emberlock`, as a daemon's children.
namespace emberlock::test {

/// Writes FOLDER/program. Its script knows the folder as ROOT.
inline void put_script(const std::filesystem::path& folder, const std::string& script) {
  std::ofstream(folder / "program") << "#!/bin/sh\nROOT='" << folder.string() << "'\n" << script << "\n";
  std::filesystem::permissions(folder / "program", std::filesystem::perms::owner_all);
}

/// Writes a message that a script sends by `cat $ROOT/NAME >&3`.
inline void put_message(const std::filesystem::path& file, const v1::ChildMessage& message) {
  std::ofstream(file, std::ios::binary) << session::framed(message);
}

/// Makes a preview of nx x ny x nz key points in a cube of 1 m.
inline void fill(v1::VolumePreview& volume, unsigned nx, unsigned ny, unsigned nz,
                 const std::string& voxels) {
  volume.set_nx(nx);
  volume.set_ny(ny);
  volume.set_nz(nz);
  volume.set_voxels(voxels);
  for (int i = 0; i < 3; ++i) {
    volume.mutable_box()->add_center(0);
    volume.mutable_box()->add_size(1);
  }
}

}  // namespace emberlock::test
