#include "core/light_rows.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/parallel.h"

namespace naturel {
namespace {

/// Sums up a row in any order of its columns.
class RowSum {
public:
    void start(std::size_t columns) {
        if (sums_.size() < columns) sums_.resize(columns, {}), used_.resize(columns, false);
        touched_.clear();
    }
    void add(std::uint32_t column, double weight, const Band3& value) {
        if (!used_[column]) used_[column] = true, touched_.push_back(column);
        sums_[column] += weight * value;
    }
    /// Leaves everything clear.
    template <class Take>
    void finish(const Take& take) {
        std::sort(touched_.begin(), touched_.end());
        for (const std::uint32_t column : touched_) {
            take(column, sums_[column]);
            sums_[column] = {};
            used_[column] = false;
        }
    }

private:
    std::vector<Band3> sums_;
    std::vector<bool> used_;
    std::vector<std::uint32_t> touched_;
};

struct Scratch {
    AdaptiveScratch view;
    std::vector<ViewRay> rays;
    RowSum sky, outdoors;
};

/// One row, until all are put together.
struct Row {
    std::vector<std::uint32_t> column;
    std::vector<double> value;

    void take(std::size_t bands, RowSum& sum) {
        sum.finish([&](std::uint32_t at, const Band3& of_bands) {
            column.push_back(at);
            value.push_back(of_bands.r);
            if (bands == 3) value.insert(value.end(), {of_bands.g, of_bands.b});
        });
    }
};

BandRows join(std::vector<std::pair<Row, Row>>& rows, Row std::pair<Row, Row>::*part, std::size_t bands) {
    BandRows all{.bands = bands};
    std::size_t entries = 0;
    for (const auto& row : rows) entries += (row.*part).column.size();
    all.column.reserve(entries);
    all.value.reserve(entries * bands);
    for (auto& row : rows) {
        Row& one = row.*part;
        all.column.insert(all.column.end(), one.column.begin(), one.column.end());
        all.value.insert(all.value.end(), one.value.begin(), one.value.end());
        all.begin.push_back(all.column.size());
        one = {};
    }
    return all;
}

}  // namespace

LightRows find_light_rows(const RowScene& scene, const ApertureOutlook& apertures, std::span<const RowPoint> points, std::size_t bands,
                          const SkyInterpolation& sky, const RaySpacing& spacing, Progress& progress) {
    const OutdoorColumns columns(scene.surfaces);
    const OpenAir air(scene.building);
    const GroundLattice& lattice = scene.surfaces.lattice;
    std::vector<std::pair<Row, Row>> rows(points.size());
    ThreadScratch<Scratch> scratch;
    parallel_stage("light of directions", points.size(), 4, progress, [&](std::size_t n) {
        if (points[n].kind == RowPoint::Kind::dark) return;
        Scratch& memory = scratch.local();
        memory.sky.start(sky.size());
        memory.outdoors.start(columns.size());
        const bool indoors = points[n].kind == RowPoint::Kind::indoors;
        const GatherPoint& point = points[n].point;
        if (indoors) spread_rays(point, apertures, scene.tree, scene.tolerance, scene.visibility, spacing, memory.view, memory.rays);
        else spread_rays_in_open_air(point, air, scene.tree, scene.tolerance, scene.visibility, spacing, memory.view, memory.rays);
        SkyInterpolation::Stencil stencil;
        for (const ViewRay& ray : memory.rays) {
            const Band3 share = ray.projected_solid_angle_sr *
                                (indoors ? apertures.transmittance(point.position_m, ray.direction, ray.seen, ray.aperture) : grey(1.0));
            const OutdoorPlace place = find_outdoor_place(scene.building, scene.grid, lattice, point.position_m, ray.direction, ray.seen);
            switch (place.source) {
                case OutdoorSource::dark:
                    break;
                case OutdoorSource::sky:
                    sky.find(ray.direction, stencil);
                    for (std::size_t k = 0; k < stencil.count; ++k) memory.sky.add(stencil.nodes[k], stencil.weights[k], share);
                    break;
                case OutdoorSource::ground:
                    if (place.open_ground) {
                        memory.outdoors.add(columns.open_ground(), 1.0, share);
                        break;
                    }
                    for (const auto& [node, weight] : lattice.weights(place.on_lattice))
                        memory.outdoors.add(columns.lattice(node), weight, share);
                    break;
                case OutdoorSource::building: {
                    if (place.patch == PatchId::none) break;
                    const Patch& patch = scene.grid.patches[index(place.patch)];
                    const bool each = patch.corner_count <= OutdoorPlace::most_corners;
                    for (std::size_t k = 0; k < patch.corner_count; ++k)
                        memory.outdoors.add(columns.face(scene.surfaces.node_of_corner[patch.first_corner + k]),
                                            each ? place.corner_weights[k] : 1.0 / patch.corner_count, share);
                    break;
                }
            }
        }
        rows[n].first.take(bands, memory.sky);
        rows[n].second.take(bands, memory.outdoors);
    });
    return {join(rows, &std::pair<Row, Row>::first, bands), join(rows, &std::pair<Row, Row>::second, bands)};
}

}  // namespace naturel
