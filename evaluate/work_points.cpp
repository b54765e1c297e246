// SPDX-License-Identifier: Apache-2.0
#include "evaluate/work_points.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

namespace emberlock::evaluate {
namespace {

constexpr std::string_view kHeader =
    "seconds,heldout_rmse,voxels,views,iterations,step,precision,effects,solver,front";
constexpr std::size_t kColumns = 10;

/// The shortest text that reads back as the same number.
template <class Number>
std::string text(Number value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

template <class Number>
bool read(std::string_view word, Number& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// The fields of a line; those in quotes may hold commas.
std::vector<std::string> fields(std::string_view line) {
  std::vector<std::string> result(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      result.emplace_back();
    } else {
      result.back() += c;
    }
  }
  return result;
}

std::optional<recon::WorkPoint> point_of(std::string_view line) {
  const std::vector<std::string> f = fields(line);
  if (f.size() != kColumns) return std::nullopt;
  recon::WorkPoint p;
  recon::Settings& s = p.settings;
  const bool numbers = read(f[0], p.seconds) && read(f[1], p.error) && read(f[2], s.voxels) &&
                       read(f[3], s.views) && read(f[4], s.iterations) && read(f[5], s.step);
  const auto precision = recon::parse_precision(f[6]);
  const auto solver = recon::parse_solver(f[8]);
  if (!numbers || !std::isfinite(p.seconds) || !std::isfinite(p.error) || !precision || !solver)
    return std::nullopt;
  s.precision = *precision;
  s.effects = f[7];
  s.solver = *solver;
  return p;
}

}  // namespace

std::vector<recon::WorkPoint> pareto_front(std::vector<recon::WorkPoint> points) {
  std::stable_sort(points.begin(), points.end(), [](const recon::WorkPoint& a, const recon::WorkPoint& b) {
    return a.seconds != b.seconds ? a.seconds < b.seconds : a.error < b.error;
  });
  std::vector<recon::WorkPoint> front;
  for (recon::WorkPoint& p : points) {
    if (front.empty() || p.error < front.back().error) front.push_back(std::move(p));
  }
  return front;
}

std::string to_csv(const std::vector<recon::WorkPoint>& points) {
  std::set<std::pair<double, double>> front;
  for (const recon::WorkPoint& p : pareto_front(points)) front.emplace(p.seconds, p.error);
  std::string csv(kHeader);
  csv += '\n';
  for (const recon::WorkPoint& p : points) {
    const recon::Settings& s = p.settings;
    const bool on_front = front.contains({p.seconds, p.error});
    csv += text(p.seconds) + ',' + text(p.error) + ',' + text(s.voxels) + ',' + text(s.views) + ',' +
           text(s.iterations) + ',' + text(s.step) + ',' + std::string(name(s.precision)) + ",\"" +
           s.effects + "\"," + std::string(name(s.solver)) + ',' + (on_front ? '1' : '0') + '\n';
  }
  return csv;
}

Result<std::vector<recon::WorkPoint>> parse_csv(std::string_view text) {
  const auto refuse = [](std::size_t line) {
    return Error{ErrorKind::bad_input, "is not a work-precision point", "line " + std::to_string(line),
                 "Take a points.csv as `emberlock tradeoff` writes it: " + std::string(kHeader)};
  };
  std::vector<recon::WorkPoint> points;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view words = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(words.size() + 1, text.size()));
    if (line == 1) {
      if (words != kHeader) return refuse(line);
      continue;
    }
    const auto point = point_of(words);
    if (!point) return refuse(line);
    points.push_back(*point);
  }
  return points;
}

std::string command_options(const recon::Settings& s) {
  std::string options = "--voxels " + text(s.voxels);
  if (s.views > 0) options += " --views " + text(s.views);
  if (s.iterations > 0) options += " --iterations " + text(s.iterations);
  return options + " --step " + text(s.step) + " --precision " + std::string(name(s.precision)) +
         " --effects " + s.effects + " --solver " + std::string(name(s.solver));
}

}  // namespace emberlock::evaluate
