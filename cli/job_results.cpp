#include "cli/job_results.h"

#include <fmt/format.h>

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <nlohmann/json.hpp>

#include "cli/csv_table.h"
#include "cli/file_writer.h"
#include "cli/forecast.h"
#include "cli/job_figures.h"
#include "cli/json_text.h"
#include "cli/little_endian.h"
#include "cli/npy.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

/// Columns of figures in the order in which jobs first have them.
class Columns {
public:
    std::size_t of(const std::string& name) {
        const auto [place, is_new] = index_.emplace(name, names_.size());
        if (is_new) names_.push_back(name);
        return place->second;
    }
    const std::vector<std::string>& names() const { return names_; }

private:
    std::vector<std::string> names_;
    std::map<std::string, std::size_t> index_;
};

using Figures = std::vector<std::optional<double>>;  ///< [column]

/// Every number below `json`, in the column that its path names: "work plane.illuminance_lx.mean".
void flatten(const Json& json, const std::string& name, Columns& columns, Figures& figures) {
    const auto below = [&](const std::string& key) { return name.empty() ? key : name + '.' + key; };
    if (json.is_object()) {
        // Sets of sensors stand under their own names.
        for (const auto& [key, value] : json.items())
            flatten(value, key == "sensor_sets" ? name : below(key), columns, figures);
    } else if (json.is_array()) {
        for (Json value : json) {
            const std::string id = value.at("id").get<std::string>();
            value.erase("id");
            flatten(value, below(id), columns, figures);
        }
    } else if (json.is_number() || json.is_boolean()) {
        const std::size_t column = columns.of(name);
        if (figures.size() <= column) figures.resize(column + 1);
        figures[column] = json.is_boolean() ? (json.get<bool>() ? 1.0 : 0.0) : json.get<double>();
    }
}

void add_parameter(CsvTable& table, const Json& value) {
    if (value.is_number())
        table.cell(value.get<double>());
    else
        table.cell(std::string_view(value.is_string() ? value.get<std::string>() : value.is_null() ? "" : value.dump()));
}

/// A row of the table of results.
struct Row {
    std::optional<std::size_t> row_of_group;  ///< from 0; none of an invalid scene, which has no group
    std::string status, error;
    Figures figures;
};

std::string results_csv(const JobList& list, const std::vector<Row>& rows, const Columns& columns) {
    std::string header = "job,group,key";
    if (list.sensors) header += ",row";
    for (const auto& [name, value] : list.jobs.front().parameters.items()) header += ',' + CsvTable::quoted(name);
    header += ",status";
    for (const std::string& name : columns.names()) header += ',' + CsvTable::quoted(name);
    CsvTable table(header + ",error");
    for (std::size_t k = 0; k < rows.size(); ++k) {
        table.cell(k + 1).cell(list.jobs[k].group).cell(std::string_view(short_key(list.jobs[k].key)));
        if (list.sensors) {
            if (rows[k].row_of_group)
                table.cell(*rows[k].row_of_group);
            else
                table.cell(std::string_view());
        }
        for (const auto& [name, value] : list.jobs[k].parameters.items()) add_parameter(table, value);
        table.cell(std::string_view(rows[k].status));
        for (std::size_t c = 0; c < columns.names().size(); ++c)
            table.cell(c < rows[k].figures.size() ? rows[k].figures[c] : std::optional<double>());
        table.cell(std::string_view(rows[k].error));
        table.end_row();
    }
    return std::move(table).take();
}

std::string sensors_csv(const Json& sensors) {
    CsvTable table("column,id,set,x_m,y_m,z_m,nx,ny,nz,medium");
    std::size_t column = 0;
    for (const Json& sensor : sensors) {
        table.cell(column++).cell(std::string_view(sensor.at("id").get<std::string>())).cell(std::string_view(sensor.at("set").get<std::string>()));
        for (const Json& number : sensor.at("point")) table.cell(number.get<double>());
        table.cell(std::string_view(sensor.at("medium").get<std::string>()));
        table.end_row();
    }
    return std::move(table).take();
}

/// Light on the sensors of a group, a job after the other; NaN where there is none.
void write_sensors(const std::filesystem::path& folder, const FinishedJobs& finished, std::size_t group,
                   const std::vector<const ListedJob*>& jobs) {
    const RecordPlace* place = finished.find(jobs.front()->group_key);
    if (place == nullptr) return;
    const Json sensors = Json::parse(read_record(*place).json).at("sensors");
    write_file(folder / fmt::format("sensors_{}.csv", group), sensors_csv(sensors));
    const std::vector<double> nothing(sensors.size() * sensor_quantities.size(), std::numeric_limits<double>::quiet_NaN());
    WholeFile file(folder / fmt::format("sensors_{}.npy", group));
    file.write(npy_header(npy_type<double>(), fmt::format("({}, {}, {})", jobs.size(), sensors.size(), sensor_quantities.size())));
    for (const ListedJob* job : jobs) {
        const RecordPlace* record = finished.state(job->key) == JobState::done ? finished.find(job->key) : nullptr;
        file.write(bytes_of(std::span<const double>(record != nullptr ? read_record(*record).numbers : nothing)));
    }
    file.put_in_place();
}

}  // namespace

JobCounts count_jobs(const JobList& list, const FinishedJobs& finished) {
    JobCounts counts;
    for (const ListedJob& job : list.jobs) {
        const JobState state = finished.state(job.key);
        ++(state == JobState::done ? counts.done : state == JobState::failed ? counts.failed : counts.missing);
    }
    return counts;
}

std::string account_of(const JobList& list, const JobCounts& counts) {
    return fmt::format("study \"{}\": {} done, {} failed, {} missing", list.study, counted(counts.done, "job"), counts.failed, counts.missing);
}

std::string account_of_convergence(const JobCounts& counts) {
    return counts.not_converged > 0 ? fmt::format("  {} did NOT converge\n", counted(counts.not_converged, "job")) : std::string();
}

JobCounts write_results(const std::filesystem::path& folder, const JobList& list, const FinishedJobs& finished) {
    JobCounts counts = count_jobs(list, finished);
    std::vector<Row> rows;
    Columns columns;
    std::map<std::size_t, std::vector<const ListedJob*>> groups;
    WholeFile lines(folder / "results.jsonl");
    for (const ListedJob& job : list.jobs) {
        std::vector<const ListedJob*>& group = groups[job.group];
        Row row{job.group > 0 ? std::optional(group.size()) : std::nullopt, "missing", {}, {}};
        group.push_back(&job);
        Json line{{"job", rows.size() + 1}, {"key", job.key}, {"group", job.group}, {"parameters", job.parameters}, {"status", row.status}};
        if (const RecordPlace* place = finished.find(job.key)) {
            Json record = Json::parse(read_record(*place).json);
            row.status = record.at("status").get<std::string>();
            row.error = record.value("error", std::string());
            record.erase("key");
            line.update(record);
            if (record.contains("figures")) {
                flatten(record["figures"], {}, columns, row.figures);
                if (!record["figures"]["radiosity"]["converged"].get<bool>()) ++counts.not_converged;
            }
        }
        lines.write(json_line(line) + '\n');
        rows.push_back(std::move(row));
    }
    write_file(folder / "results.csv", results_csv(list, rows, columns));
    if (list.sensors)
        for (const auto& [group, jobs] : groups)
            if (group > 0) write_sensors(folder, finished, group, jobs);
    lines.put_in_place();
    return counts;
}

}  // namespace naturel
