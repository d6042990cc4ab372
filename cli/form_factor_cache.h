#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

/// Form factors that outlive the process, for later runs with the same geometry, grid and options of visibility.
struct FormFactorCache {
    std::filesystem::path folder{};  ///< empty: none is kept
    double limit_bytes = 1e10;       ///< of all files in the folder; those used longest ago go first
    double least_seconds = 0.0;      ///< what was computed faster, by the clock, is not kept
    std::function<void(const std::string&)> tell{};  ///< of what goes wrong with it; default: a line on stderr
};

/// Form factors for what comes next in this process: those computed last, if asked to keep them.
class FormFactorMemory {
public:
    /// Whether form factors found or kept from now on will be asked for once more.
    void expect_more(bool more) { more_ = more; }
    /// What was kept under a key. Without more to come, it is kept no longer.
    std::optional<FormFactorRows> find(const std::string& key);
    void keep(const std::string& key, const FormFactorRows& rows);

private:
    bool more_ = false;
    std::string key_;
    FormFactorRows rows_;
};

/// Of everything the form factors of a grid depend on, the version of the program included.
std::string form_factor_key(const Building& building, const PatchGrid& grid, const Visibility& visibility, std::size_t rows, bool with_errors);

/// The same visibility, but all form factors together come from the folder if they are there, and go there if not. A file that is
/// damaged counts as absent; a folder that cannot be written to costs a note on stderr and nothing else. Many processes may share
/// a folder. Without a folder and memory: the visibility as it is. building, grid, memory: keep them alive.
std::unique_ptr<Visibility> with_cache(std::unique_ptr<Visibility> visibility, const Building& building, const PatchGrid& grid,
                                       const FormFactorCache& cache, FormFactorMemory* memory = nullptr);

/// Removes the files of a cache, and its folder if nothing else is in it.
void remove_kept_rows(const std::filesystem::path& folder);

/// Whether form factors that were asked for came out of a cache or memory, so that their time is not that of computing them.
bool came_from_cache(const Visibility& visibility);

}  // namespace naturel
