// SPDX-License-Identifier: Apache-2.0
#include "cli/batch_result.h"

#include <algorithm>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "cli/outputs.h"
#include "cli/sequence_state.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSignature = "worker.json";

/// `path` leads to `target`, whatever it led to before.
Status link_to(const fs::path& path, const fs::path& target) {
  std::error_code ec;
  if (fs::is_symlink(path, ec) && fs::read_symlink(path, ec) == target) return {};
  fs::create_symlink(target, path, ec);
  if (!ec || (fs::is_symlink(path) && fs::read_symlink(path, ec) == target)) return {};  // by another rank
  return Error{ErrorKind::io, "can't link to " + target.string() + ": " + ec.message(), path.string(),
               "Move what is there away, or give an --out on a file system that has symbolic links"};
}

void add_done(const recon::Ledger& ledger, const report::SequenceTold& sequence, report::BatchChunk& chunk) {
  chunk.done = true;
  for (const report::SequenceFrame& frame : sequence.frames) {
    if (frame.error.empty()) ++chunk.volumes;
    chunk.took += frame.loading + frame.reconstruction + frame.writing;
  }
  chunk.failed = chunk.planned - chunk.volumes;
  const fs::path path = ledger.result(chunk.name) / kSignature;
  const auto text = read_file(path);
  if (!text) return;
  if (const auto worker = recon::parse_worker(*text, path.string())) {
    chunk.rank = worker->rank;
    chunk.host = worker->host;
    chunk.device = worker->device;
  }
}

}  // namespace

fs::path ledger_of(const fs::path& out) { return out / "batch"; }

std::size_t frames_done(const recon::Ledger& ledger, const recon::BatchPlan& plan) {
  std::size_t frames = 0;
  for (const recon::Chunk& chunk : recon::chunks_of(plan))
    if (ledger.done(chunk.name)) frames += chunk.frames.size();
  std::error_code ec;
  for (const fs::path& folder : ledger.unfinished())
    for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec))
      if (it->path().filename().string().starts_with("frame-")) ++frames;
  return std::min(frames, plan.frames.size());
}

Status sign(const fs::path& chunk, const recon::Worker& worker) {
  return write_file_atomically(chunk / kSignature, to_json(worker));
}

fs::path volume_in(const fs::path& chunk, std::uint64_t frame) {
  return chunk / fmt::format("frame-{}", frame) / "volume.vdb";
}

bool chunk_holds(const fs::path& chunk, std::size_t frames) {
  const fs::path path = chunk / "sequence" / "frames.json";
  const auto text = read_file(path);
  const auto told = text ? report::parse_sequence(*text, path.string()) : text.error();
  if (!told) {
    std::error_code ec;
    fs::remove_all(path.parent_path(), ec);
    return false;
  }
  return told->frames.size() >= frames &&
         std::all_of(told->frames.begin(), told->frames.end(), [&](const report::SequenceFrame& frame) {
           return frame.error.empty() && holds_volume(volume_in(chunk, frame.frame).parent_path(), frame);
         });
}

Status link_volumes(const fs::path& out, const recon::Chunk& chunk) {
  const fs::path done = fs::path("batch") / "done" / chunk.name;
  std::error_code ec;
  for (const std::uint64_t frame : chunk.frames) {
    const fs::path volume = volume_in(done, frame);
    if (!fs::exists(out / volume, ec)) continue;  // it failed
    const fs::path folder = volume.parent_path();
    EMBERLOCK_RETURN_IF_ERROR(link_to(out / folder.filename(), folder));
    EMBERLOCK_RETURN_IF_ERROR(link_to(out / fmt::format("volume_{:04}.vdb", frame), volume));
  }
  return {};
}

Result<report::BatchTold> told_of(const recon::Ledger& ledger, const recon::BatchPlan& plan) {
  report::BatchTold told;
  told.sequence.voxels = plan.voxels;
  told.losses = ledger.losses();
  for (const recon::Chunk& chunk : recon::chunks_of(plan)) {
    report::BatchChunk& row = told.chunks.emplace_back();
    row.name = chunk.name;
    row.planned = chunk.frames.size();
    if (ledger.given_up(chunk.name)) told.given_up.push_back(chunk.name);
    if (!ledger.done(chunk.name)) continue;
    const fs::path path = ledger.result(chunk.name) / "sequence" / "frames.json";
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path));
    EMBERLOCK_ASSIGN_OR_RETURN(const report::SequenceTold part, report::parse_sequence(text, path.string()));
    told.sequence.held_out = told.sequence.held_out || part.held_out;
    told.sequence.frames.insert(told.sequence.frames.end(), part.frames.begin(), part.frames.end());
    add_done(ledger, part, row);
  }
  return told;
}

Status write_batch_report(const report::BatchTold& told, const fs::path& out, const std::string& input) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create({out / "sequence", kBatch}));
  const fs::path& folder = staging.path();
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "frames.json", sequence_json(told.sequence)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "frames.csv", sequence_csv(told.sequence)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "batch.csv", batch_csv(told)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "report.html", batch_html(told, input)));
  return staging.commit();
}

}  // namespace emberlock::cli
