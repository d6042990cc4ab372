#pragma once
#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

#include "core/progress.h"

namespace naturel {

enum class ProgressForm { none, text, json };

/// What the program says beside progress, on stderr.
enum class Remark { note, warning, error };
/// A line of text, or an object {"warning": "..."} where progress is told in objects.
void tell(ProgressForm form, Remark remark, const std::string& text);

/// Shows how far the jobs of a study are, and what goes on within one.
class JobProgress final : public Progress {
public:
    /// told: shows stages on a terminal. drawn: it does, so that no lines of text are needed.
    /// form: json writes an object a line to stderr; text a line now and then, unless drawn.
    JobProgress(Progress& told, ProgressForm form, bool drawn, std::size_t jobs)
        : told_(told), form_(form), drawn_(drawn), jobs_(jobs) {}

    void begin(std::string_view stage, std::size_t total) override;
    void advance(std::size_t steps) override { told_.advance(steps); }
    void end() override { told_.end(); }
    bool interrupted() const override { return told_.interrupted(); }

    /// Further jobs are over.
    void add(std::size_t done, std::size_t failed);
    /// All are: says so once more, where there were any.
    void finish() {
        if (jobs_ > 0 || form_ == ProgressForm::json) write();
    }

    std::size_t done() const { return done_; }
    std::size_t failed() const { return failed_; }
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
    std::string account() const;
    void write();

    Progress& told_;
    const ProgressForm form_;
    const bool drawn_;
    const std::size_t jobs_;
    std::size_t done_ = 0, failed_ = 0;
    std::string stage_;
    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point written_ = start_;
};

}  // namespace naturel
