#pragma once
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/visibility.h"
#include "embree_backend/embree_visibility.h"
#include "hemicube_backend/hemicube_visibility.h"

namespace naturel {

/// The options of every visibility method; each backend takes its own.
struct BackendOptions {
    HemicubeOptions hemicube;
    EmbreeOptions embree;  ///< plain data: known also to a program built without Embree
    /// embree: pairs give way to rays where there are more patches; a preset may choose that, nobody who asks for pairs gets it.
    std::size_t most_patches_for_pairs = std::numeric_limits<std::size_t>::max();
};

/// The options in force on a grid. Backends, forecasts and settings take them by themselves.
BackendOptions settled(BackendOptions options, const PatchGrid& grid);

/// One visibility method built into this program.
struct Backend {
    std::string_view name;
    std::string_view library;  ///< "Embree 3.13.5"; empty when it needs none
    std::unique_ptr<Visibility> (*make)(const Building& building, const PatchGrid& grid,
                                        const BackendOptions& options);
};

/// Every backend of this program, in the order in which "both" runs them.
const std::vector<Backend>& all_backends();

/// Ray casting where it is built in, else projection.
std::string default_backend();

/// Every word that backends_named() knows.
std::vector<std::string> backend_words();

/// The backends a word stands for: one by its name, or "both". Empty when the word is unknown.
std::vector<Backend> backends_named(std::string_view word);

}  // namespace naturel
