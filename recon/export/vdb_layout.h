// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <string>

#include "base/result.h"

namespace emberlock::recon {

/// Whether OpenVDB's reader can be given a file: whether each size, count and offset in it agrees with its
/// bytes. The reader trusts them, allocates what they state, and writes as much as a block states into a
/// buffer of another size; a seal, which everybody can compute, protects from none of that. Only what
/// Emberlock writes passes: format 224, trees of float and vec3s without tiles, at most one root child, no
/// half floats. Memory for the tree is then less than 70 times the file, that of its nodes of 64 KiB behind
/// 1 KiB of masks.
/// Errors (bad_input): another layout; more voxels than kLargestEmptyGrid and than a thousand a byte.
Status check_vdb_layout(std::istream& file, const std::string& where);

}  // namespace emberlock::recon
