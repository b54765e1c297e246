// SPDX-License-Identifier: Apache-2.0
#include "report/sequence_report.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "report/html.h"

namespace emberlock::report {
namespace {

using Json = nlohmann::ordered_json;

Json number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}
std::optional<double> number(const Json& value) {
  return value.is_null() ? std::nullopt : std::optional(value.get<double>());
}

Json json_of(const SequenceFrame& f) {
  Json flicker = nullptr;
  if (f.flicker) flicker = {{"pictures", f.flicker->pictures}, {"renders", f.flicker->renders}};
  return {{"frame", f.frame},
          {"error", f.error.empty() ? Json(nullptr) : Json(f.error)},
          {"start", f.start},
          {"decided", f.decided},
          {"iterations", f.iterations},
          {"seconds",
           {{"loading", f.loading.value()},
            {"reconstruction", f.reconstruction.value()},
            {"writing", f.writing.value()}}},
          {"input_rmse", f.input_rmse},
          {"heldout_rmse", number(f.heldout_rmse)},
          {"psnr", number(f.psnr)},
          {"ssim", number(f.ssim)},
          {"light", f.light},
          {"flicker", flicker},
          {"time_s", number(f.time ? std::optional(f.time->value()) : std::nullopt)},
          {"volume", f.volume.empty() ? Json(nullptr) : Json(f.volume)}};
}

SequenceFrame frame_of(const Json& json) {
  SequenceFrame f;
  f.frame = json.at("frame").get<std::uint64_t>();
  if (!json.at("error").is_null()) f.error = json.at("error").get<std::string>();
  f.start = json.at("start").get<std::string>();
  f.decided = json.at("decided").get<bool>();
  f.iterations = json.at("iterations").get<int>();
  const Json& seconds = json.at("seconds");
  f.loading = Seconds(seconds.at("loading").get<double>());
  f.reconstruction = Seconds(seconds.at("reconstruction").get<double>());
  f.writing = Seconds(seconds.at("writing").get<double>());
  f.input_rmse = json.at("input_rmse").get<double>();
  f.heldout_rmse = number(json.at("heldout_rmse"));
  f.psnr = number(json.at("psnr"));
  f.ssim = number(json.at("ssim"));
  f.light = json.at("light").get<double>();
  if (const Json& flicker = json.at("flicker"); !flicker.is_null())
    f.flicker = recon::Flicker{flicker.at("pictures").get<double>(), flicker.at("renders").get<double>()};
  if (const Json& time = json.at("time_s"); !time.is_null()) f.time = Seconds(time.get<double>());
  if (json.contains("volume") && !json["volume"].is_null()) f.volume = json["volume"].get<std::string>();
  return f;
}

std::vector<const SequenceFrame*> done(const SequenceTold& told) {
  std::vector<const SequenceFrame*> frames;
  for (const SequenceFrame& f : told.frames)
    if (f.error.empty()) frames.push_back(&f);
  return frames;
}

/// Of those that have a value.
template <class Value>
std::optional<double> mean_of(const SequenceTold& told, const Value& value) {
  double sum = 0;
  int count = 0;
  for (const SequenceFrame* f : done(told))
    if (const std::optional<double> v = value(*f)) {
      sum += *v;
      ++count;
    }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// Of all frames together: RMS of what was reconstructed over that of the pictures.
std::optional<double> flicker_ratio(const SequenceTold& told) {
  const auto squared = [&](double recon::Flicker::*of) {
    return mean_of(told, [of](const SequenceFrame& f) {
      return f.flicker ? std::optional(std::pow((*f.flicker).*of, 2)) : std::nullopt;
    });
  };
  const auto pictures = squared(&recon::Flicker::pictures);
  const auto renders = squared(&recon::Flicker::renders);
  if (!pictures || !(*pictures > 0)) return std::nullopt;
  return std::sqrt(*renders / *pictures);
}

/// Empty where it isn't known.
std::string field(const std::optional<double>& value) { return value ? fmt::format("{:.6g}", *value) : ""; }

}  // namespace

std::string sequence_json(const SequenceTold& told) {
  Json frames = Json::array();
  for (const SequenceFrame& f : told.frames) frames.push_back(json_of(f));
  Json json = {{"format", "emberlock sequence"}, {"version", 1},
               {"voxels", told.voxels},          {"held_out", told.held_out},
               {"instants", told.instants},      {"frames", frames}};
  if (!told.session.empty()) {
    json["session"] = told.session;
    json["options"] = told.options;
  }
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";  // of paths that are no UTF-8
}

Result<SequenceTold> parse_sequence(std::string_view text, const std::string& where) try {
  const Json json = Json::parse(text);
  if (json.at("format") != "emberlock sequence" || json.at("version") != 1)
    return Error{ErrorKind::bad_input, "is not a sequence's frames.json of this version", where,
                 "Give another --out"};
  SequenceTold told;
  told.voxels = json.at("voxels").get<int>();
  told.held_out = json.at("held_out").get<bool>();
  told.instants = json.value("instants", 1);
  told.session = json.value("session", "");
  if (json.contains("options")) json["options"].get_to(told.options);
  for (const Json& frame : json.at("frames")) told.frames.push_back(frame_of(frame));
  return told;
} catch (const std::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where, "Give another --out"};
}

std::string sequence_csv(const SequenceTold& told) {
  std::string csv =
      "frame,start,iterations,loading_s,reconstruction_s,writing_s,input_rmse,heldout_rmse,psnr_db,ssim,"
      "light,"
      "flicker_of_pictures,flicker_of_volume,time_s\n";
  for (const SequenceFrame* f : done(told)) {
    const auto flicker = [&](double recon::Flicker::*of) {
      return f->flicker ? std::optional((*f->flicker).*of) : std::nullopt;
    };
    csv +=
        fmt::format("{},\"{}\",{},{:.3f},{:.3f},{:.3f},{:.6g},{},{},{},{:.6g},{},{},{}\n", f->frame, f->start,
                    f->iterations, f->loading.value(), f->reconstruction.value(), f->writing.value(),
                    f->input_rmse, field(f->heldout_rmse), field(f->psnr), field(f->ssim), f->light,
                    field(flicker(&recon::Flicker::pictures)), field(flicker(&recon::Flicker::renders)),
                    field(f->time ? std::optional(f->time->value()) : std::nullopt));
  }
  return csv;
}

std::vector<std::string> sequence_words(const SequenceTold& told) {
  std::vector<std::string> words;
  const auto frames = done(told);
  if (frames.empty()) return {"no frame became a volume"};
  const auto seconds = [](const SequenceFrame& f) {
    return std::optional((f.loading + f.reconstruction + f.writing).value());
  };
  words.push_back(fmt::format(
      "{} of {} frames became volumes of {} voxels along the longest edge, in {:.2f} s "
      "a frame; the first took {:.2f} s",
      frames.size(), told.frames.size(), told.voxels, *mean_of(told, seconds), *seconds(*frames.front())));
  if (const auto error = mean_of(told, [](const SequenceFrame& f) { return f.heldout_rmse; }))
    words.push_back(
        fmt::format("held-out views are shown to {:.2f} grey levels on average; over whole pictures "
                    "{:.2f} dB PSNR and {:.4f} SSIM",
                    *error, mean_of(told, [](const SequenceFrame& f) { return f.psnr; }).value_or(0),
                    mean_of(told, [](const SequenceFrame& f) { return f.ssim; }).value_or(0)));
  words.push_back(
      fmt::format("input views are shown to {:.2f} grey levels on average",
                  *mean_of(told, [](const SequenceFrame& f) { return std::optional(f.input_rmse); })));
  if (const auto ratio = flicker_ratio(told))
    words.push_back(
        fmt::format("from frame to frame the {} views of the volume change {:.2f} times as much as "
                    "the pictures do",
                    told.held_out ? "held-out" : "input", *ratio));
  return words;
}

std::string sequence_html(const SequenceTold& told, const std::string& input,
                          const std::function<void(HtmlPage&)>& more) {
  HtmlPage page("Emberlock: a flame over time");
  page.paragraph("Reconstructed from " + input + ".");
  for (const std::string& words : sequence_words(told)) page.paragraph(sentence(words));
  const auto frames = done(told);
  const auto series = [&](const char* name, const auto& value) {
    Series s{name, {}, {}};
    for (const SequenceFrame* f : frames) {
      s.x.push_back(static_cast<double>(f->frame));
      s.y.push_back(std::optional<double>(value(*f)).value_or(std::numeric_limits<double>::quiet_NaN()));
    }
    return s;
  };
  const auto plot = [&](const char* title, const char* unit, const std::vector<Series>& lines) {
    page.heading(title);
    page.raw(svg_plot_for_any_width(lines, {.x_label = "frame", .y_label = unit}));
  };
  std::vector<Series> errors = {series("input views", [](const SequenceFrame& f) { return f.input_rmse; })};
  if (told.held_out)
    errors.push_back(series("held-out views", [](const SequenceFrame& f) { return f.heldout_rmse; }));
  plot("Error", "grey levels", errors);
  if (told.held_out)
    plot("PSNR of the held-out views", "dB", {series("PSNR", [](const SequenceFrame& f) { return f.psnr; })});
  plot("Change from frame to frame", "grey levels",
       {series("pictures",
               [](const SequenceFrame& f) {
                 return f.flicker ? std::optional(f.flicker->pictures) : std::nullopt;
               }),
        series("volume", [](const SequenceFrame& f) {
          return f.flicker ? std::optional(f.flicker->renders) : std::nullopt;
        })});
  plot("Light", "grey levels m2", {series("light", [](const SequenceFrame& f) { return f.light; })});
  plot("Time", "s",
       {series("reconstruction", [](const SequenceFrame& f) { return f.reconstruction.value(); }),
        series("loading", [](const SequenceFrame& f) { return f.loading.value(); }),
        series("writing", [](const SequenceFrame& f) { return f.writing.value(); })});
  if (more) more(page);
  std::vector<std::vector<std::string>> rows;
  for (const SequenceFrame& f : told.frames) {
    if (!f.error.empty())
      rows.push_back({std::to_string(f.frame), f.error, "", "", "", ""});
    else
      rows.push_back({std::to_string(f.frame), f.start, std::to_string(f.iterations),
                      fmt::format("{:.2f}", f.input_rmse),
                      f.heldout_rmse ? fmt::format("{:.2f}", *f.heldout_rmse) : "",
                      fmt::format("{:.2f}", (f.loading + f.reconstruction + f.writing).value())});
  }
  page.heading("Frames");
  page.table({"frame", "started from", "iterations", "input error", "held-out error", "seconds"}, rows);
  return page.str();
}

}  // namespace emberlock::report
