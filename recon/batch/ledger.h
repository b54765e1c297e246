// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace emberlock::recon {

/// What is known of a worker that has claimed a chunk.
enum class Life {
  alive,
  silent,  ///< it hasn't been heard of for too long; it may still write
  gone,    ///< it is known to be dead: it writes no more
};

/// Who does which chunk of a batch, in a folder that all workers share. There is no other coordinator: a
/// chunk changes hands by one rename, which a file system does for one of those who ask, or for none.
///
///     plan.json             what is done, told by whoever made the ledger
///     todo/CHUNK            files: nobody works on it
///     claims/CHUNK.WORKER   somebody does
///     work/CHUNK.WORKER/    what it has made of it so far
///     partial/CHUNK/        the same, of one who gave it back
///     done/CHUNK/           what it became, whole; from then on nothing in it changes
///     lost/CHUNK.WORKER     who died of it, or fell silent
///     given_up/CHUNK        kMostLosses of them did
///
/// A chunk lies in todo, claims, given_up or done at any moment. Each attempt writes into a folder of its
/// own, and the first one that is finished becomes done/CHUNK: whoever was taken for dead and wasn't harms
/// nothing. Names of chunks and workers have no '/', those of chunks no '.'. One object serves one thread.
class Ledger {
 public:
  using LifeOf = std::function<Life(const std::string& worker)>;
  static constexpr std::size_t kMostLosses = 3;

  /// Makes a ledger at `folder` where there is none, whole or not at all. It is somebody else's where another
  /// did so before: read_plan() tells. Error: io.
  static Status create(const std::filesystem::path& folder, const std::string& worker,
                       const std::string& plan, const std::vector<std::string>& chunks);
  /// The plan it was made with; nothing where there is no ledger. Error: io.
  static Result<std::optional<std::string>> read_plan(const std::filesystem::path& folder);

  /// Of a ledger that is there, for one worker.
  Ledger(std::filesystem::path folder, std::vector<std::string> chunks, std::string worker)
      : folder_(std::move(folder)), chunks_(std::move(chunks)), worker_(std::move(worker)) {}

  struct Claim {
    std::string chunk;
    std::filesystem::path work;  ///< the folder to fill; holds what an earlier attempt left that can go on
    std::string from = {};       ///< the worker that it was taken over from
  };
  /// A chunk that nobody does, else one whose worker is no longer alive; nothing where there is none. The
  /// `place`-th of the former is asked for first, so that a thousand workers that begin at once needn't all
  /// ask for the same ones in turn. Error: io; the chunk is nobody's then.
  Result<std::optional<Claim>> take(const LifeOf& life_of, std::size_t place = 0);
  /// What is in the work's folder becomes the chunk's result; false where another attempt was finished
  /// before, or the folder was taken away from one taken for dead. Error: io.
  Result<bool> finish(const Claim& claim);
  /// Removes what an earlier attempt left in the work's folder.
  static void empty(const Claim& claim);
  /// Whoever takes it next goes on with what is in the work's folder. Error: io.
  Status give_back(const Claim& claim);
  /// Lets a chunk that is done, or given up, be done again, on top of what is there. No effect where another
  /// one did so before. Not while others finish it. Error: io.
  Status reopen(const std::string& chunk);

  /// Makes those of the ledger's folders that are missing, as in a copy without empty folders. Error: io.
  [[nodiscard]] Status restore_folders() const;
  /// Puts each chunk that lies nowhere, as its result was removed, into todo; returns those. Error: io.
  [[nodiscard]] Result<std::vector<std::string>> restore_missing() const;

  [[nodiscard]] bool done(const std::string& chunk) const;
  [[nodiscard]] bool given_up(const std::string& chunk) const;
  /// Whether each chunk is done or given up.
  [[nodiscard]] bool settled() const;
  /// Where the chunk's result is, or will be.
  [[nodiscard]] std::filesystem::path result(const std::string& chunk) const {
    return folder_ / "done" / chunk;
  }
  /// Folders with unfinished work: of claimed chunks, and of those given back.
  [[nodiscard]] std::vector<std::filesystem::path> unfinished() const;
  /// CHUNK.WORKER of those who died of one.
  [[nodiscard]] std::vector<std::string> losses() const;
  /// They count from now on: an end of the whole run, such as by its time limit, is no chunk's fault.
  void forget_losses() const;
  /// Removes what attempts that came to nothing left behind. Only where all is settled.
  void tidy() const;

  [[nodiscard]] const std::vector<std::string>& chunks() const { return chunks_; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  [[nodiscard]] std::string mine(const std::string& chunk) const { return chunk + "." + worker_; }
  Result<std::optional<Claim>> take_from(const std::string& chunk, const std::string& owner, Life life);
  Result<std::optional<Claim>> begin(Claim claim, const std::filesystem::path& left);
  Status drop(const std::string& chunk) const;

  std::filesystem::path folder_;
  std::vector<std::string> chunks_;
  std::string worker_;
};

}  // namespace emberlock::recon
