#include "core/sky_models.h"

#include <algorithm>
#include <array>

namespace naturel {
namespace {

constexpr std::array models{
    SkyModelInfo{"uniform", SkyModel::uniform, 0, false, make_uniform_sky, "the same luminance everywhere"},
    SkyModelInfo{"moon_spencer", SkyModel::moon_spencer, 0, false, make_moon_spencer_sky,
                 "overcast, (1 + 2 sin h) / 3 of the zenith: the traditional CIE overcast sky"},
    SkyModelInfo{"cie_clear", SkyModel::cie_clear, 0, true, make_clear_sky, "CIE 1973 clear sky, low turbidity"},
    SkyModelInfo{"cie_clear_polluted", SkyModel::cie_clear_polluted, 0, true, make_clear_sky,
                 "CIE 1973 clear sky, polluted atmosphere"},
    SkyModelInfo{"intermediate", SkyModel::intermediate, 0, true, make_intermediate_sky,
                 "Nakamura and Matsuura's intermediate sky, as Radiance's gensky +i"},
    // ISO 15469:2004; "sun": whether scattering depends on its place.
    SkyModelInfo{"cie_general_1", SkyModel::cie_general, 1, false, make_cie_general_sky,
                 "CIE general sky: overcast, steep gradation"},
    SkyModelInfo{"cie_general_2", SkyModel::cie_general, 2, true, make_cie_general_sky,
                 "overcast, steep gradation, slightly brighter towards the sun"},
    SkyModelInfo{"cie_general_3", SkyModel::cie_general, 3, false, make_cie_general_sky,
                 "overcast, moderate gradation"},
    SkyModelInfo{"cie_general_4", SkyModel::cie_general, 4, true, make_cie_general_sky,
                 "overcast, moderate gradation, slightly brighter towards the sun"},
    SkyModelInfo{"cie_general_5", SkyModel::cie_general, 5, false, make_cie_general_sky, "uniform"},
    SkyModelInfo{"cie_general_6", SkyModel::cie_general, 6, true, make_cie_general_sky,
                 "partly cloudy, no gradation, slightly brighter towards the sun"},
    SkyModelInfo{"cie_general_7", SkyModel::cie_general, 7, true, make_cie_general_sky,
                 "partly cloudy, no gradation, brighter circumsolar region"},
    SkyModelInfo{"cie_general_8", SkyModel::cie_general, 8, true, make_cie_general_sky,
                 "partly cloudy, no gradation, distinct solar corona"},
    SkyModelInfo{"cie_general_9", SkyModel::cie_general, 9, true, make_cie_general_sky,
                 "partly cloudy, sun behind clouds"},
    SkyModelInfo{"cie_general_10", SkyModel::cie_general, 10, true, make_cie_general_sky,
                 "partly cloudy, brighter circumsolar region"},
    SkyModelInfo{"cie_general_11", SkyModel::cie_general, 11, true, make_cie_general_sky,
                 "white-blue sky, distinct solar corona"},
    SkyModelInfo{"cie_general_12", SkyModel::cie_general, 12, true, make_cie_general_sky,
                 "CIE standard clear sky, low turbidity"},
    SkyModelInfo{"cie_general_13", SkyModel::cie_general, 13, true, make_cie_general_sky,
                 "CIE standard clear sky, polluted atmosphere"},
    SkyModelInfo{"cie_general_14", SkyModel::cie_general, 14, true, make_cie_general_sky,
                 "cloudless turbid sky, broad solar corona"},
    SkyModelInfo{"cie_general_15", SkyModel::cie_general, 15, true, make_cie_general_sky,
                 "white-blue turbid sky, broad solar corona"},
    SkyModelInfo{"cie_general_16", SkyModel::cie_general, 16, false, make_cie_general_sky,
                 "traditional overcast sky, the same as moon_spencer"},
    SkyModelInfo{"perez", SkyModel::perez, 0, true, make_perez_sky,
                 "Perez' all-weather sky from irradiances or illuminances"},
    SkyModelInfo{"table", SkyModel::table, 0, false, make_table_sky, "values per patch or on a raster"},
    SkyModelInfo{"expression", SkyModel::expression, 0, false, make_expression_sky, "a formula of yours"},
};

}  // namespace

std::span<const SkyModelInfo> sky_models() { return models; }

const SkyModelInfo& sky_model(const SkyDescription& description) {
    return *std::ranges::find_if(models, [&](const SkyModelInfo& info) {
        return info.model == description.model &&
               (info.model != SkyModel::cie_general || info.cie_type == description.cie_type);
    });
}

const SkyModelInfo* find_sky_model(std::string_view name) {
    const auto found = std::ranges::find(models, name, &SkyModelInfo::name);
    return found == models.end() ? nullptr : &*found;
}

std::vector<std::string_view> sky_model_names() {
    std::vector<std::string_view> names;
    for (const SkyModelInfo& info : models)
        names.push_back(info.name);
    return names;
}

}  // namespace naturel
