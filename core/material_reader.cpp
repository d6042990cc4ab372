#include "core/material_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/glazing.h"
#include "core/scene_keys.h"
#include "core/spectrum_reader.h"
#include "core/units.h"

namespace naturel {
namespace {

/// The radiosity series converges like the powers of the reflectance.
constexpr double largest_reflectance = 0.99;
constexpr Range reflectance_range{0.0, largest_reflectance};
// No real colour has a smaller y (the violet end of the spectrum: 0.0048), and X = x Y / y must stay finite.
constexpr Range chromaticity_y_range{0.001, 1.0};

template <class Table>
[[noreturn]] void refuse_unknown(const JsonValue& value, std::string_view what, const Table& table) {
    std::vector<std::string_view> known;
    for (const auto& entry : table)
        known.push_back(entry.first);
    std::sort(known.begin(), known.end());
    value.refuse(
        fmt::format("there is no {} {} {}", what, in_quotes(value.text()), suggestion(value.text(), known)));
}

void check_triangle(const JsonValue& value, double x, double y) {
    if (x + y > 1.0) value.refuse(fmt::format("x + y is {} (at most 1; D65 is 0.3127, 0.3290)", x + y));
}

Chromaticity read_chromaticity(const JsonValue& value) {
    const auto [x, y] = read_numbers<2>(value, "x, y", {share_range, chromaticity_y_range});
    check_triangle(value, x, y);
    return {x, y};
}

/// Colours outside the gamut of the primaries are desaturated, not refused (core/colour.h).
FittedBands read_xyY(const JsonValue& value, const Primaries& primaries) {
    const auto [x, y, luminance_factor] =
        read_numbers<3>(value, "x, y, Y", {share_range, chromaticity_y_range, reflectance_range});
    if (x + y > 1.0) value.refuse(fmt::format("x + y is {} (at most 1; D65 grey is 0.3127, 0.3290)", x + y));
    return reflectance_from_xyY(primaries, x, y, luminance_factor, largest_reflectance);
}

Material read_surface(const std::string& name, const SceneObject& object, const Primaries& primaries,
                      SideFiles& files) {
    Material material{.name = name};
    if (!object.has("reflectance") && !object.has("xyY") && !object.has("rgb") && !object.has("spectral_reflectance"))
        material.reflectance = {};
    const auto take = [&](const FittedBands& fitted) {
        material.reflectance = fitted.band;
        material.desaturation = fitted.desaturation;
    };
    if (const auto value = object.find("reflectance"))
        material.reflectance = grey(read_number(*value, reflectance_range));
    if (const auto value = object.find("xyY")) take(read_xyY(*value, primaries));
    if (const auto value = object.find("spectral_reflectance"))
        take(bands_from_spectrum(primaries, read_spectrum(*value, files), largest_reflectance));
    if (const auto value = object.find("rgb")) {
        if (value->kind() != JsonKind::list)
            value->refuse(value->describe() + " stands where [r, g, b] belongs (three reflectances)");
        material.reflectance = read_bands(*value, reflectance_range);
    }
    if (const auto value = object.find("exitance_lm_m2")) {
        material.exitance_lm_m2 = read_bands(*value, {0.0, largest_light, "lm/m2"});
    }
    return material;
}

/// The ways to say how much a glazing transmits.
constexpr std::array<std::string_view, 5> transmittance_keys{"normal_transmittance", "internal_transmittance",
                                                             "transmissivity", "spectral_transmittance",
                                                             "angular_transmittance"};

/// What a glazing lets through and what it reflects is no more than what falls on it.
void check_energy(const SceneObject& object, const JsonValue& transmittance, const Glazing& glazing) {
    const Band3 through = GlazingTransmission(glazing).diffuse_transmittance();
    const Band3& back = glazing.inner_reflectance;
    // An opening that lets all light pass has 1 only within the rounding of a numerical integral.
    constexpr double rounding = 1e-9;
    for (const auto& [band, transmitted, reflected] :
         {std::tuple{"red", through.r, back.r}, {"green", through.g, back.g}, {"blue", through.b, back.b}}) {
        if (transmitted + reflected <= 1.0 + rounding) continue;
        object.find("inner_reflectance")
            .value_or(transmittance)
            .refuse(fmt::format(
                "of diffuse light in the {} band the glazing lets {:.3f} through and reflects {:.3f}, together "
                "{:.3f} (at most 1: it cannot give more light than it gets)",
                band, transmitted, reflected, transmitted + reflected));
    }
}

/// A table of transmittance against the angle of incidence, from 0 degrees. Nothing passes at 90 degrees, where a table
/// may end or not.
std::vector<AngularSample> read_angular_table(const JsonValue& value) {
    std::vector<AngularSample> table;
    for (const JsonValue& item : read_list(value, "[incidence_deg, transmittance]")) {
        const std::vector<JsonValue> pair = read_list(item, "incidence_deg, transmittance");
        if (pair.size() != 2)
            item.refuse(fmt::format("the list has {} values (2 are needed: incidence_deg, transmittance)", pair.size()));
        const double incidence_deg = read_number(pair[0], {0.0, 90.0, "degrees"});
        if (table.empty() && incidence_deg != 0.0)
            pair[0].refuse(fmt::format("the first angle is {} degrees (0, normal incidence, is needed)", incidence_deg));
        const double incidence_rad = radians_from_degrees(incidence_deg);
        if (!table.empty() && incidence_rad <= table.back().incidence_rad)
            pair[0].refuse(fmt::format("the angle {} degrees does not follow the one before (they must increase)",
                                       incidence_deg));
        table.push_back({incidence_rad, read_bands(pair[1], share_range)});
    }
    if (table.size() < 2) value.refuse("the table has fewer than 2 angles (2 and more, from 0 degrees)");
    if (table.back().incidence_rad < radians_from_degrees(90.0))
        table.push_back({radians_from_degrees(90.0), {}});
    return table;
}

AngularLaw read_angular_law(const JsonValue& value) {
    return read_word<AngularLaw>(value, {{"fresnel", AngularLaw::fresnel},
                                         {"mitalas", AngularLaw::mitalas},
                                         {"rivero", AngularLaw::rivero},
                                         {"constant", AngularLaw::constant},
                                         {"diffuse", AngularLaw::diffuse}});
}

/// How much the glazing transmits at normal incidence, by whichever key says it.
void read_transmittance(const std::string_view key, const JsonValue& value, const Primaries& primaries,
                        SideFiles& files, Glazing& glazing) {
    if (key == "normal_transmittance") {
        glazing.normal_transmittance = read_bands(value, share_range);
    } else if (key == "spectral_transmittance") {
        const FittedBands fitted = bands_from_spectrum(primaries, read_spectrum(value, files), 1.0);
        glazing.normal_transmittance = fitted.band;
        glazing.desaturation = fitted.desaturation;
    } else if (key == "angular_transmittance") {
        glazing.angular_law = AngularLaw::table;
        glazing.angular_table = read_angular_table(value);
        glazing.normal_transmittance = glazing.angular_table.front().transmittance;
    } else {
        const Band3 inside = read_bands(value, share_range);
        const auto unit = [&](double pane) {
            return multi_pane_transmittance(1.0, pane, glazing.panes, glazing.refractive_index);
        };
        glazing.normal_transmittance = {unit(inside.r), unit(inside.g), unit(inside.b)};
    }
}

Glazing read_glazing(const std::string& name, const JsonValue& value, const Primaries& primaries,
                     SideFiles& files) {
    const SceneObject object(value, scene_keys::glazing);
    std::optional<JsonValue> transmittance;
    std::string_view key;
    for (const std::string_view candidate : transmittance_keys) {
        const auto found = object.find(candidate);
        if (!found) continue;
        if (transmittance)
            found->refuse(fmt::format("the transmittance has been given already, as {} (once is enough)", key));
        transmittance = found;
        key = candidate;
    }
    if (!transmittance)
        object.refuse(
            "it is not said how much the glazing transmits (give one of normal_transmittance, internal_transmittance, "
            "transmissivity, spectral_transmittance and angular_transmittance)");

    Glazing glazing{.name = name};
    const auto law = object.find("angular_law");
    if (law) glazing.angular_law = read_angular_law(*law);
    const bool slabs = glazing.angular_law == AngularLaw::fresnel || glazing.angular_law == AngularLaw::diffuse;
    const bool table = key == "angular_transmittance";
    for (const std::string_view other : {"angular_law", "panes", "refractive_index", "spectral_reflectance"}) {
        if (table && object.has(other))
            object.at(other).refuse(fmt::format("a glazing with angular_transmittance has no {} (its table says all)", other));
    }
    if (!slabs && (key == "internal_transmittance" || key == "transmissivity"))
        law->refuse(fmt::format("{} is what panes of glass let survive inside (the law \"fresnel\" or \"diffuse\" is needed)", key));
    glazing.panes = read_integer(object, "panes", {1, 4}, glazing.panes);
    if (const auto index = object.find("refractive_index")) {
        if (!slabs) index->refuse("only the laws \"fresnel\" and \"diffuse\" know a refractive index");
        glazing.refractive_index = read_number(*index, {1.01, 4.0});
    }
    read_transmittance(key, *transmittance, primaries, files, glazing);
    glazing.maintenance = read_number(object, "maintenance", share_range, glazing.maintenance);
    glazing.frame = read_number(object, "frame", share_range, glazing.frame);

    std::optional<Band3> normal_reflectance;
    if (const auto spectrum = object.find("spectral_reflectance"))
        normal_reflectance = bands_from_spectrum(primaries, read_spectrum(*spectrum, files), 1.0).band;
    glazing.inner_reflectance = pane_reflectance(glazing, normal_reflectance);
    if (const auto inner = object.find("inner_reflectance")) {
        if (normal_reflectance) inner->refuse("the reflectance has been given already, as spectral_reflectance (once is enough)");
        glazing.inner_reflectance = read_bands(*inner, reflectance_range);
    }
    check_energy(object, *transmittance, glazing);
    return glazing;
}

}  // namespace

MaterialId read_material_name(const JsonValue& value, const MaterialNames& names) {
    const std::string& name = read_text(value);
    if (const auto found = names.materials.find(name); found != names.materials.end()) return found->second;
    if (names.glazings.contains(name)) {
        value.refuse(
            fmt::format("{} is a glazing (a surface is needed: reflectance, xyY or rgb)", in_quotes(name)));
    }
    refuse_unknown(value, "material", names.materials);
}

GlazingId read_glazing_name(const JsonValue& value, const MaterialNames& names) {
    const std::string& name = read_text(value);
    if (const auto found = names.glazings.find(name); found != names.glazings.end()) return found->second;
    if (names.materials.contains(name)) {
        value.refuse(
            fmt::format("{} is a surface (a glazing is needed: an entry of materials with \"glazing\")",
                        in_quotes(name)));
    }
    refuse_unknown(value, "glazing", names.glazings);
}

MaterialNames read_materials(const JsonValue& value, SideFiles& files, Scene& scene) {
    const Primaries primaries(scene.primaries);
    scene.glazings.push_back({.name = "unglazed", .angular_law = AngularLaw::constant});
    MaterialNames names;
    names.glazings.emplace("unglazed", GlazingId{0});
    for (const auto& [key, entry] : read_table(value, "names and materials")) {
        const std::string& name = read_name(key);
        if (name == "unglazed")
            key.refuse("\"unglazed\" is the built-in opening without glass (choose another name)");
        const SceneObject object(entry, scene_keys::material);
        int descriptions = 0;
        for (const std::string_view kind : {"reflectance", "xyY", "rgb", "spectral_reflectance", "glazing"})
            descriptions += object.has(kind);
        // A luminous surface need not reflect.
        const bool only_emits = descriptions == 0 && object.has("exitance_lm_m2");
        if (descriptions != 1 && !only_emits) {
            object.refuse(
                fmt::format("{} of reflectance, xyY, rgb, spectral_reflectance and glazing is given (exactly one is needed)",
                            descriptions == 0 ? "none" : "more than one"));
        }
        if (const auto glazing = object.find("glazing")) {
            if (const auto exitance = object.find("exitance_lm_m2")) {
                exitance->refuse("a glazing does not emit light (give exitance_lm_m2 to a surface)");
            }
            names.glazings.emplace(name, make_id<GlazingId>(scene.glazings.size()));
            scene.glazings.push_back(read_glazing(name, *glazing, primaries, files));
        } else {
            names.materials.emplace(name, make_id<MaterialId>(scene.materials.size()));
            scene.materials.push_back(read_surface(name, object, primaries, files));
        }
    }
    return names;
}

Ground read_ground(const JsonValue& value, const Primaries& primaries) {
    const SceneObject object(value, scene_keys::ground);
    Ground ground;
    ground.z_m = read_number(object, "z", coordinate_range, ground.z_m);
    if (const auto reflectance = object.find("reflectance")) {
        const FittedBands colour =
            reflectance->kind() == JsonKind::object
                ? read_xyY(SceneObject(*reflectance, scene_keys::ground_colour).at("xyY"), primaries)
                : FittedBands{read_bands(*reflectance, reflectance_range), {}};
        ground.reflectance = colour.band;
        ground.desaturation = colour.desaturation;
    }
    if (const auto shadows = object.find("shadows")) ground.shadows = read_boolean(*shadows);
    return ground;
}

PrimariesDescription read_primaries(const JsonValue& value) {
    if (value.kind() == JsonKind::text) {
        return {.name = read_word<PrimariesName>(value, {{"srgb", PrimariesName::srgb},
                                                         {"ebu", PrimariesName::ebu},
                                                         {"p22", PrimariesName::p22},
                                                         {"smpte_c", PrimariesName::smpte_c},
                                                         {"trinitron_p22", PrimariesName::trinitron_p22}})};
    }
    if (value.kind() != JsonKind::object)
        value.refuse(value.describe() +
                     " stands where a name of primaries or {\"red\": [x, y], \"green\": ..., \"blue\": ...} belongs");
    const SceneObject object(value, scene_keys::custom_primaries);
    PrimariesDescription primaries{.name = PrimariesName::custom,
                                   .custom = {read_chromaticity(object.at("red")), read_chromaticity(object.at("green")),
                                              read_chromaticity(object.at("blue"))}};
    if (!can_mix_d65(primaries.custom))
        object.refuse("D65 cannot be mixed from these primaries (they must span a triangle around 0.3127, 0.3290)");
    return primaries;
}

LightColour read_light_colour(const JsonValue& value, const Primaries& primaries) {
    const SceneObject object(value, scene_keys::light_colour);
    const auto cct = object.find("cct_k"), xy = object.find("xy");
    if (cct.has_value() == xy.has_value())
        object.refuse(fmt::format("{} of cct_k and xy {} given (exactly one is needed)", cct ? "both" : "neither",
                                  cct ? "are" : "is"));
    return light_colour(primaries, cct ? daylight_chromaticity(read_number(*cct, {4000.0, 25000.0, "K"}))
                                       : read_chromaticity(*xy));
}

}  // namespace naturel
