// SPDX-License-Identifier: Apache-2.0
#include "report/design_report.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/file.h"
#include "evaluate/sync_tradeoff.h"
#include "report/camera_plan.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

using evaluate::DesignedRig;
using evaluate::ErrorPart;
using evaluate::total;

std::string size_word(ImageSize size) { return fmt::format("{}x{}", size.width, size.height); }

std::string rig_words(const DesignedRig& rig) {
  return fmt::format("{} cameras of {}, {:.2g} ms exposure, {} voxels", rig.cameras, size_word(rig.size),
                     in_milliseconds(rig.exposure), rig.voxels);
}

std::string error_words(const DesignPage& page, double error) {
  return fmt::format("{:.2f} +- {:.2f} grey levels", error, evaluate::uncertainty(page.law) * error);
}

/// " The law extrapolates: ..."; nothing where it doesn't.
std::string extrapolation_words(const DesignPage& page) {
  if (page.extrapolated.empty()) return {};
  return fmt::format(" The law extrapolates, so the error may be further off than stated: {}.",
                     fmt::join(page.extrapolated, ", "));
}

std::string verdict(const DesignPage& page) {
  if (page.one_more)
    return fmt::format("The rig of {} cameras is predicted to err by {}.{}",
                       page.one_more->rig.towards.size(), error_words(page, total(page.one_more->now)),
                       extrapolation_words(page));
  const DesignedRig& rig = page.design.chosen;
  const std::string words =
      page.design.reached
          ? fmt::format("The cheapest rig for {:g} grey levels", page.request.target)
          : fmt::format("No rig reaches {:g} grey levels. The most accurate", page.request.target);
  return fmt::format("{}: {}. Predicted: {} for {:g} EUR of cameras.{}", words, rig_words(rig),
                     error_words(page, rig.error()), rig.euros, extrapolation_words(page));
}

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

/// "azimuth 120, elevation 10 degrees"
std::string direction_words(const Eigen::Vector3d& towards) {
  const double azimuth = degrees(std::atan2(towards.y(), towards.x()));
  return fmt::format("azimuth {}, elevation {:.0f} degrees", std::lround(azimuth + 360) % 360,
                     degrees(std::asin(std::clamp(towards.z(), -1.0, 1.0))));
}

Eigen::Vector3d place_in_world(const OneMore& more, const evaluate::NextCamera& place) {
  return more.rig.flame + more.rig.distance * (more.rig.world_from_twin * place.towards);
}

std::vector<PlanCamera> plan_of(const DesignPage& page) {
  std::vector<PlanCamera> cameras;
  if (!page.one_more) {
    for (const recon::CameraModel& camera : placed(page.request, page.design.chosen))
      cameras.push_back(plan_camera(fmt::format("camera {}", cameras.size()), camera));
    return cameras;
  }
  const OneMore& more = *page.one_more;
  const Eigen::Vector3d up = more.rig.world_from_twin.col(2);
  for (const Eigen::Vector3d& towards : more.rig.towards) {
    const Eigen::Vector3d out = more.rig.world_from_twin * towards;
    cameras.push_back(
        {fmt::format("camera {}", cameras.size()), more.rig.flame + more.rig.distance * out, -out, up});
  }
  if (!more.places.empty()) {
    const Eigen::Vector3d out = more.rig.world_from_twin * more.places.front().towards;
    cameras.push_back(
        {"the next camera", place_in_world(more, more.places.front()), -out, up, recon::ViewRole::held_out});
  }
  return cameras;
}

recon::Box flame_box(const DesignPage& page) {
  const double edge = 1.25 * page.request.size.value();
  return {page.one_more ? page.one_more->rig.flame : Eigen::Vector3d::Zero().eval(),
          Eigen::Vector3d::Constant(edge)};
}

std::string error_plot(const DesignPage& page) {
  std::vector<Series> series;
  for (const ImageSize size : evaluate::design_sizes()) {
    Series s{size_word(size), {}, {}};
    for (const DesignedRig& rig : page.design.curve) {
      if (rig.size != size) continue;
      s.x.push_back(rig.cameras);
      s.y.push_back(rig.error());
      s.notes.push_back(fmt::format("{}\n{}", rig_words(rig), shares_text(rig.squares)));
    }
    series.push_back(std::move(s));
  }
  series.push_back({"target",
                    {3, static_cast<double>(page.request.most_cameras)},
                    {page.request.target, page.request.target},
                    true});
  return svg_plot_for_any_width(series, {.title = "What cameras and pixels buy",
                                         .x_label = "cameras",
                                         .y_label = "predicted held-out RMS error, grey levels",
                                         .y_axis = Axis::logarithmic,
                                         .mark = page.design.chosen.cameras,
                                         .width = 1100,
                                         .height = 400});
}

void parts_table(HtmlPage& html, const evaluate::ErrorSquares& squares) {
  constexpr std::array<const char*, evaluate::kErrorParts> kWhy{
      "too few directions, or gaps between them",
      "pixels and voxels are coarse",
      "grain of the sensors",
      "the flame moves while the shutters are open",
      "the cameras film at slightly different instants",
      "what this reconstruction leaves at any price"};
  std::vector<std::vector<std::string>> rows;
  const double all = std::pow(total(squares), 2);
  for (const ErrorPart part : evaluate::kAllErrorParts) {
    const double square = squares[static_cast<std::size_t>(part)];
    rows.push_back({std::string(name(part)), fmt::format("{:.2f}", std::sqrt(square)),
                    fmt::format("{:.0f} %", 100 * square / all), kWhy[static_cast<std::size_t>(part)]});
  }
  html.table({"part", "grey levels", "of the square", "because"}, rows);
}

std::string step_words(const DesignPage& page, const evaluate::DesignStep& step) {
  const double euros = step.to.euros - page.design.chosen.euros;
  return fmt::format("{}: error -{:.2f}{}", step.what, step.gain,
                     euros > 0
                         ? fmt::format(", {:+g} EUR ({:.2f} per 100 EUR)", euros, 100 * step.gain / euros)
                         : std::string());
}

void sweep_table(HtmlPage& html, const DesignPage& page) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < page.measured.size(); ++i) {
    const double said = total(predict(page.law, page.measured[i].rig));
    rows.push_back({page.sweep[i].name, fmt::format("{:.2f}", page.measured[i].error),
                    fmt::format("{:.2f}", said),
                    fmt::format("{:+.0f} %", 100 * (said / page.measured[i].error - 1))});
  }
  html.table({"simulated rig", "measured", "by the law", "off by"}, rows);
}

void places_table(HtmlPage& html, const OneMore& more) {
  std::vector<std::vector<std::string>> rows;
  for (const evaluate::NextCamera& place : more.places) {
    const Eigen::Vector3d at = place_in_world(more, place);
    rows.push_back({fmt::format("{:.3f}, {:.3f}, {:.3f}", at.x(), at.y(), at.z()),
                    direction_words(place.towards), fmt::format("{:.2f}", place.error),
                    fmt::format("-{:.2f}", total(more.now) - place.error)});
  }
  html.table({"position, m", "from the flame", "error with it", "gain"}, rows);
}

nlohmann::ordered_json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json squares_json(const evaluate::ErrorSquares& squares) {
  nlohmann::ordered_json json{{"error", total(squares)}};
  for (const ErrorPart part : evaluate::kAllErrorParts)
    json["parts"][std::string(name(part))] = std::sqrt(squares[static_cast<std::size_t>(part)]);
  return json;
}

nlohmann::ordered_json rig_json(const DesignedRig& rig) {
  nlohmann::ordered_json json{{"cameras", rig.cameras},
                              {"size", size_word(rig.size)},
                              {"voxels", rig.voxels},
                              {"exposure_ms", in_milliseconds(rig.exposure)},
                              {"tolerance_ms", in_milliseconds(rig.tolerance)},
                              {"euros", rig.euros}};
  json.update(squares_json(rig.squares));
  return json;
}

void add_design(HtmlPage& html, const DesignPage& page) {
  html.raw("<div class=\"scroll\">" + error_plot(page) + "</div>");
  html.heading("What the error is made of");
  parts_table(html, page.design.chosen.squares);
  html.heading("What the next step buys");
  for (const evaluate::DesignStep& step : page.design.steps) html.paragraph(step_words(page, step));
  if (page.recording) {
    html.heading("Recording and reconstruction");
    html.paragraph(fmt::format("{:.3g} MB/s, {:.3g} GB for {:g} s of film: {} host(s) and {} disk(s).",
                               page.recording->bytes_per_s / 1e6, page.recording->bytes / 1e9,
                               page.request.film.value(), page.recording->hosts, page.recording->disks));
  }
  std::vector<std::vector<std::string>> rows;
  for (const MachineMinutes& m : page.machines)
    rows.push_back({m.name, fmt::format("{:.2f}", m.frame), fmt::format("{:.1f}", m.minutes)});
  if (!rows.empty()) html.table({"machine", "s a frame", "minutes for the film"}, rows);
}

}  // namespace

std::string shares_text(const evaluate::ErrorSquares& squares) {
  std::vector<ErrorPart> order(evaluate::kAllErrorParts.begin(), evaluate::kAllErrorParts.end());
  const auto square = [&](ErrorPart part) { return squares[static_cast<std::size_t>(part)]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](ErrorPart a, ErrorPart b) { return square(a) > square(b); });
  const double all = std::pow(total(squares), 2);
  std::string words;
  for (const ErrorPart part : order)
    if (square(part) >= 0.01 * all)
      words += fmt::format("{}{} {:.0f} %", words.empty() ? "" : ", ", name(part), 100 * square(part) / all);
  return words;
}

std::string design_summary(const DesignPage& page) {
  std::string words = verdict(page) + "\n";
  if (page.one_more) {
    words += fmt::format("  {}\nOne more camera:\n", shares_text(page.one_more->now));
    for (const evaluate::NextCamera& place : page.one_more->places) {
      const Eigen::Vector3d at = place_in_world(*page.one_more, place);
      words +=
          fmt::format("  at {:.3f}, {:.3f}, {:.3f} m ({}): {:.2f} (-{:.2f})\n", at.x(), at.y(), at.z(),
                      direction_words(place.towards), place.error, total(page.one_more->now) - place.error);
    }
    return words;
  }
  words += fmt::format("  {}\n", shares_text(page.design.chosen.squares));
  const std::vector<recon::CameraModel> cameras = placed(page.request, page.design.chosen);
  words += fmt::format("  {:.3g} m from the flame's middle, a lens of {:g} degrees:\n",
                       cameras.front().center().norm(), page.request.lens);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Eigen::Vector3d at = cameras[i].center();
    words += fmt::format("  camera {:<2} {:7.3f} {:7.3f} {:7.3f} m  {}\n", i, at.x(), at.y(), at.z(),
                         direction_words(at.normalized()));
  }
  if (page.recording)
    words += fmt::format("  {:.3g} MB/s, {:.3g} GB for {:g} s: {} host(s), {} disk(s)\n",
                         page.recording->bytes_per_s / 1e6, page.recording->bytes / 1e9,
                         page.request.film.value(), page.recording->hosts, page.recording->disks);
  for (const MachineMinutes& m : page.machines)
    words += fmt::format("  {}: {:.2f} s a frame, {:.1f} min for the film\n", m.name, m.frame, m.minutes);
  words += "What the next step buys:\n";
  for (const evaluate::DesignStep& step : page.design.steps) words += "  " + step_words(page, step) + "\n";
  if (page.design.steps.empty()) words += "  No single step lowers the error.\n";
  return words;
}

nlohmann::ordered_json design_json(const DesignPage& page) {
  nlohmann::ordered_json json{{"flame",
                               {{"size_m", page.request.size.value()},
                                {"speed_m_s", page.request.speed},
                                {"temperature_k", page.request.temperature.value()}}},
                              {"law", {{"reach", page.law.reach}, {"spread", page.law.spread}}}};
  for (const ErrorPart part : evaluate::kAllErrorParts)
    json["law"]["strength"][std::string(name(part))] = page.law.strength[static_cast<std::size_t>(part)];
  json["law"]["extrapolated"] = page.extrapolated;
  if (page.one_more) {
    json["rig"] = squares_json(page.one_more->now);
    json["rig"]["cameras"] = page.one_more->rig.towards.size();
    json["next_cameras"] = nlohmann::ordered_json::array();
    for (const evaluate::NextCamera& place : page.one_more->places)
      json["next_cameras"].push_back(
          {{"position_m", vector_json(place_in_world(*page.one_more, place))},
           {"direction", vector_json(-(page.one_more->rig.world_from_twin * place.towards))},
           {"error", place.error},
           {"gain", total(page.one_more->now) - place.error}});
    return json;
  }
  json["target"] = page.request.target;
  json["reached"] = page.design.reached;
  json["chosen"] = rig_json(page.design.chosen);
  json["cameras"] = nlohmann::ordered_json::array();
  for (const PlanCamera& camera : plan_of(page))
    json["cameras"].push_back({{"id", camera.name},
                               {"position_m", vector_json(camera.position)},
                               {"direction", vector_json(camera.direction)}});
  json["steps"] = nlohmann::ordered_json::array();
  for (const evaluate::DesignStep& step : page.design.steps)
    json["steps"].push_back({{"what", step.what}, {"gain", step.gain}, {"to", rig_json(step.to)}});
  if (page.recording)
    json["recording"] = {{"bytes_per_s", page.recording->bytes_per_s},
                         {"bytes", page.recording->bytes},
                         {"hosts", page.recording->hosts},
                         {"disks", page.recording->disks}};
  json["machines"] = nlohmann::ordered_json::array();
  for (const MachineMinutes& m : page.machines)
    json["machines"].push_back({{"name", m.name}, {"frame_s", m.frame}, {"minutes", m.minutes}});
  return json;
}

std::string design_html(const DesignPage& page) {
  HtmlPage html(fmt::format("Emberlock: a rig for a flame of {:g} m at {:g} m/s and {:g} K",
                            page.request.size.value(), page.request.speed, page.request.temperature.value()));
  html.raw("<p style=\"font-size:1.25rem\">" + html_escape(verdict(page)) + "</p>");
  if (page.one_more) {
    html.heading("Where one more camera would stand");
    places_table(html, *page.one_more);
    html.heading("What the error is made of");
    parts_table(html, page.one_more->now);
  } else {
    add_design(html, page);
  }
  add_camera_plan(html, plan_of(page), flame_box(page));
  html.heading("How it was made");
  if (page.measured.empty()) {
    html.paragraph("The law of errors is an earlier design's (--law).");
  } else {
    html.paragraph(fmt::format(
        "{} small rigs were simulated and reconstructed, twelve further views judging each. A law of six "
        "parts, whose squares add up, was fitted to them. It predicts each of them to {:.0f} % (RMS) when it "
        "is fitted to the others, and rigs that differ from them in several things to {:.0f} % "
        "(docs/design.md); "
        "the +- above is both.",
        page.measured.size(), 100 * page.law.spread, 100 * evaluate::kJointSpread));
    sweep_table(html, page);
  }
  html.paragraph(fmt::format(
      "Assumed, not measured: noise of {:g} grey levels at 4 ms and 1800 K (--noise), {:g} EUR a camera "
      "(--camera-price), {:g} MB/s a host takes of its cameras (--host-link), and that the flame is like the "
      "drawn one.",
      page.request.noise, page.request.camera_price, page.request.host_link / 1e6));
  return html.str();
}

Status write_design(const DesignPage& page, const OutputRequest& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(staging.path() / "report.json", design_json(page).dump(1) + "\n"));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "report.html", design_html(page)));
  return staging.commit();
}

}  // namespace emberlock::report
