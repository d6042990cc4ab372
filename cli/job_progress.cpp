#include "cli/job_progress.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/file_writer.h"
#include "cli/forecast.h"
#include "cli/json_text.h"

namespace naturel {

void tell(ProgressForm form, Remark remark, const std::string& text) {
    const char* const words[] = {"note", "warning", "error"};
    const char* const beginnings[] = {"", "warning: ", "naturel: "};
    const auto kind = static_cast<std::size_t>(remark);
    nlohmann::ordered_json json;
    json[words[kind]] = text;
    print_at_once(stderr, (form == ProgressForm::json ? json_line(json) : beginnings[kind] + text) + '\n');
}

std::string JobProgress::account() const {
    const std::size_t over = done_ + failed_;
    std::string text = fmt::format("{} of {}", over, counted(jobs_, "job"));
    if (over > 0) {
        const double rate = static_cast<double>(over) / seconds();
        text += fmt::format(", {:.3g} a second, {} left", rate, in_time(static_cast<double>(jobs_ - over) / rate));
    }
    return failed_ > 0 ? text + fmt::format(", {} failed", failed_) : text;
}

void JobProgress::begin(std::string_view stage, std::size_t total) {
    const bool is_new = stage != stage_;
    stage_ = stage;
    if (is_new && form_ == ProgressForm::json) write();
    told_.begin(fmt::format("{}: {}", account(), stage), total);
}

void JobProgress::add(std::size_t done, std::size_t failed) {
    done_ += done;
    failed_ += failed;
    const auto pause = std::chrono::steady_clock::now() - written_;
    if (pause >= (form_ == ProgressForm::json ? std::chrono::milliseconds(500) : std::chrono::milliseconds(30000))) write();
}

void JobProgress::write() {
    written_ = std::chrono::steady_clock::now();
    std::string line;
    if (form_ == ProgressForm::json) {
        const std::size_t over = done_ + failed_;
        nlohmann::ordered_json json{{"jobs", jobs_}, {"done", done_}, {"failed", failed_}, {"stage", stage_}, {"seconds", seconds()}};
        if (over > 0) {
            json["jobs_per_second"] = static_cast<double>(over) / seconds();
            json["seconds_left"] = seconds() * static_cast<double>(jobs_ - over) / static_cast<double>(over);
        }
        line = json.dump() + '\n';
    } else if (form_ == ProgressForm::text && !drawn_) {
        line = account() + '\n';
    }
    std::fputs(line.c_str(), stderr);
}

}  // namespace naturel
