#pragma once
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/patch_grid.h"

namespace naturel {

/// What a run will take, from counts alone.
struct Forecast {
    std::size_t rows = 0;         ///< of form factors
    std::size_t longest_row = 0;  ///< entries, at most
    double form_factor_bytes = 0.0, light_bytes = 0.0, table_bytes = 0.0, picture_bytes = 0.0;

    /// The most at one time: pictures come after the form factors are gone.
    double peak_bytes() const;
};
Forecast forecast(const Scene& scene, const PatchGrid& grid, std::size_t sensors, std::string_view backend,
                  const BackendOptions& options);

/// The text of --dry-run for one backend: counts, every option in force, memory and work.
std::string dry_run_account(const RunOptions& options, const Scene& scene, const Building& building,
                            const PatchGrid& grid, const std::vector<Sensor>& sensors,
                            const Visibility& visibility);

}  // namespace naturel
