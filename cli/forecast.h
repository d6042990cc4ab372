#pragma once
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/result.h"
#include "core/patch_grid.h"

namespace naturel {

/// What a run will take, from counts and options alone.
struct Forecast {
    std::size_t rows = 0;         ///< of form factors
    double usual_entries = 0.0;   ///< of all rows, in a room most of which is seen from everywhere
    std::size_t longest_row = 0;  ///< entries, at most
    double samples = 0.0;         ///< for all rows; with a target error at most
    std::string_view sample_unit{};
    double process_bytes = 0.0;   ///< of the program and its libraries before there is any scene
    double form_factor_bytes = 0.0, light_bytes = 0.0, table_bytes = 0.0, picture_bytes = 0.0;
    double kept_row_bytes = 0.0;  ///< of form factors once they are computed
    /// CPU time on the machine of docs/method.md, "Forecasts"; the half or the double is possible.
    double form_factor_seconds = 0.0, gather_seconds = 0.0, direct_seconds = 0.0, picture_seconds = 0.0;
    double picture_writer_seconds = 0.0;  ///< once in a process

    /// The most at one time: pictures come after the form factors are gone, but for half of their memory (docs/method.md, "Forecasts").
    double peak_bytes() const;
    double seconds() const { return form_factor_seconds + gather_seconds + direct_seconds + picture_seconds + picture_writer_seconds; }
};
Forecast forecast(const Scene& scene, const Building& building, const PatchGrid& grid, std::size_t sensors,
                  std::string_view backend, const BackendOptions& options, IndirectMethod node_indirect);

/// What a stage asks of the visibility: a count that follows from options and scene alone.
struct StageWork {
    std::string_view stage;
    double count = 0.0;
    std::string_view unit;
};
/// Of the stages whose work is known beforehand and was done; a method that goes on until an error is small enough is not.
std::vector<StageWork> stage_work(const Result& result);

/// "12 MB", "3.4 GB"; "5 s", "3 min", "2.5 h".
std::string in_bytes(double bytes);
std::string in_time(double seconds);
/// "1.23 million", "4.5 billion".
std::string in_millions(double number);
/// "at most ", where work goes on until an error is small enough; else nothing.
std::string_view at_most(std::string_view backend, const BackendOptions& options);

/// "1 job", "3 jobs".
std::string counted(std::size_t number, std::string_view noun);

/// Throws InputError when a run needs more memory than there is. Asks for a sample of the rows only where rows that see
/// everything would not fit.
void refuse_what_memory_cannot_hold(const Forecast& forecast, const Visibility& visibility, const PatchGrid& grid,
                                    Progress& progress);

/// The text of --dry-run for one backend: counts, every option in force, memory and work.
std::string dry_run_account(const RunOptions& options, const Scene& scene, const Building& building,
                            const PatchGrid& grid, const std::vector<Sensor>& sensors,
                            const Visibility& visibility);

}  // namespace naturel
