#include "cli/timing_writer.h"

#include <nlohmann/json.hpp>

#include "cli/csv_table.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<double>& number) {
    return number ? Json(*number) : Json();
}

Json json_of(const Estimate& estimate) {
    Json json{{"value", estimate.value}};
    if (estimate.interval) json["interval_95"] = {estimate.interval->low, estimate.interval->high};
    return json;
}

Json json_of(const std::optional<Estimate>& estimate) {
    return estimate ? json_of(*estimate) : Json();
}

Json json_of(const MachineDescription& machine) {
    Json software = Json::object();
    for (const auto& [name, version] : machine.software) software[name] = version;
    return {{"cpu", machine.cpu},
            {"processors", machine.processors},
            {"usable_processors", machine.usable_processors},
            {"quota_processors", json_of(machine.quota)},
            {"widest_simd", machine.widest_simd},
            {"governor", machine.governor},
            {"clock_mhz", json_of(machine.clock_mhz)},
            {"virtual_machine", machine.virtual_machine},
            {"kernel", machine.kernel},
            {"memory_bytes", machine.memory_bytes},
            {"load_at_start", json_of(machine.load)},
            {"software", software}};
}

std::string_view word(Scaling scaling) {
    return scaling == Scaling::weak ? "weak" : "strong";
}

void add_cells(CsvTable& table, const std::optional<Estimate>& estimate) {
    const std::optional<Interval> interval = estimate ? estimate->interval : std::nullopt;
    const auto cell = [&](std::optional<double> number) { table.cell(number); };
    cell(estimate ? std::optional(estimate->value) : std::nullopt);
    cell(interval ? std::optional(interval->low) : std::nullopt);
    cell(interval ? std::optional(interval->high) : std::nullopt);
}

}  // namespace

Json timing_json(const TimingStudy& study, const TimingFigures& figures) {
    Json stages = Json::array();
    for (const StageFigures& row : figures.stages) {
        stages.push_back({{"backend", row.backend},
                          {"scaling", word(row.scaling)},
                          {"stage", row.stage},
                          {"threads", row.threads},
                          {"patches", row.patches},
                          {"share", row.share},
                          {"wall_s", json_of(row.wall_s)},
                          {"cpu_s", json_of(row.cpu_s)},
                          {"speed_up", json_of(row.speed_up)},
                          {"efficiency", json_of(row.efficiency)},
                          {"cpu_ratio", json_of(row.cpu_ratio)},
                          {"karp_flatt", json_of(row.karp_flatt)},
                          {"fewest_threads_that_worked", row.fewest_threads_that_worked},
                          {"work_unit", row.work_unit},
                          {"work_per_s", row.work_unit.empty() ? Json() : json_of(row.work_per_s)},
                          {"peak_memory_bytes", row.peak_memory_bytes}});
    }
    Json serial = Json::array();
    for (const SerialFraction& row : figures.serial)
        serial.push_back({{"backend", row.backend}, {"stage", row.stage}, {"serial_fraction", json_of(row.fraction)}});
    Json runs = Json::array();
    for (const MeasuredRun& run : study.runs) {
        Json measured = Json::array();
        for (const MeasuredStage& stage : run.stages)
            measured.push_back({{"stage", stage.stage}, {"wall_s", stage.wall_s}, {"cpu_s", stage.cpu_s},
                                {"threads_that_worked", stage.threads_that_worked}, {"work", stage.work}});
        runs.push_back({{"backend", run.backend},
                        {"scaling", word(run.scaling)},
                        {"threads", run.threads},
                        {"repeat", run.repeat + 1},
                        {"patches", run.patches},
                        {"grid_spacing_m", run.grid_spacing_m},
                        {"peak_memory_bytes", run.peak_memory_bytes},
                        {"others_share", run.load ? Json(run.load->others) : Json()},
                        {"stolen_share", run.load ? Json(run.load->stolen) : Json()},
                        {"stages", measured}});
    }
    return {{"scene", {{"file", study.scene}, {"sha256", study.scene_sha256}}},
            {"command", study.command},
            {"threads", study.threads},
            {"repeats", study.repeats},
            {"same_results", true},  // or there would be no study
            {"machine", json_of(study.machine)},
            {"warnings", figures.warnings},
            {"stages", stages},
            {"serial", serial},
            {"runs", runs}};
}

std::string timing_csv(const TimingFigures& figures) {
    CsvTable table(
        "backend,scaling,stage,threads,patches,share,wall_s,wall_s_low,wall_s_high,cpu_s,cpu_s_low,cpu_s_high,speed_up,speed_up_low,"
        "speed_up_high,efficiency,efficiency_low,efficiency_high,cpu_ratio,cpu_ratio_low,cpu_ratio_high,karp_flatt,karp_flatt_low,"
        "karp_flatt_high,work_per_s,work_per_s_low,work_per_s_high,work_unit,fewest_threads_that_worked,peak_memory_bytes");
    for (const StageFigures& row : figures.stages) {
        table.cell(std::string_view(row.backend)).cell(word(row.scaling)).cell(std::string_view(row.stage));
        table.cell(static_cast<std::size_t>(row.threads)).cell(row.patches).cell(row.share);
        const std::optional<Estimate> rate = row.work_unit.empty() ? std::nullopt : std::optional(row.work_per_s);
        for (const std::optional<Estimate>& estimate :
             {std::optional(row.wall_s), std::optional(row.cpu_s), row.speed_up, row.efficiency, row.cpu_ratio, row.karp_flatt, rate})
            add_cells(table, estimate);
        table.cell(std::string_view(row.work_unit)).cell(static_cast<std::size_t>(row.fewest_threads_that_worked)).cell(row.peak_memory_bytes);
        table.end_row();
    }
    return std::move(table).take();
}

std::string timing_runs_csv(const TimingStudy& study) {
    CsvTable table(
        "backend,scaling,threads,repeat,stage,wall_s,cpu_s,threads_that_worked,work,work_unit,patches,peak_memory_bytes,others_share,"
        "stolen_share");
    for (const MeasuredRun& run : study.runs) {
        for (const MeasuredStage& stage : run.stages) {
            table.cell(std::string_view(run.backend)).cell(word(run.scaling)).cell(static_cast<std::size_t>(run.threads)).cell(run.repeat + 1);
            table.cell(std::string_view(stage.stage)).cell(stage.wall_s).cell(stage.cpu_s);
            table.cell(static_cast<std::size_t>(stage.threads_that_worked)).cell(stage.work).cell(std::string_view(stage.work_unit));
            table.cell(run.patches).cell(run.peak_memory_bytes);
            table.cell(run.load ? std::optional(run.load->others) : std::nullopt);
            table.cell(run.load ? std::optional(run.load->stolen) : std::nullopt);
            table.end_row();
        }
    }
    return std::move(table).take();
}

}  // namespace naturel
