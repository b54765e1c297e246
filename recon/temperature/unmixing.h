// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "recon/temperature/line_emitter.h"
#include "recon/temperature/thermometer.h"

namespace emberlock::recon {

/// What a place's light is made of.
struct Unmixed {
  enum class Kind {
    soot,     ///< no line is seen; its error holds what an unseen one may hide
    mixed,    ///< soot and lines
    lines,    ///< lines and no soot: there is no temperature to tell
    alike,    ///< can't tell: as many emitters of another kind explain it as well
    neither,  ///< no mixture of these shows such channels
    unknown,  ///< fewer channels than unknowns, or nothing glows
  } kind = Kind::unknown;
  Reading reading;                            ///< of the soot, if any
  std::array<double, kMostLines> share = {};  ///< of the light (the three channels' sum), each line's
  std::array<bool, kMostLines> seen = {};
};

/// Takes light apart into what glows by a table and up to kMostLines lines: of all amounts that aren't
/// negative the most likely ones at each temperature (maximum likelihood, as Thermometer), for each choice of
/// emitters; and of the choices the simplest one: an emitter must lower chi-square by nine, three sigma, to
/// be seen. What glows beside lines is taken to be soot in a flame, 1000 to 3000 K. A temperature's error is
/// half of how far it may lie with any of the lines, seen or not, before chi-square rises by four: mixtures
/// are far from linear, and a line that isn't seen may be there. Immutable, thread-safe.
class Unmixer {
 public:
  /// `lines`: what they show, levels_of(). `meter` must outlive it.
  Unmixer(const Thermometer& meter, std::vector<std::array<double, 3>> lines);
  [[nodiscard]] Unmixed read(const Glow& glow) const;

  /// Which emitters: bit 0 is what glows, bit 1 + i line i.
  using Choice = unsigned;
  /// Amounts of each, in their levels.
  using Amounts = std::array<double, 1 + kMostLines>;
  /// Chi-square of a temperature with the best amounts, which `amounts` receives.
  [[nodiscard]] double chi_square(const Glow& glow, double kelvin, Choice choice,
                                  Amounts* amounts = nullptr) const;

 private:
  struct Explanation;
  [[nodiscard]] Explanation explain(const Glow& glow, Choice choice, int data) const;
  [[nodiscard]] double reach(const Glow& glow, const Explanation& within, double kelvin) const;

  const Thermometer* meter_;
  std::vector<std::array<double, 3>> lines_;  ///< what each shows alone adds up to 1
};

/// Which single line emitter best explains glows that no soot shows.
struct LineChoice {
  const LineEmitter* chosen = nullptr;          ///< null: can't tell
  std::vector<const LineEmitter*> rivals = {};  ///< that explain them alike; empty: none explains them
};
/// Each glow counts at most kNoBody. Chosen is who leaves less than half of that, and one chi-square a glow
/// less than any other.
LineChoice choose_line(const Thermometer& meter, const CameraResponse& response,
                       const std::vector<Glow>& glows);

}  // namespace emberlock::recon
