#include "cli/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "cli/colour_notes.h"
#include "cli/forecast.h"
#include "cli/orientation.h"
#include "cli/physical_memory.h"
#include "cli/prepared_scene.h"
#include "cli/view_notes.h"
#include "core/building.h"
#include "core/form_factors.h"
#include "core/glazing.h"
#include "core/patch_grid.h"
#include "core/sensors.h"
#include "core/sky.h"
#include "core/sky_models.h"
#include "core/sun.h"

namespace naturel {
namespace {

/// Text that grows: what the scene contains, then the warnings.
struct Report {
    std::string contents;
    std::vector<std::string> warnings;

    template <class... Values>
    void say(fmt::format_string<Values...> format, Values&&... values) {
        contents += fmt::format(format, std::forward<Values>(values)...) + "\n";
    }
    template <class... Values>
    void warn(fmt::format_string<Values...> format, Values&&... values) {
        warnings.push_back(fmt::format(format, std::forward<Values>(values)...));
    }
};

struct CheckedScene {
    const Scene& scene;
    const Building& building;
    const PatchGrid& grid;
    const Visibility& visibility;
};

void describe_surfaces(const CheckedScene& checked, Report& report) {
    const auto& [scene, building, grid, visibility] = checked;
    report.say("scene \"{}\"", scene.name);
    report.say("  {} polyhedra, {} polygons; {} faces, {} facets", scene.polyhedra.size(),
               scene.polygons.size(), building.faces.size(), building.facets.size());
    report.say("  {} patches ({} indoors, {} in apertures, {} outdoors), {} nodes", grid.patches.size(),
               grid.indoor_patch_count, grid.gather_patch_count - grid.indoor_patch_count,
               grid.patches.size() - grid.gather_patch_count, grid.nodes.size());
    report.say("  indoor air {:.3f} m3", building.indoor_air_volume_m3);

    std::vector<double> indoor_m2(scene.materials.size()), outdoor_m2(scene.materials.size());
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture) continue;
        const MaterialId material = building.faces[index(facet.face)].material;
        (facet.environment == Environment::indoor ? indoor_m2 : outdoor_m2)[index(material)] += facet.area_m2;
    }
    for (std::size_t k = 0; k < scene.materials.size(); ++k)
        report.say("  material \"{}\": {:.3f} m2 indoors, {:.3f} m2 outdoors", scene.materials[k].name,
                   indoor_m2[k], outdoor_m2[k]);
}

void describe_apertures(const CheckedScene& checked, Report& report) {
    for (const Aperture& aperture : checked.building.apertures)
        report.say("  aperture \"{}\": {:.3f} m2, {}, glazing \"{}\"", aperture.name, aperture.area_m2,
                   aperture.inner ? "between rooms"
                                  : "facing " + orientation(-aperture.normal, checked.scene.north_rad),
                   checked.scene.glazings[index(aperture.glazing)].name);
}

/// 256 directions spread evenly over the half-space around a unit normal: a Fibonacci spiral (R. Swinbank and
/// R. J. Purser, Q. J. R. Meteorol. Soc. 132, 2006).
std::vector<glm::dvec3> spread_directions(const glm::dvec3& normal) {
    constexpr int count = 256;
    const PlaneFrame frame = make_plane_frame({}, normal);
    const double golden_angle = pi * (3.0 - std::sqrt(5.0));
    std::vector<glm::dvec3> directions;
    for (int k = 0; k < count; ++k) {
        const double z = (k + 0.5) / count;
        const double radius = std::sqrt(1.0 - z * z);
        directions.push_back(radius * std::cos(golden_angle * k) * frame.x +
                             radius * std::sin(golden_angle * k) * frame.y + z * normal);
    }
    return directions;
}

bool sees_sky(const CheckedScene& checked, const Aperture& aperture) {
    std::vector<glm::dvec3> directions = spread_directions(-aperture.normal);
    std::erase_if(directions, [](const glm::dvec3& direction) { return direction.z <= 0.0; });
    if (directions.empty()) return false;
    std::vector<FacetId> seen(directions.size());
    for (const FacetId id : aperture.facets) {
        const Facet& facet = checked.building.facets[index(id)];
        glm::dvec3 centre{};
        for (const glm::dvec3& vertex : facet.vertices_m)
            centre += vertex;
        centre /= static_cast<double>(facet.vertices_m.size());
        // The centre and, for large openings that are partly hidden, points on the way to the corners.
        std::vector<glm::dvec3> points{centre};
        for (const glm::dvec3& vertex : facet.vertices_m)
            points.push_back(0.25 * centre + 0.75 * vertex);
        for (const glm::dvec3& point : points) {
            checked.visibility.first_seen({point, -aperture.normal}, directions, seen);
            if (std::ranges::find(seen, FacetId::none) != seen.end()) return true;
        }
    }
    return false;
}

void warn_of_apertures(const CheckedScene& checked, Report& report) {
    const auto outer = std::ranges::count(checked.building.apertures, false, &Aperture::inner);
    if (outer == 0)
        report.warn(
            "no aperture: no daylight comes in (carve a window through the wall, or list one under "
            "apertures)");
    for (const Aperture& aperture : checked.building.apertures)
        if (!aperture.inner && !sees_sky(checked, aperture))
            report.warn("aperture \"{}\" sees no sky (does it look into the ground or another building?)",
                        aperture.name);
    for (const Aperture& aperture : checked.building.apertures) {
        const Glazing& glazing = checked.scene.glazings[index(aperture.glazing)];
        if (largest(GlazingTransmission(glazing).diffuse_transmittance()) <= 0.0)
            report.warn("aperture \"{}\" lets no light pass: its glazing \"{}\" transmits nothing", aperture.name, glazing.name);
    }
}

void warn_of_size(const CheckedScene& checked, Report& report) {
    // Rooms are metres to tens of metres across; a model in millimetres read as metres is a thousand times
    // that.
    constexpr double largest_m = 300.0, smallest_m = 0.3;
    glm::dvec3 low(1e300), high(-1e300);
    for (const Facet& facet : checked.building.facets)
        if (facet.environment == Environment::indoor)
            for (const glm::dvec3& vertex : facet.vertices_m) {
                low = glm::min(low, vertex);
                high = glm::max(high, vertex);
            }
    if (low.x > high.x) {
        report.warn("no indoor surface: there is no room");
        return;
    }
    const glm::dvec3 size = high - low;
    const double extent_m = std::max({size.x, size.y, size.z});
    report.say("  indoor extent {:.3f} x {:.3f} x {:.3f} m", size.x, size.y, size.z);
    if (extent_m > largest_m)
        report.warn("the rooms are {:.0f} m across: is the scene in millimetres? (lengths are metres)",
                    extent_m);
    if (extent_m < smallest_m)
        report.warn("the rooms are only {:.4f} m across: is the scene in kilometres? (lengths are metres)",
                    extent_m);
}

void warn_of_reflectances(const CheckedScene& checked, Report& report) {
    // Fresh snow and barium sulphate reach 0.95 and more, black velvet stays below 0.02; paint does neither.
    constexpr double brightest = 0.95, darkest = 0.02;
    const auto warn = [&](const std::string& what, const Band3& reflectance) {
        if (largest(reflectance) > brightest)
            report.warn("{} reflects {:.3f}: more than {} is rare (percent given as a share?)", what,
                        largest(reflectance), brightest);
        if (largest(reflectance) < darkest)
            report.warn("{} reflects {:.3f}: less than {} is rare (black on purpose?)", what,
                        largest(reflectance), darkest);
    };
    for (const Material& material : checked.scene.materials)
        warn(fmt::format("material \"{}\"", material.name), material.reflectance);
    warn("the ground", checked.scene.ground.reflectance);
}

void warn_of_colours(const CheckedScene& checked, Report& report) {
    for (const std::string& note : colour_notes(checked.scene))
        report.warn("{}", note);
}

/// Returns how many there are.
std::size_t check_sensors(const CheckedScene& checked, Report& report) {
    struct SetCount {
        std::size_t points = 0, in_solid = 0, outdoors = 0;
        std::string first_in_solid, first_outdoors;
    };
    std::vector<SetCount> counts(checked.scene.sensors.size());
    for (const Sensor& sensor : place_sensors(checked.scene, checked.building)) {
        SetCount& count = counts[sensor.set];
        ++count.points;
        if (sensor.medium == Medium::solid && count.in_solid++ == 0) count.first_in_solid = sensor.id;
        if (sensor.medium == Medium::outdoor_air && count.outdoors++ == 0) count.first_outdoors = sensor.id;
    }
    for (std::size_t s = 0; s < counts.size(); ++s) {
        const std::string& id = checked.scene.sensors[s].id;
        report.say("  sensors \"{}\": {} points", id, counts[s].points);
        if (counts[s].points == 0)
            report.warn("sensors \"{}\": no point (is the height inside a room, the margin too large?)", id);
        if (counts[s].in_solid > 0)
            report.warn("sensors \"{}\": {} of {} points inside a solid, the first is {}", id,
                        counts[s].in_solid, counts[s].points, counts[s].first_in_solid);
        if (counts[s].outdoors > 0)
            report.warn("sensors \"{}\": {} of {} points outdoors, the first is {}", id, counts[s].outdoors,
                        counts[s].points, counts[s].first_outdoors);
    }
    std::size_t points = 0;
    for (const SetCount& count : counts)
        points += count.points;
    return points;
}

void check_views(const CheckedScene& checked, Report& report) {
    for (const View& view : checked.scene.views) {
        report.say("  view \"{}\": {} x {} pixels", view.id, view.width, view.height);
    }
    for (const std::string& note : view_notes(checked.scene, checked.building)) report.warn("{}", note);
}

void warn_of_sun(const CheckedScene& checked, Report& report) {
    if (!checked.scene.sun) return;
    const SunDescription& sun = *checked.scene.sun;
    if (sun.altitude_rad <= 0.0)
        report.warn("the sun stands at {:.1f} deg, not above the horizon: it gives no light",
                    degrees_from_radians(sun.altitude_rad));
    // Many skies need the place of the sun, whether or not it shines.
    if (sun.direct_normal_illuminance_lx <= 0.0 && sun.altitude_rad > 0.0 && !sky_model(checked.scene.sky).needs_sun)
        report.warn("the sun is given a place but no direct_normal_illuminance_lx: it gives no light");
}

void warn_of_sky(const CheckedScene& checked, Report& report) {
    const Scene& scene = checked.scene;
    const glm::dvec3 sun = scene.sun ? direction_from_angles(scene.sun->altitude_rad, scene.sun->azimuth_rad) : glm::dvec3{0, 0, 1};
    if (Sky(scene.sky, sun).horizontal_illuminance().value <= 0.0) report.warn("the sky is black: it gives no light");
}

/// How much solid there is behind a point of a surface, m, if that is less than 10 mm and air follows.
std::optional<double> solid_behind_m(const Scene& scene, const glm::dvec3& point_m, const glm::dvec3& normal) {
    const auto is_solid = [&](double depth_m) {
        return medium_at(scene, point_m - depth_m * normal) == Medium::solid;
    };
    double solid_m = 0.0;
    for (const double depth_m : {1e-3, 3e-3, 10e-3}) {
        if (is_solid(depth_m)) {
            solid_m = depth_m;
            continue;
        }
        double air_m = depth_m;
        while (air_m - solid_m > 1e-6) {
            const double middle_m = 0.5 * (solid_m + air_m);
            (is_solid(middle_m) ? solid_m : air_m) = middle_m;
        }
        return air_m;
    }
    return std::nullopt;
}

/// A window that ends a fraction of a millimetre before the room does not open it, and nothing else tells so. What
/// was carved is looked at alone: a thin fill is a sheet of something.
void warn_of_membranes(const CheckedScene& checked, Report& report) {
    const auto& [scene, building, grid, visibility] = checked;
    struct Membrane {
        double thickness_m = std::numeric_limits<double>::infinity();
        glm::dvec3 place_m{};
    };
    std::vector<Membrane> thinnest(building.faces.size());
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture || facet.environment != Environment::indoor) continue;
        glm::dvec3 centre_m{};
        for (const glm::dvec3& vertex : facet.vertices_m)
            centre_m += vertex;
        centre_m /= static_cast<double>(facet.vertices_m.size());
        std::vector<glm::dvec3> points_m{centre_m};
        for (const glm::dvec3& vertex : facet.vertices_m)
            points_m.push_back(0.25 * centre_m + 0.75 * vertex);
        Membrane& membrane = thinnest[index(facet.face)];
        for (const glm::dvec3& point_m : points_m)
            if (const auto thickness_m = solid_behind_m(scene, point_m, facet.normal);
                thickness_m && *thickness_m < membrane.thickness_m)
                membrane = {*thickness_m, point_m};
    }
    for (std::size_t f = 0; f < thinnest.size(); ++f) {
        const std::string& name = building.faces[f].name;
        const std::string id = name.substr(0, name.find('/'));
        const auto owner = std::ranges::find(scene.polyhedra, id, &Polyhedron::id);
        if (owner == scene.polyhedra.end() || owner->effect != Effect::carve) continue;
        const auto& [thickness_m, place_m] = thinnest[f];
        if (std::isfinite(thickness_m))
            report.warn(
                "only {:.2g} mm of solid behind face \"{}\" at ({:.3f}, {:.3f}, {:.3f}), then air: no light "
                "passes (to open it, make \"{}\" longer, past what it shall open into)",
                1e3 * thickness_m, name, place_m.x, place_m.y, place_m.z, id);
    }
}

/// Memory and time, and where light leaves unseen.
void check_rows(const CheckedScene& checked, const CheckOptions& options, std::size_t sensors, Report& report,
                Progress& progress) {
    const auto& [scene, building, grid, visibility] = checked;
    if (grid.gather_patch_count == 0) return;
    const FormFactorSample sample = sample_form_factors(visibility, grid, progress);
    Forecast whole = forecast(scene, building, grid, sensors, visibility.name(), options.backends,
                              options.quality.node_indirect);
    whole.form_factor_bytes = forecast_memory_bytes(grid.gather_patch_count, sample.mean_row_length);
    report.say("  form factors: {} rows of about {:.0f} entries; memory up to about {}", grid.gather_patch_count,
               sample.mean_row_length, in_bytes(whole.form_factor_bytes));
    report.say("  a run with {}, quality {}: memory up to about {}, time about {} of one core", visibility.name(),
               options.quality.name, in_bytes(whole.peak_bytes()), in_time(whole.seconds()));
    if (whole.peak_bytes() > physical_memory_bytes())
        report.warn("a run needs about {} of memory, and there are {}: it will be refused (make \"spacing_m\" of \"grid\" larger)",
                    in_bytes(whole.peak_bytes()), in_bytes(physical_memory_bytes()));

    // Cracks of rounding are below this share of a patch's half-space.
    constexpr double leak = 1e-3;
    if (sample.worst_lost > leak)
        report.warn(
            "a leak: {:.1f} % of what face \"{}\" sees is neither surface nor aperture (a gap between "
            "polygons?)",
            100.0 * sample.worst_lost, building.faces[index(grid.patches[index(sample.worst_patch)].face)].name);
}

}  // namespace

void check(const CheckOptions& options, Progress& progress) {
    const PreparedScene prepared = prepare_scene(read_scene_file(options.scene, options.quality, options.grid_spacing_m),
                                                 options.quality, progress);
    const auto& [scene, building, sun, zones, grid] = prepared;
    const std::unique_ptr<Visibility> visibility =
        backends_named(options.backend).front().make(building, grid, options.backends);
    const CheckedScene checked{scene, building, grid, *visibility};

    Report report;
    describe_surfaces(checked, report);
    warn_of_size(checked, report);
    describe_apertures(checked, report);
    warn_of_apertures(checked, report);
    warn_of_membranes(checked, report);
    warn_of_reflectances(checked, report);
    warn_of_colours(checked, report);
    const std::size_t sensors = check_sensors(checked, report);
    check_views(checked, report);
    warn_of_sky(checked, report);
    warn_of_sun(checked, report);
    check_rows(checked, options, sensors, report, progress);
    for (const std::string& warning : report.warnings)
        report.contents += "warning: " + warning + "\n";
    if (report.warnings.empty()) report.contents += "nothing suspicious\n";
    std::fwrite(report.contents.data(), 1, report.contents.size(), stdout);
}

}  // namespace naturel
