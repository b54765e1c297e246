// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "recon/compute/cuda_launch.h"
#include "recon/kernels/sum.h"

namespace emberlock::recon {

/// For .cu files: the sum of the terms of elements first .. last - 1, made on the GPU in an order that is
/// always the same.
template <std::size_t kElements = 32, class Term>
Quad<double> sum_on_cuda(const Term& term, std::size_t first, std::size_t last) {
  if (first >= last) return {};
  SumChunk<Term, kElements> act{term, first, last, nullptr};
  auto sums = CudaBuffer<Quad<double>>::unfilled(act.chunks());
  act.sums = sums.data();
  launch(sums.size(), act, "summing");
  constexpr std::size_t kFewEnough = 256;  // to be added up at home
  while (sums.size() > kFewEnough) {
    SumChunk<Summed> again{{sums.data()}, 0, sums.size(), nullptr};
    auto fewer = CudaBuffer<Quad<double>>::unfilled(again.chunks());
    again.sums = fewer.data();
    launch(fewer.size(), again, "summing");
    sums = std::move(fewer);
  }
  Quad<double> all;
  for (const Quad<double>& chunk : sums.download()) all = all + chunk;
  return all;
}

}  // namespace emberlock::recon
