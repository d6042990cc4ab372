#include "core/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "core/aperture_light.h"
#include "core/parallel.h"
#include "core/picture_sun.h"
#include "core/view.h"

namespace naturel {

namespace {

using glm::dvec3;

/// Rows of pixels that are drawn at a time, at most: the facets of their samples are all that is in memory. A power of two: blocks as
/// high as this are halved down to pixels.
constexpr int most_band_rows = 8;
/// Of one band; 8 bytes each where a z-buffer finds them.
constexpr std::int64_t most_band_samples = 4'000'000;

/// Points on surfaces are lifted off them by this for gathering, as sensors are.
constexpr double lifted_m = 1e-5;

/// What one ray of a view meets.
struct Look {
    enum class Kind : std::uint8_t { nothing, cut, black, indoors, building, sky, ground };
    Kind kind = Kind::nothing;
    FacetId facet = FacetId::none;
    PatchId patch = PatchId::none;
    std::uint64_t through = 0;  ///< tells the sets of apertures on the way apart

    bool operator==(const Look&) const = default;
};

class Painter {
public:
    Painter(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
            const DaylightSolution& solution, const Camera& samples, const View& view)
        : scene_(scene),
          building_(building),
          grid_(grid),
          visibility_(visibility),
          solution_(solution),
          apertures_(scene, building, grid, solution.outdoors),
          camera_(samples),
          samples_per_side_(view.samples),
          sun_(samples, solution.outdoors.sun_direction, solution.outdoors.direct_normal_illuminance_lx) {
        node_lx_.reserve(solution.nodes.size());
        for (const PointIlluminance& node : solution.nodes) node_lx_.push_back(node.direct.by_source() + node.indirect_lx);
        if (view.quality == PictureQuality::gather) direct_.emplace(scene, building, grid, solution.outdoors, visibility);
        find_cut_polyhedra();
    }

    /// Equal samples of a pixel.
    struct Sample {
        Camera::Ray ray{};
        Look look{};
        int count = 1;
        double sun_cd_m2 = 0.0;     ///< luminance of the sun there
        double distance_m = std::numeric_limits<double>::infinity();
        LightBySource illuminance_lx{};  ///< indoors

        dvec3 point_m() const { return ray.origin_m + distance_m * ray.direction; }
    };

    /// Where a ray goes through an aperture: distance, and its number.
    using Crossing = std::pair<double, std::size_t>;

    /// Memory of one thread.
    struct Scratch {
        std::vector<FacetId> seen;  ///< by the samples of a band
        std::vector<Sample> samples;
        std::vector<double> weights;
        std::vector<Crossing> crossings;
        FormFactorRow row;
    };

    /// Pixels of a band that are painted together.
    struct Block {
        int column = 0, row = 0, columns = 0, rows = 0;
    };

    /// Paints a block: at once where all of it shows one thing, else in quarters. first_row: of the band, whose samples are in `scratch`.
    void paint(const Block& block, int first_row, Scratch& scratch, Picture& picture) const {
        if (block.columns <= 0 || block.rows <= 0) return;
        const auto all = look_of_all(block, first_row, scratch);
        if (all || (block.columns == 1 && block.rows == 1)) {
            for (int row = block.row; row < block.row + block.rows; ++row)
                for (int column = block.column; column < block.column + block.columns; ++column)
                    paint_pixel(column, row, all, first_row, scratch, picture);
            return;
        }
        const int columns = (block.columns + 1) / 2, rows = (block.rows + 1) / 2;
        for (const Block& quarter : {Block{block.column, block.row, columns, rows},
                                     Block{block.column + columns, block.row, block.columns - columns, rows},
                                     Block{block.column, block.row + rows, columns, block.rows - rows},
                                     Block{block.column + columns, block.row + rows, block.columns - columns, block.rows - rows}})
            paint(quarter, first_row, scratch, picture);
    }

private:
    struct Sums {
        Band3 luminance_cd_m2{};
        LightBySource illuminance_lx{};
        int shown = 0, on_surfaces = 0;
    };

    FacetId facet_seen(const Scratch& scratch, int first_row, int column, int row) const {
        const auto line = static_cast<std::size_t>(row - first_row * samples_per_side_);
        return scratch.seen[line * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(column)];
    }

    /// What all samples of a block meet, where that is one thing whose light is smooth.
    std::optional<Look> look_of_all(const Block& block, int first_row, const Scratch& scratch) const {
        const int n = samples_per_side_, left = block.column * n, top = block.row * n;
        const int right = left + block.columns * n - 1, bottom = top + block.rows * n - 1;
        // What one plane shows of a rectangle of a flat picture is convex, and so are patches and the parts of apertures: what all
        // corners show fills the block. In a round one this holds for what is small. A pane that stands free and has all of its
        // outline within a block is looked for in its middle, too.
        const bool flat = camera_.kind == ViewKind::perspective || camera_.kind == ViewKind::parallel;
        if (!flat && (block.columns > 1 || block.rows > 1)) return {};
        if (!camera_.cut_planes.empty()) return {};  // solids may be cut anywhere
        if (sun_.may_show(left, right + 1, top, bottom + 1)) return {};
        const FacetId facet = facet_seen(scratch, first_row, left, top);
        for (int row = top; row <= bottom; ++row)
            for (int column = left; column <= right; ++column)
                if (facet_seen(scratch, first_row, column, row) != facet) return {};
        const auto corner = [&](int column, int row) { return look(camera_.ray(column + 0.5, row + 0.5), column, row, facet); };
        const Look first = corner(left, top);
        if (first.kind == Look::Kind::sky && !solution_.outdoors.sky.is_smooth()) return {};
        if (direct_ && !grid_.follows_zones && solution_.outdoors.direct_normal_illuminance_lx > 0.0) return {};
        if (first != corner(right, top) || first != corner(left, bottom) || first != corner(right, bottom)) return {};
        if (first != corner((left + right) / 2, (top + bottom) / 2)) return {};
        return first;
    }

    /// all: what the samples of the pixel meet, where that is one thing.
    void paint_pixel(int column, int row, const std::optional<Look>& all, int first_row, Scratch& scratch, Picture& picture) const {
        const int n = samples_per_side_, left = column * n, top = row * n;
        scratch.samples.clear();
        if (all) {
            scratch.samples.push_back({.ray = camera_.ray(left + 0.5 * n, top + 0.5 * n), .look = *all, .count = n * n});
        } else {
            for (int j = top; j < top + n; ++j) {
                for (int i = left; i < left + n; ++i) {
                    Sample sample{.ray = camera_.ray(i + 0.5, j + 0.5)};
                    sample.look = look(sample.ray, i, j, facet_seen(scratch, first_row, i, j));
                    if (sample.look.kind == Look::Kind::sky) sample.sun_cd_m2 = sun_.luminance_cd_m2(i, j, sample.ray.direction);
                    scratch.samples.push_back(sample);
                }
            }
        }
        for (Sample& sample : scratch.samples)
            if (sample.look.facet != FacetId::none) sample.distance_m = distance_m(sample.ray, building_.facets[index(sample.look.facet)]);
        if (direct_)
            gather(scratch);
        else
            for (Sample& sample : scratch.samples)
                if (sample.look.kind == Look::Kind::indoors)
                    sample.illuminance_lx = interpolated_lx(sample.look.patch, sample.point_m(), scratch.weights);

        Sums sums;
        for (const Sample& sample : scratch.samples) add(sample, scratch, sums);
        const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(column);
        if (sums.shown > 0) picture.luminance_cd_m2[pixel] = 1.0 / sums.shown * sums.luminance_cd_m2;
        const Band3 none = grey(std::numeric_limits<double>::quiet_NaN());
        picture.illuminance_lx[pixel] = sums.on_surfaces > 0 ? 1.0 / sums.on_surfaces * sums.illuminance_lx.total() : none;
        picture.sky_illuminance_lx[pixel] = sums.on_surfaces > 0 ? 1.0 / sums.on_surfaces * sums.illuminance_lx.sky : none;
        picture.coverage[pixel] = static_cast<float>(sums.shown) / static_cast<float>(n * n);
        const Sample& first = scratch.samples.front();
        const std::uint32_t surface = surface_of(first);
        if (!std::ranges::all_of(scratch.samples, [&](const Sample& sample) { return surface_of(sample) == surface; })) return;
        picture.surface[pixel] = surface;
        picture.shown[pixel] = shown_by(first.look);
    }

    static PixelContent shown_by(const Look& look) {
        switch (look.kind) {
            case Look::Kind::nothing: return PixelContent::mixed;
            case Look::Kind::cut:
            case Look::Kind::black: return PixelContent::solid;
            case Look::Kind::indoors: return look.through == 0 ? PixelContent::indoors : PixelContent::other;
            default: return PixelContent::other;
        }
    }

    /// Picture::surface of what a sample meets. Light is smooth across the facets of a face, and across its patches up to the edge of
    /// a sunspot. Numbers are scattered over 32 bits: two surfaces side by side have the same in one of 4e9 cases.
    std::uint32_t surface_of(const Sample& sample) const {
        const Look& look = sample.look;
        if (look.kind == Look::Kind::nothing) return 0;
        std::uint64_t number = look.through;
        const auto mix = [&](std::uint64_t part) {  // the steps of splitmix64 (Steele et al. 2014)
            number = (number ^ part) + 0x9e3779b97f4a7c15u;
            number = (number ^ (number >> 30)) * 0xbf58476d1ce4e5b9u;
            number = (number ^ (number >> 27)) * 0x94d049bb133111ebu;
            number ^= number >> 31;
        };
        mix(static_cast<std::uint64_t>(look.kind));
        if (look.facet != FacetId::none) mix(index(building_.facets[index(look.facet)].face));
        if (look.patch != PatchId::none) mix(grid_.patches[index(look.patch)].sunspot);
        mix(sample.sun_cd_m2 > 0.0 ? 1 : 0);
        return std::max<std::uint32_t>(1, static_cast<std::uint32_t>(number));
    }

    /// seen: what view_facets() found along the ray.
    Look look(const Camera::Ray& ray, int column, int row, FacetId seen) const {
        Look look{.facet = seen};
        if (!camera_.shows(column + 0.5, row + 0.5)) return {};
        const Camera::Reach reach = camera_.reach(ray);
        if (reach.empty()) return {};
        if (reach.cut && starts_in_solid(ray, reach)) return {.kind = Look::Kind::cut};
        if (starts_in_ground(ray, reach, seen)) {
            // What is seen from above lies under the ground, too: it hides all that is deeper.
            return {.kind = ray.direction.z < 0.0 ? Look::Kind::ground : Look::Kind::cut};
        }
        double distance_m = reach.end_m;
        if (seen == FacetId::none) {
            if (std::isfinite(reach.end_m)) return {};
            look.kind = ray.direction.z < 0.0 ? Look::Kind::ground : Look::Kind::sky;
        } else {
            const Facet& facet = building_.facets[index(seen)];
            // The back of a one-sided polygon, or of a solid from inside.
            if (glm::dot(facet.normal, ray.direction) >= 0.0) return {.kind = Look::Kind::black};
            distance_m = Painter::distance_m(ray, facet);
            look.kind = facet.environment == Environment::indoor ? Look::Kind::indoors : Look::Kind::building;
            look.patch = grid_.patch_at(facet.face, ray.origin_m + distance_m * ray.direction);
        }
        each_crossing(ray, reach.begin_m, distance_m, [&](std::size_t k, double) { look.through += std::uint64_t{0x9e3779b97f4a7c15} * (k + 1); });
        return look;
    }

    static double distance_m(const Camera::Ray& ray, const Facet& facet) {
        return glm::dot(facet.normal, facet.vertices_m[0] - ray.origin_m) / glm::dot(facet.normal, ray.direction);
    }

    void add(const Sample& sample, Scratch& scratch, Sums& sums) const {
        const Look& seen = sample.look;
        const Camera::Ray& ray = sample.ray;
        if (seen.kind == Look::Kind::nothing) return;
        sums.shown += sample.count;
        if (seen.kind == Look::Kind::cut || seen.kind == Look::Kind::black) return;
        const auto count = static_cast<double>(sample.count);
        Band3 luminance;
        if (seen.kind == Look::Kind::indoors) {
            const Facet& facet = building_.facets[index(seen.facet)];
            const Material& material = scene_.materials[index(building_.faces[index(facet.face)].material)];
            luminance = 1.0 / pi * (material.reflectance * sample.illuminance_lx.total() + material.exitance_lm_m2);
            sums.illuminance_lx += count * sample.illuminance_lx;
            sums.on_surfaces += sample.count;
        } else {
            luminance = outdoor_luminance(solution_.outdoors, building_, grid_, ray.origin_m, ray.direction, seen.facet).total() +
                        sample.sun_cd_m2 * solution_.outdoors.sun_colour;
        }
        if (seen.through != 0) luminance = through_panes(luminance, ray, sample.distance_m, scratch.crossings);
        sums.luminance_cd_m2 += count * luminance;
    }

    /// What is left of a luminance behind panes, and what the panes themselves send back into the room.
    Band3 through_panes(Band3 luminance, const Camera::Ray& ray, double distance_m, std::vector<Crossing>& crossings) const {
        crossings.clear();
        each_crossing(ray, camera_.reach(ray).begin_m, distance_m,
                      [&](std::size_t k, double crossing_m) { crossings.push_back({crossing_m, k}); });
        std::ranges::sort(crossings, std::greater<>());
        for (const auto& [crossing_m, k] : crossings) {
            const Opening& opening = apertures_.openings()[k];
            const double slope = glm::dot(opening.normal, ray.direction);
            luminance = luminance * opening.glazing.transmittance(std::min(1.0, std::abs(slope)));
            std::optional<FaceId> side = building_.apertures[k].face;  // that of the room
            if (slope >= 0.0) side = building_.faces[index(*side)].other_side;
            if (!side) continue;
            const PatchId patch = grid_.patch_at(*side, ray.origin_m + crossing_m * ray.direction);
            if (patch != PatchId::none) luminance += 1.0 / pi * solution_.radiosity.exitance_lm_m2[index(patch)].total();
        }
        return luminance;
    }

    template <class Tell>
    void each_crossing(const Camera::Ray& ray, double begin_m, double end_m, const Tell& tell) const {
        const std::span<const Opening> openings = apertures_.openings();
        for (std::size_t k = 0; k < openings.size(); ++k) {
            const auto crossing_m = openings[k].crossing_m(ray.origin_m, ray.direction);
            if (crossing_m && *crossing_m >= begin_m && *crossing_m < end_m) tell(k, *crossing_m);
        }
    }

    LightBySource interpolated_lx(PatchId patch, const dvec3& point_m, std::vector<double>& weights) const {
        if (patch == PatchId::none) return {};
        const auto corners = grid_.corners_of(patch);
        weights.resize(corners.size());
        grid_.interpolation_weights(patch, point_m, weights);
        LightBySource illuminance_lx;
        for (std::size_t k = 0; k < corners.size(); ++k) illuminance_lx += weights[k] * node_lx_[index(corners[k])];
        return illuminance_lx;
    }

    /// Illuminance of the samples indoors, computed on the spot: that of the sun at each, everything else once for those of
    /// a facet, in their middle.
    void gather(Scratch& scratch) const {
        std::vector<Sample>& samples = scratch.samples;
        for (std::size_t first = 0; first < samples.size(); ++first) {
            const FacetId facet_id = samples[first].look.facet;
            const auto is_there = [&](const Sample& sample) { return sample.look.kind == Look::Kind::indoors && sample.look.facet == facet_id; };
            if (!is_there(samples[first]) || std::ranges::any_of(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(first), is_there)) continue;
            dvec3 sum_m{0};
            double count = 0;
            for (const Sample& sample : samples)
                if (is_there(sample)) sum_m += sample.point_m(), ++count;
            const Facet& facet = building_.facets[index(facet_id)];
            const GatherPoint point{1.0 / count * sum_m + lifted_m * facet.normal, facet.normal};
            const LightBySource sky_and_outdoors = direct_->without_sun(point).by_source();
            visibility_.gather_row(point, scratch.row);
            const LightBySource illuminance_lx = sky_and_outdoors + collect(scratch.row, solution_.radiosity.exitance_lm_m2, solution_.repair);
            for (Sample& sample : samples)
                if (is_there(sample)) sample.illuminance_lx = illuminance_lx + LightBySource{{}, sun_lx(sample, facet)};
        }
    }

    Band3 sun_lx(const Sample& sample, const Facet& facet) const {
        if (grid_.follows_zones) {
            const std::uint32_t spot = sample.look.patch == PatchId::none ? no_sunspot : grid_.patches[index(sample.look.patch)].sunspot;
            return spot == no_sunspot ? Band3{} : grid_.sunspot_illuminance_lx[spot];
        }
        const dvec3 place = sample.point_m() + lifted_m * facet.normal;
        Band3 found;
        direct_->sun_at({&place, 1}, facet.normal, {&found, 1});
        return found;
    }

    /// Whether the plane at which a ray begins cuts a solid: it is on both sides of it. What ends in the plane is not cut.
    bool starts_in_solid(const Camera::Ray& ray, const Camera::Reach& reach) const {
        // reach() begins before the plane; the other point is as far behind it.
        double slope = 1.0;
        for (const CutPlane& plane : camera_.cut_planes) {
            const double begins_at_m = height_over(plane, ray.origin_m + reach.begin_m * ray.direction);
            if (std::abs(begins_at_m) < 1e-9) slope = std::max(1e-6, -glm::dot(plane.normal, ray.direction));
        }
        const auto in_solid = [&](double distance_m) {
            return medium_at(scene_, cut_polyhedra_, ray.origin_m + distance_m * ray.direction) == Medium::solid;
        };
        return in_solid(reach.begin_m) && in_solid(reach.begin_m + 2 * cut_slack_m / slope);
    }

    /// Whether a ray of a parallel view begins in the ground beside the building, not at a plane that cuts it. Other views have an eye,
    /// which is where somebody can be.
    bool starts_in_ground(const Camera::Ray& ray, const Camera::Reach& reach, FacetId seen) const {
        if (camera_.kind != ViewKind::parallel || reach.cut) return false;
        const Facet* const facet = seen == FacetId::none ? nullptr : &building_.facets[index(seen)];
        // The inside of a basement, whose near walls are seen through.
        if (facet != nullptr && facet->environment == Environment::indoor && glm::dot(facet->normal, ray.direction) < 0.0) return false;
        return ray.origin_m.z < building_.ground_z_m && medium_at(scene_, ray.origin_m) == Medium::solid;
    }

    /// The polyhedra that a cut plane goes through, or comes near to.
    void find_cut_polyhedra() {
        for (std::size_t k = 0; k < scene_.polyhedra.size(); ++k) {
            const Polyhedron& p = scene_.polyhedra[k];
            const dvec3 &o = p.vertices_m[0], &a = p.vertices_m[1], &b = p.vertices_m[2], &c = p.vertices_m[3];
            // Around a parallelepiped, which all kinds fit into.
            const dvec3 centre_m = o + 0.5 * (a + b + c - 3.0 * o);
            const bool near = std::ranges::any_of(camera_.cut_planes, [&](const CutPlane& plane) {
                double reach_m = 10 * cut_slack_m;
                for (const dvec3& edge : {a - o, b - o, c - o}) reach_m += 0.5 * std::abs(glm::dot(plane.normal, edge));
                return std::abs(height_over(plane, centre_m)) <= reach_m;
            });
            if (near) cut_polyhedra_.push_back(static_cast<std::uint32_t>(k));
        }
    }

    const Scene& scene_;
    const Building& building_;
    const PatchGrid& grid_;
    const Visibility& visibility_;
    const DaylightSolution& solution_;
    ApertureLight apertures_;
    std::optional<DirectLight> direct_{};  ///< where light is gathered
    Camera camera_;  ///< of the samples
    int samples_per_side_;
    PictureSun sun_;
    std::vector<LightBySource> node_lx_;                ///< [nodes]
    std::vector<std::uint32_t> cut_polyhedra_;  ///< into Scene::polyhedra, increasing
};

}  // namespace

Picture draw_view(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                  const DaylightSolution& solution, const View& view, Progress& progress) {
    const int n = view.samples;
    const Camera samples = with_samples(make_camera(view), n);
    const Painter painter(scene, building, grid, visibility, solution, samples, view);
    const auto pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    Picture picture{.width = view.width,
                    .height = view.height,
                    .luminance_cd_m2 = std::vector<Band3>(pixels),
                    .illuminance_lx = std::vector<Band3>(pixels),
                    .sky_illuminance_lx = std::vector<Band3>(pixels),
                    .coverage = std::vector<float>(pixels),
                    .shown = std::vector<PixelContent>(pixels, PixelContent::mixed),
                    .surface = std::vector<std::uint32_t>(pixels, 0),
                    .around_rooms = view.kind == ViewKind::parallel || !view.cut_planes.empty() || view.see_through == SeeThrough::walls};
    int band_rows = most_band_rows;
    while (band_rows > 1 && std::int64_t{band_rows} * n * samples.width > most_band_samples) band_rows /= 2;
    ThreadScratch<Painter::Scratch> scratches;
    const auto bands = static_cast<std::size_t>((view.height + band_rows - 1) / band_rows);
    parallel_stage("picture", bands, 1, progress, [&](std::size_t band) {
        const int begin = static_cast<int>(band) * band_rows, end = std::min(begin + band_rows, view.height);
        Painter::Scratch& scratch = scratches.local();
        scratch.seen.resize(static_cast<std::size_t>((end - begin) * n) * static_cast<std::size_t>(samples.width));
        visibility.view_facets(samples, begin * n, end * n, scratch.seen);
        for (int column = 0; column < view.width; column += band_rows)
            painter.paint({column, begin, std::min(band_rows, view.width - column), end - begin}, begin, scratch, picture);
    });
    return picture;
}

}  // namespace naturel
