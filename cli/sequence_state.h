// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "cli/command_line.h"
#include "report/sequence_report.h"
#include "session/reader.h"

// What a run that goes on with earlier frames compares: what they were made of and with, and whether they are
// still what was made.
namespace emberlock::cli {

/// The given options but those `without`, with paths as they are meant in every folder, and with the hash of
/// what a file holds.
std::map<std::string, std::string> given_options(const Verb& verb, const std::set<std::string>& without);

/// An option's value, with a path as it is meant in every folder.
std::string value_of(const Option& option);

/// Distinguishes a session from others.
std::string identity_of(const session::SessionReader& session);

/// The SHA-256 of a frame's volume.vdb, by the list of its folder's files; empty where that states none.
std::string listed_hash_of_volume(const std::filesystem::path& folder);

/// Whether a frame's folder holds the volume that its row tells of. A row without a hash, of an earlier
/// version, is compared with the list of the folder's files.
bool holds_volume(const std::filesystem::path& folder, const report::SequenceFrame& row);

}  // namespace emberlock::cli
