// SPDX-License-Identifier: Apache-2.0
#include "recon/export/report.h"

#include <nlohmann/json.hpp>

namespace emberlock::recon {
namespace {

using nlohmann::ordered_json;

ordered_json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json trace_json(const Report& report, const std::vector<TracePoint>& points) {
  auto trace = ordered_json::array();
  for (const TracePoint& point : points) {
    trace.push_back(
        {{"seconds", point.time.value()},
         {"iteration", point.iteration},
         {"input_rmse", point.input_rmse},
         {"heldout_rmse", report.heldout_rmse ? ordered_json(point.heldout_rmse) : ordered_json()}});
  }
  return trace;
}

ordered_json effects_json(const Report& report) {
  auto effects = ordered_json::array();
  for (const EffectReport& effect : report.effects) {
    effects.push_back({{"name", effect.name},
                       {"on", effect.on},
                       {"predicted_change", effect.predicted_change},
                       {"seconds", effect.seconds.value()},
                       {"cost", effect.cost.value()},
                       {"reason", effect.reason}});
  }
  return effects;
}

ordered_json preprocessing_json(const Report& report) {
  auto steps = ordered_json::array();
  for (const PreprocessStep& step : report.preprocessing)
    steps.push_back({{"step", step.name}, {"on", step.on}, {"reason", step.reason}});
  return steps;
}

ordered_json views_json(const Report& report) {
  auto views = ordered_json::array();
  for (const ViewReport& view : report.views) {
    views.push_back(
        {{"index", views.size()}, {"name", view.name}, {"role", name(view.role)}, {"rmse", view.rmse}});
  }
  return views;
}

ordered_json choice_json(const VoxelChoice& choice) {
  auto options = ordered_json::array();
  for (const VoxelChoice::Option& option : choice.options)
    options.push_back({{"voxels", option.voxels}, {"seconds", option.time.value()}, {"error", option.error}});
  return {{"rule", choice.rule},
          {"voxels", choice.voxels},
          {"by_the_paper", choice.by_the_paper},
          {"calibration_seconds", choice.calibration_time.value()},
          {"expected_seconds", choice.expected_time.value()},
          {"options", std::move(options)},
          {"words", choice.words}};
}

template <class T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json plan_json(const std::optional<PlanReport>& plan) {
  if (!plan) return {};
  return {{"budget", plan->budget ? ordered_json(plan->budget->value()) : ordered_json()},
          {"target_rmse", or_null(plan->target_rmse)},
          {"reference_seconds", plan->reference_time.value()},
          {"attempts", plan->attempts},
          {"voxels", plan->voxels},
          {"iterations", plan->iterations},
          {"effects_searched", plan->effects_searched},
          {"predicted_seconds", plan->predicted_time.value()},
          {"predicted_rmse", or_null(plan->predicted_rmse)},
          {"predicted_rmse_without", or_null(plan->predicted_rmse_without)},
          {"over_budget", plan->over_budget.value()},
          {"missed_by", plan->missed_by},
          {"remedy", plan->remedy},
          {"words", plan->words}};
}

ordered_json lines_json(const TemperatureSummary& t) {
  ordered_json found = ordered_json::array();
  for (const LineSummary& line : t.lines)
    found.push_back({{"name", line.name}, {"share", line.share}, {"seen", line.seen}});
  return {{"automatic", t.lines_automatic}, {"found", found}, {"alike", t.lines_alike}};
}

ordered_json errors_json(const std::optional<ErrorSummary>& errors) {
  if (!errors) return {};
  const ErrorSummary& e = *errors;
  ordered_json json = {{"light", e.light},   {"emission", e.emission}, {"extinction", e.extinction},
                       {"solves", e.solves}, {"models", e.models},     {"seconds", e.views_time.value()},
                       {"noise", nullptr}};
  if (e.noise)
    json["noise"] = {{"pixel", e.noise->pixel},
                     {"emission", e.noise->emission},
                     {"extinction", e.noise->extinction},
                     {"probes", e.noise->probes},
                     {"seconds", e.noise->time.value()}};
  return json;
}

ordered_json temperature_json(const std::optional<TemperatureSummary>& temperature) {
  if (!temperature) return {};
  const TemperatureSummary& t = *temperature;
  const TemperatureCounts& n = t.counts;
  return {
      {"emitter", name(t.emitter)},
      {"response", t.response_given ? "given" : "linear sRGB, assumed"},
      {"absolute", t.absolute},
      {"by_absorption", t.by_absorption},
      {"opacity", t.opacity},
      {"mean", t.mean},
      {"low", t.low},
      {"high", t.high},
      {"sigma", t.sigma},
      {"chi_square", t.chi_square},
      {"emitter_told", t.emitter_told},
      {"if_other", t.if_other},
      {"dispersion", t.dispersion},
      {"emitting", n.emitting},
      {"told", n.told},
      {"colder", n.colder},
      {"hotter", n.hotter},
      {"unclear", n.unclear},
      {"other", n.other},
      {"saturated", n.saturated},
      {"mixed", n.mixed},
      {"line_alone", n.lines},
      {"alike", n.alike},
      {"lines", lines_json(t)},
      {"solves", t.solves},
      {"joint",
       {{"iterations", t.joint.iterations},
        {"cost_before", t.joint.before},
        {"cost_after", t.joint.after},
        {"last_drop", t.joint.last_drop},
        {"moved", t.joint.moved},
        {"left_out", or_null(t.joint.left_out)}}},
      {"seconds",
       {{"errors", t.errors_time.value()}, {"reading", t.time.value()}, {"joint", t.joint.time.value()}}}};
}

}  // namespace

std::string to_json(const Report& report) {
  ordered_json json;
  json["heldout_rmse"] = or_null(report.heldout_rmse);
  json["input_rmse"] = report.input_rmse;
  json["warnings"] = report.warnings;
  json["input"] = report.input;
  json["up"] = report.up.empty() ? ordered_json() : ordered_json(report.up);
  json["solver"] = report.solver;
  json["deviations"] = report.deviations;
  json["device"] = report.device;
  json["threads"] = report.threads;
  json["seed"] = report.seed;
  json["step"] = report.step;
  json["precision"] = name(report.precision);
  json["box"] = {{"center", vector_json(report.box.center)}, {"size", vector_json(report.box.size)}};
  json["voxels"] = report.voxels;
  json["voxel_edge"] = report.voxel_edge.value();
  json["finest_voxels"] = report.finest_voxels;
  json["hull_voxels"] = report.hull_voxels;
  json["iterations"] = report.iterations;
  json["kept"] = {{"iteration", report.kept.iteration}, {"by", name(report.kept.by)}};
  json["stopped"] = report.stopped;
  json["seconds"] = {{"effects", report.effects_time.value()}, {"hull", report.hull_time.value()},
                     {"solve", report.solve_time.value()},     {"trace", report.trace_time.value()},
                     {"render", report.render_time.value()},   {"total", report.total_time.value()}};
  json["voxel_choice"] = choice_json(report.voxel_choice);
  json["plan"] = plan_json(report.plan);
  json["errors"] = errors_json(report.errors);
  json["temperature"] = temperature_json(report.temperature);
  json["preprocessing"] = preprocessing_json(report);
  json["effects"] = effects_json(report);
  json["views"] = views_json(report);
  json["trace_sample"] = {{"pixels", report.trace_sample.pixels}, {"of", report.trace_sample.of}};
  json["trace"] = trace_json(report, report.trace);
  json["discarded"] = trace_json(report, report.discarded);
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace emberlock::recon
