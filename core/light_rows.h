#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/aperture_light.h"
#include "core/direct_integrators.h"
#include "core/sky_interpolation.h"

namespace naturel {

/// Sparse rows of numbers, one for each band that differs.
struct BandRows {
    std::size_t bands = 1;                ///< 1 where all three are equal, else 3
    std::vector<std::size_t> begin{0};    ///< [row + 1]
    std::vector<std::uint32_t> column{};  ///< [entry], increasing in a row
    std::vector<double> value{};          ///< [entry][band]

    std::size_t count() const { return begin.size() - 1; }
};

/// Which outdoor surface a column of LightRows::outdoors is.
class OutdoorColumns {
public:
    OutdoorColumns(const OutdoorSurfaces& surfaces) : lattice_count_(surfaces.lattice.nodes.size()), face_count_(surfaces.nodes.size()) {}

    std::uint32_t open_ground() const { return 0; }
    std::uint32_t lattice(std::size_t node) const { return static_cast<std::uint32_t>(1 + node); }
    std::uint32_t face(std::size_t node) const { return static_cast<std::uint32_t>(1 + lattice_count_ + node); }
    bool is_ground(std::uint32_t column) const { return column <= lattice_count_; }
    std::size_t lattice_count() const { return lattice_count_; }
    std::size_t size() const { return 1 + lattice_count_ + face_count_; }

private:
    std::size_t lattice_count_, face_count_;
};

/// Illuminance of points by the sky and by outdoor surfaces, lx per cd/m2. The sun is not among it.
struct LightRows {
    BandRows sky{};       ///< columns: SkyInterpolation's directions
    BandRows outdoors{};  ///< columns: OutdoorColumns
};

/// What stands around the points.
struct RowScene {
    const Building& building;
    const PatchGrid& grid;
    const OutdoorSurfaces& surfaces;
    const FacetTree& tree;
    const Visibility& visibility;
    double tolerance = 1e-3;
};

/// A point whose light is asked for.
struct RowPoint {
    GatherPoint point{};
    enum class Kind { dark, indoors, open_air } kind = Kind::dark;  ///< dark: an empty row
};

/// In parallel. apertures: of indoor points. bands: 1 where all glazings are grey, else 3.
LightRows find_light_rows(const RowScene& scene, const ApertureOutlook& apertures, std::span<const RowPoint> points, std::size_t bands,
                          const SkyInterpolation& sky, const RaySpacing& spacing, Progress& progress);

}  // namespace naturel
