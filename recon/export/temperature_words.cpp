// SPDX-License-Identifier: Apache-2.0
#include "recon/export/temperature_words.h"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace emberlock::recon {
namespace {

std::string way(const TemperatureSummary& t) {
  if (t.emitter == Emitter::paper)
    return fmt::format(
        "green alone, with the paper's constant opacity of {:g} a voxel, between 1000 and 2300 K{}",
        t.opacity,
        t.absolute ? "" : "; the camera's scale isn't known, so that the brightest green counts as 2300 K");
  std::string words = t.emitter == Emitter::soot ? "soot that glows by E(m) / wavelength" : "a grey glow";
  words += ": the ratios of all channels";
  if (t.by_absorption)
    words += t.joint.iterations > 0 ? ", and emission over extinction where the joint solve starts"
                                    : ", and emission over extinction";
  if (!t.absolute) words += "; the camera's response is relative";
  if (!t.response_given)
    words +=
        "; no response is given, so that cameras of linear sRGB are assumed. Those of other colours, or "
        "pictures with a gamma, read hundreds of kelvin off: give --response (`emberlock colour` measures "
        "one)";
  return words;
}

std::string names_of(const std::vector<LineSummary>& lines) {
  std::vector<std::string> names;
  names.reserve(lines.size());
  for (const LineSummary& line : lines) names.push_back(line.name);
  return fmt::format("{}", fmt::join(names, " and "));
}

/// What is no black body.
std::vector<std::string> line_words(const TemperatureSummary& t) {
  std::vector<std::string> words;
  for (const LineSummary& line : t.lines) {
    words.push_back(fmt::format("{}{} makes {:.1f} % of the light, in {} of {} voxels", line.name,
                                t.lines_automatic ? ", which best explains what no black body does," : "",
                                100 * line.share, line.seen, t.counts.emitting));
    if (line.as_if_hot > 0)
      words.push_back(
          fmt::format("to this camera {} has the colour of a glow of {:.0f} K: near that it can't be told",
                      line.name, line.as_if_hot));
  }
  if (!t.lines.empty() && !t.absolute)
    words.push_back("a line's colour is as good as the response, which is relative");
  if (!t.lines_automatic || !t.lines.empty()) return words;
  if (!t.lines_alike.empty()) {
    words.push_back(
        fmt::format("can't tell which line emitter shines: {} explain alike what no black body does",
                    fmt::join(t.lines_alike, ", ")));
  } else {
    words.emplace_back(t.lines_tried ? "no single line emitter explains what no black body does"
                                     : "no line emitter was looked for: too little light is no black body's");
  }
  return words;
}

std::string not_told(const TemperatureSummary& t) {
  const TemperatureCounts& n = t.counts;
  const std::string lines = names_of(t.lines);
  std::vector<std::string> why;
  const auto add = [&](std::size_t count, const std::string& reason) {
    if (count > 0) why.push_back(fmt::format("{} {}", count, reason));
  };
  add(n.colder, t.lines.empty() ? "are colder than the table"
                                : "are colder than the table, or than 1000 K beside lines");
  add(n.hotter, t.lines.empty() ? "are hotter than the table"
                                : "are hotter than the table, or than 3000 K beside lines");
  add(n.other, lines.empty()
                   ? fmt::format("show colours that no body of this kind has (a blue base, sodium, salts?{})",
                                 t.lines_automatic ? "" : " --lines auto")
                   : "show colours that no mixture with " + lines + " has");
  add(n.lines, "are " + lines + ", no soot");
  add(n.alike, "may be soot or " + lines + " alike");
  add(n.saturated, "are saturated in most views, so that their light is a bound");
  add(n.unclear, "can't tell one to a fifth");
  return why.empty() ? "" : fmt::format("not told: {}", fmt::join(why, "; "));
}

}  // namespace

std::vector<std::string> temperature_words(const TemperatureSummary& t) {
  const std::vector<std::string> lines = line_words(t);
  if (t.counts.told == 0) {
    const std::string why = not_told(t);
    std::vector<std::string> words = {"no voxel tells its temperature" +
                                      (why.empty() ? std::string(": nothing glows") : "; " + why)};
    words.insert(words.end(), lines.begin(), lines.end());
    return words;
  }
  const double share = 100.0 * static_cast<double>(t.counts.told) / static_cast<double>(t.counts.emitting);
  std::vector<std::string> words = {fmt::format("{:.0f} K on average, 5 to 95 % of the light from {:.0f} to "
                                                "{:.0f} K, each voxel to +-{:.0f} K; told "
                                                "for {:.1f} % of the voxels with light",
                                                t.mean, t.low, t.high, t.sigma, share),
                                    "read from " + way(t)};
  if (std::string why = not_told(t); !why.empty()) words.push_back(std::move(why));
  words.insert(words.end(), lines.begin(), lines.end());
  if (t.chi_square > 0)
    words.push_back(
        fmt::format("as read, the channels agree with it to a chi-square of {:.2f} a degree of freedom{}",
                    t.chi_square, t.chi_square > 2 ? ": more than their errors explain" : ""));
  if (t.if_other > 0)
    words.push_back(
        fmt::format("if it were {}, the average would be {:.0f} K (--emitter {}){}",
                    t.emitter == Emitter::grey ? "soot, which isn't grey" : "grey", t.if_other,
                    t.emitter == Emitter::grey ? "soot" : "grey",
                    t.emitter_told ? "" : ": which of the two isn't told, and each error holds it"));
  if (t.dispersion != 0)
    words.push_back(
        fmt::format("soot whose E(m) is constant would be read {:.0f} K too {}: each error allows for any "
                    "dispersion up to that",
                    std::abs(t.dispersion), t.dispersion > 0 ? "hot" : "cold"));
  if (t.joint.left_out)
    words.push_back(
        fmt::format("solved together they show views that were left out {:.1f} % {} than as read{}",
                    100 * std::abs(1 - *t.joint.left_out), *t.joint.left_out < 1 ? "better" : "worse",
                    t.joint.is_believed() ? "" : ": each is as it was read"));
  if (t.joint.iterations > 0)
    words.push_back(fmt::format(
        "solved together by the pictures, {} steps in {:.1f} s: they moved by {:.0f} K "
        "(RMS), and what pictures and neighbours say against them fell by {:.0f} %, in the last step by "
        "{:.1f} %",
        t.joint.iterations, t.joint.time.value(), t.joint.moved,
        t.joint.before > 0 ? 100 * (1 - t.joint.after / t.joint.before) : 0, 100 * t.joint.last_drop));
  if (t.joint_failed)
    words.emplace_back(
        "they couldn't be solved together (it diverged, or needs more memory): each is as it was read");
  words.push_back(
      fmt::format("errors took {:.1f} s: {} solves without some of the views; the temperatures {:.1f} s",
                  t.errors_time.value(), t.solves, t.time.value()));
  return words;
}

}  // namespace emberlock::recon
