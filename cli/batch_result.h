// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"
#include "recon/batch/pulse.h"
#include "report/batch_report.h"

// What a batch's folder holds for people and other programs, beside its ledger: OUT/frame-N and
// OUT/volume_NNNN.vdb, links into OUT/batch/done/, and OUT/sequence/.
namespace emberlock::cli {

/// OUT/batch.
std::filesystem::path ledger_of(const std::filesystem::path& out);

/// Frames that are volumes or have failed, those of unfinished chunks too: what a folder's entries tell.
std::size_t frames_done(const recon::Ledger& ledger, const recon::BatchPlan& plan);

/// Who fills a chunk's folder signs it.
Status sign(const std::filesystem::path& chunk, const recon::Worker& worker);
/// Where a chunk's folder has this frame's volume.
std::filesystem::path volume_in(const std::filesystem::path& chunk, std::uint64_t frame);
/// Whether a done chunk's folder holds the volumes of all its frames. A list of them that can't be read is
/// removed, so that all are made again.
bool chunk_holds(const std::filesystem::path& chunk, std::size_t frames);
/// Links to a done chunk's volumes. Error: io.
Status link_volumes(const std::filesystem::path& out, const recon::Chunk& chunk);

/// All chunks that are done. Error: a file of theirs that can't be read.
Result<report::BatchTold> told_of(const recon::Ledger& ledger, const recon::BatchPlan& plan);
/// Renews OUT/sequence: frames.json and frames.csv as of `reconstruct --frames`, batch.csv, report.html.
Status write_batch_report(const report::BatchTold& told, const std::filesystem::path& out,
                          const std::string& input);

}  // namespace emberlock::cli
