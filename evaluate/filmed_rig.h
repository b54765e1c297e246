// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "base/clock.h"
#include "base/result.h"
#include "evaluate/measure_rig.h"
#include "recon/views/view.h"

namespace emberlock::evaluate {

/// A view with blocks of n x n pixels as one, with noise (RMS, grey levels) drawn by seed and stream.
recon::View averaged(const recon::View& fine, int n, double noise, std::uint64_t seed, std::uint64_t stream);

/// A rising flame of known truth, filmed and reconstructed by any set-up of RigTradeoffOptions. One further
/// view judges all set-ups alike: in time, sharp, without noise, as large as the largest pictures.
class FilmedRig {
 public:
  explicit FilmedRig(const RigTradeoffOptions& options) : options_(options) {}
  /// Errors: those of recon::reconstruct().
  Result<RigFrame> reconstruct(const RigSetup& setup, const Clock& clock);

 private:
  [[nodiscard]] recon::Scene film(const RigSetup& setup) const;

  const RigTradeoffOptions& options_;
  std::optional<recon::View> judge_;
  std::optional<std::pair<RigSetup, recon::Scene>> last_;  ///< what the last set-up's cameras saw
};

}  // namespace emberlock::evaluate
