#include "cli/sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/false_colour.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/image_writer.h"
#include "cli/json_text.h"
#include "core/errors.h"
#include "core/scene_reader.h"
#include "core/scene_values.h"
#include "core/sky.h"
#include "core/sky_models.h"
#include "core/sky_reader.h"
#include "core/sun.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

/// "40" -> 40, "true" -> true, "from_sky" -> "from_sky"
Json json_value(const std::string& text) {
    if (text == "true") return true;
    double number = 0.0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (fault == std::errc() && end == text.data() + text.size() && std::isfinite(number)) return number;
    return text;
}

std::filesystem::path picture_file(const SkyOptions& options) {
    return options.out / "sky.png";
}

SkyAndSun described(const SkyOptions& options) {
    if (find_sky_model(options.target) == nullptr) {
        if (options.target.find('.') == std::string::npos && options.target.find('/') == std::string::npos &&
            !std::filesystem::exists(options.target)) {
            throw InputError("", fmt::format("there is neither a sky nor a scene file {} {}", in_quotes(options.target),
                                             suggestion(options.target, sky_model_names())));
        }
        if (!options.description.empty()) {
            const auto& [object, key] = options.description.begin()->first;
            throw InputError(options.target, fmt::format("a scene brings its own sky and sun (leave out what sets {} of the {})",
                                                         key, object));
        }
        std::vector<SourceFile> sources;
        const Scene scene = read_scene_with_sources(options.target, {}, sources);
        refuse_to_replace(paths_of_sources(options.target, sources), std::vector{picture_file(options)});
        return {scene.sky, scene.sun, scene.north_rad};
    }
    Json text{{"sky", {{"model", options.target}}}};
    for (const auto& [place, value] : options.description) {
        const auto& [object, key] = place;
        // A formula such as "100" stays a text; so do dates and words.
        const Json json = key == "luminance" || key == "file" ? Json(value) : json_value(value);
        (object == "table" ? text["sky"]["table"] : text[object])[key] = json;
    }
    if (const auto table = options.description.find({"table", "file"}); table != options.description.end())
        refuse_to_replace(std::vector<std::filesystem::path>{table->second}, std::vector{picture_file(options)});
    return read_sky_and_sun_text(json_line(text), "command line");
}

/// The dome from below: north up, east LEFT; equidistant, the horizon is the rim.
class Dome {
public:
    explicit Dome(int size) : size_(size), radius_(0.5 * size - margin) {}

    static constexpr int margin = 26;  // room for the letters of the compass

    /// World direction through a pixel; empty outside the rim.
    std::optional<glm::dvec3> direction(int column, int row) const {
        const double west = (column + 0.5 - 0.5 * size_) / radius_, north = (0.5 * size_ - row - 0.5) / radius_;
        const double r = std::hypot(west, north);
        if (r > 1.0) return std::nullopt;
        return direction_from_angles(0.5 * pi * (1.0 - r), std::atan2(-west, north));
    }

    struct Pixel {
        double column, row;
    };
    Pixel pixel(double altitude_rad, double azimuth_rad) const {
        const double r = radius_ * (1.0 - altitude_rad / (0.5 * pi));
        return {0.5 * size_ - r * std::sin(azimuth_rad), 0.5 * size_ - r * std::cos(azimuth_rad)};
    }

private:
    int size_;
    double radius_;
};

Raster draw_dome(const Sky& sky, const SkyAndSun& light, const SkyOptions& options, const std::string& title) {
    const Dome dome(options.size);
    const auto size = static_cast<std::size_t>(options.size);
    std::vector<double> field(size * size, std::numeric_limits<double>::quiet_NaN());
    std::vector<double> shown;
    for (int row = 0; row < options.size; ++row) {
        for (int column = 0; column < options.size; ++column) {
            const auto world = dome.direction(column, row);
            if (!world) continue;
            const double c = std::cos(light.north_rad), s = std::sin(light.north_rad);
            const glm::dvec3 model(world->x * c - world->y * s, world->x * s + world->y * c, world->z);
            shown.push_back(sky.luminance(model).value);
            field[static_cast<std::size_t>(row) * size + static_cast<std::size_t>(column)] = shown.back();
        }
    }
    const auto middle = shown.begin() + static_cast<std::ptrdiff_t>(shown.size() / 2);
    std::nth_element(shown.begin(), middle, shown.end());
    const double median = *middle, largest = *std::max_element(shown.begin(), shown.end());
    const bool logarithmic = options.logarithmic.value_or(median > 0.0 && largest > 5.0 * median);

    FalseColourOptions picture{.title = title, .unit = "cd/m\u00b2", .maximum = options.maximum_cd_m2};
    picture.scale = logarithmic ? ColourScaleKind::logarithmic : ColourScaleKind::linear;
    picture.decades = 2.0;
    picture.contours = colour_scale(field, picture).round_values(10);
    Raster raster = draw_false_colour(field, options.size, options.size, picture);

    const int top = field_top(picture, options.size, options.size);
    constexpr Rgb8 ink{30, 30, 30}, paper{245, 245, 245}, white{255, 255, 255};
    for (int row = 0; row < options.size; ++row) {
        for (int column = 0; column < options.size; ++column) {
            if (!dome.direction(column, row)) raster.at(column, row + top) = paper;
        }
    }
    for (const auto& [letter, azimuth] : {std::pair{"N", 0.0}, {"E", 0.5 * pi}, {"S", pi}, {"W", 1.5 * pi}}) {
        const Dome::Pixel rim = dome.pixel(0.0, azimuth), outside = dome.pixel(radians_from_degrees(-3.5), azimuth);
        const double column = rim.column + (outside.column > rim.column ? 9 : outside.column < rim.column ? -9 : 0) *
                                               (std::abs(outside.column - rim.column) > 1.0 ? 1.0 : 0.0) * 1.5;
        const double row = rim.row + (std::abs(outside.row - rim.row) > 1.0 ? (outside.row > rim.row ? 13.5 : -13.5) : 0.0);
        raster.text(static_cast<int>(column) - 5, top + static_cast<int>(row) - 7, letter, ink);
    }
    if (light.sun && light.sun->altitude_rad > 0.0) {
        const Dome::Pixel at = dome.pixel(light.sun->altitude_rad, light.sun->azimuth_rad + light.north_rad);
        for (const auto& [radius, colour] : {std::pair{7.0, ink}, {6.0, white}, {8.0, white}}) {
            for (int k = 0; k < 64; ++k) {
                const double a = 2.0 * pi * k / 64, b = 2.0 * pi * (k + 1) / 64;
                raster.line(at.column + radius * std::cos(a), top + at.row + radius * std::sin(a),
                            at.column + radius * std::cos(b), top + at.row + radius * std::sin(b), colour);
            }
        }
    }
    return raster;
}

double azimuth_deg(const SkyAndSun& light) {
    return std::fmod(degrees_from_radians(light.sun->azimuth_rad + light.north_rad) + 720.0, 360.0);
}

/// A plane as the table shows it: its normal in the world.
struct Plane {
    const char* name;
    glm::dvec3 normal;
};
constexpr std::array planes{Plane{"horizontal", {0, 0, 1}}, Plane{"vertical, facing north", {0, 1, 0}},
                            Plane{"vertical, facing east", {1, 0, 0}}, Plane{"vertical, facing south", {0, -1, 0}},
                            Plane{"vertical, facing west", {-1, 0, 0}}};

}  // namespace

void show_sky(const SkyOptions& options) {
    const SkyAndSun light = described(options);
    make_writable_folder(options.out);
    const glm::dvec3 sun = light.sun ? direction_from_angles(light.sun->altitude_rad, light.sun->azimuth_rad)
                                     : glm::dvec3(0.0, 0.0, 1.0);
    const Sky sky(light.sky, sun);
    const double direct_normal_lx =
        light.sun && light.sun->altitude_rad > 0.0 ? light.sun->direct_normal_illuminance_lx : 0.0;

    const SkyModelInfo& model = sky_model(light.sky);
    std::string account = fmt::format("{}: {}\n", model.name, model.summary);
    std::string sun_text = "no sun";
    if (light.sun) {
        sun_text = fmt::format("sun at altitude {:.2f} deg, azimuth {:.2f} deg",
                               degrees_from_radians(light.sun->altitude_rad), azimuth_deg(light));
        account += fmt::format("  {}, {:.1f} lx direct normal{}\n", sun_text, direct_normal_lx,
                               light.sun->altitude_rad > 0.0 ? "" : " (below the horizon)");
    } else {
        account += "  no sun\n";
    }
    account += fmt::format("  zenith luminance {:.1f} cd/m2\n", sky.zenith_luminance().value);
    account += fmt::format("\n  {:<26}{:>12}{:>12}{:>12}\n", "illuminance, lx", "sky", "sun", "global");
    for (const Plane& plane : planes) {
        const double c = std::cos(light.north_rad), s = std::sin(light.north_rad);
        const glm::dvec3 normal(plane.normal.x * c - plane.normal.y * s, plane.normal.x * s + plane.normal.y * c,
                                plane.normal.z);
        const double diffuse_lx =
            plane.normal.z > 0.0 ? sky.horizontal_illuminance().value : sky.plane_illuminance(normal).value;
        const double sun_lx =
            direct_normal_lx * std::max(0.0, normal.x * sun.x + normal.y * sun.y + normal.z * sun.z);
        account += fmt::format("  {:<26}{:>12.1f}{:>12.1f}{:>12.1f}\n", plane.name, diffuse_lx, sun_lx,
                               diffuse_lx + sun_lx);
    }
    account += "  (planes that see the sky alone: no ground, nothing in between)\n";

    const std::filesystem::path file = picture_file(options);
    const Raster picture = draw_dome(sky, light, options, fmt::format("{}, {}", model.name, sun_text));
    write_file(file, encode_png(picture, {{"ImageDescription", "dome of " + std::string(model.name)}}));
    account += fmt::format("\n  dome seen from below, north up, east left: {}\n", file.string());
    std::fwrite(account.data(), 1, account.size(), stdout);
}

}  // namespace naturel
