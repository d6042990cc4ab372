#pragma once
#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

#include "cli/backends.h"
#include "core/building.h"
#include "core/daylight.h"
#include "core/scene_reader.h"

namespace naturel {

/// Every accuracy option of every stage and backend, chosen together. What the command line or the scene
/// names wins.
struct QualityPreset {
    std::string_view name;
    double grid_spacing_m;     ///< longest cell indoors ...
    std::size_t most_patches;  ///< ... but longer cells where there would be more than about so many
    double outdoor_grid_spacing_m;
    double direct_tolerance;
    IndirectMethod node_indirect;
    IndirectMethod sensor_indirect;
    double radiosity_tolerance;
    FormFactorMethod form_factors;  ///< embree
    /// embree, pairwise: with more patches rays are cast instead, for neither time nor memory hold the square of their number.
    std::size_t most_patches_for_pairs;
    double longest_cell_for_pairs_m;  ///< to get that few patches cells grow to this at most
    double pair_tolerance;            ///< embree, pairwise
    int rays_per_patch;             ///< embree, hemisphere
    int rays_per_point;             ///< embree, hemisphere
    int cells;                      ///< hemicube
};

inline constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

/// No setting of a finer preset is coarser than that of the one before, in buildings of any size.
inline constexpr std::array quality_presets{
    // clang-format off
    //                           m   patches     m   direct             nodes                    sensors  radiosity                    form factors  at most  cells   pairs   rays per patch, point  cells
    QualityPreset{"draft",      0.5,     4000,  2.0,  1e-2, IndirectMethod::patch,  IndirectMethod::gather, 1e-4, FormFactorMethod::hemisphere, any_number,  0.5,  1e-3,    256,     256,  64},
    QualityPreset{"normal",    0.25,    20000,  1.0,  1e-3, IndirectMethod::patch,  IndirectMethod::gather, 1e-6, FormFactorMethod::hemisphere, any_number, 0.25,  1e-4,    512,    2048, 256},
    QualityPreset{"fine",     0.125,    60000,  0.5,  5e-4, IndirectMethod::gather, IndirectMethod::gather, 1e-7, FormFactorMethod::hemisphere, any_number, 0.125, 1e-5,   2048,   16384, 512},
    QualityPreset{"reference", 0.0625,  60000, 0.25,  2e-4, IndirectMethod::gather, IndirectMethod::gather, 1e-8, FormFactorMethod::pairwise,        15000, 0.125, 1e-6,   8192,   65536, 1024},
    // clang-format on
};
inline constexpr const QualityPreset& normal_quality = quality_presets[1];

/// The table as --help shows it.
std::string quality_table();

/// What of it form factors depend on.
std::string form_factor_quality_table();

/// What a scene gets that does not say otherwise. Its grid spacing is left to choose_grid_spacing().
SceneDefaults scene_defaults(const QualityPreset& quality);

/// Options of the backends where none is given.
BackendOptions backend_options(const QualityPreset& quality);

/// Sets the spacing of the grid indoors if the scene named none: that of the preset, or as much longer as
/// keeps the number of patches down in a large building, or few enough for pairs.
void choose_grid_spacing(Scene& scene, const Building& building, const QualityPreset& quality);

}  // namespace naturel
