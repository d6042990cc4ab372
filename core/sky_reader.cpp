#include "core/sky_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include "core/colour.h"
#include "core/errors.h"
#include "core/material_reader.h"
#include "core/perez.h"
#include "core/scene_values.h"
#include "core/side_files.h"
#include "core/sky.h"
#include "core/sky_expression.h"
#include "core/sky_levels.h"
#include "core/sky_models.h"
#include "core/sky_table.h"
#include "core/sun.h"
#include "core/units.h"

namespace naturel {
namespace {

/// What the sun's position by the clock needs of a place.
struct Site {
    std::optional<double> latitude_rad, longitude_rad, time_zone_h;
    double north_rad = 0.0;
};

Site read_site(const JsonValue& value) {
    const SceneObject object(value, scene_keys::site);
    Site site;
    if (const auto latitude = object.find("latitude_deg")) {
        site.latitude_rad = radians_from_degrees(read_number(*latitude, {-90.0, 90.0, "degrees north"}));
    }
    if (const auto longitude = object.find("longitude_deg")) {
        site.longitude_rad = radians_from_degrees(read_number(*longitude, {-180.0, 180.0, "degrees east"}));
    }
    if (const auto zone = object.find("time_zone_h")) {
        site.time_zone_h = read_number(*zone, {-12.0, 14.0, "hours east of Greenwich"});
    }
    site.north_rad = radians_from_degrees(read_number(object, "north_deg", {-360.0, 360.0, "degrees"}, 0.0));
    return site;
}

/// Digits and separators as in `pattern`, where each 0 stands for a digit.
bool has_pattern(std::string_view text, std::string_view pattern) {
    if (text.size() != pattern.size()) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool fits = pattern[i] == '0' ? text[i] >= '0' && text[i] <= '9' : text[i] == pattern[i];
        if (!fits) return false;
    }
    return true;
}

int two_digits(std::string_view text, std::size_t at) {
    return (text[at] - '0') * 10 + (text[at + 1] - '0');
}

void read_date(const JsonValue& value, LocalTime& time) {
    // The years for which the sun's position has been checked (core/sun.h), with some margin.
    constexpr int first_year = 1950, last_year = 2099;
    const std::string& text = read_text(value);
    if (!has_pattern(text, "0000-00-00"))
        value.refuse(fmt::format("{} is not a date (YYYY-MM-DD would be right)", in_quotes(text)));
    time.year = two_digits(text, 0) * 100 + two_digits(text, 2);
    time.month = two_digits(text, 5);
    time.day = two_digits(text, 8);
    if (time.year < first_year || time.year > last_year) {
        value.refuse(fmt::format("the year {} is out of range ({} to {} would be right)", time.year,
                                 first_year, last_year));
    }
    const bool leap_year = time.year % 4 == 0 && (time.year % 100 != 0 || time.year % 400 == 0);
    const std::array<int, 12> days{31, leap_year ? 29 : 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    const bool month_exists = time.month >= 1 && time.month <= 12;
    if (!month_exists || time.day < 1 || time.day > days[static_cast<std::size_t>(time.month - 1)]) {
        value.refuse(
            fmt::format("there is no day {} in the calendar (YYYY-MM-DD would be right)", in_quotes(text)));
    }
}

void read_time(const JsonValue& value, LocalTime& time) {
    const std::string& text = read_text(value);
    const bool seconds = has_pattern(text, "00:00:00");
    if (!seconds && !has_pattern(text, "00:00")) {
        value.refuse(fmt::format("{} is not a time (HH:MM or HH:MM:SS would be right)", in_quotes(text)));
    }
    const int hour = two_digits(text, 0), minute = two_digits(text, 3),
              second = seconds ? two_digits(text, 6) : 0;
    if (hour > 23 || minute > 59 || second > 59) {
        value.refuse(fmt::format("there is no time {} on the clock (00:00:00 to 23:59:59)", in_quotes(text)));
    }
    time.hour = hour + minute / 60.0 + second / 3600.0;
}

/// Azimuth from the model's +y axis, in [0, 2 pi).
double model_azimuth(double world_azimuth_rad, double north_rad) {
    const double turned = std::fmod(world_azimuth_rad - north_rad, 2 * pi);
    const double positive = turned < 0.0 ? turned + 2 * pi : turned;
    return positive < 2 * pi ? positive : 0.0;  // a tiny negative angle plus 2 pi rounds to 2 pi
}


/// 1 to 366.
int day_of_year(const LocalTime& time) {
    constexpr std::array<int, 12> days_before{0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334};
    const bool leap_year = time.year % 4 == 0 && (time.year % 100 != 0 || time.year % 400 == 0);
    return days_before[static_cast<std::size_t>(time.month - 1)] + time.day + (leap_year && time.month > 2 ? 1 : 0);
}

struct SunPlace {
    SunAngles angles;         ///< azimuth from true north
    std::optional<int> day;   ///< of the year, if a date says
};

SunPlace read_sun_place(const SceneObject& object, const std::optional<JsonValue>& site_value, const Site& site) {
    const auto date = object.find("date"), clock = object.find("time");
    const auto altitude = object.find("altitude_deg"), azimuth = object.find("azimuth_deg");
    const bool summer_time = object.has("summer_time") && read_boolean(object.at("summer_time"));
    SunPlace place;
    if (altitude && azimuth && !date && !clock) {
        if (object.has("summer_time"))
            object.at("summer_time").refuse("a sun given by its angles has no clock (leave summer_time out)");
        place.angles = {.altitude_rad = radians_from_degrees(read_number(*altitude, {-90.0, 90.0, "degrees"})),
                        .azimuth_rad = radians_from_degrees(read_number(*azimuth, {-360.0, 360.0, "degrees"}))};
    } else if (altitude || azimuth || !date || !clock) {
        object.refuse(
            "the sun's place is not clear (give either altitude_deg and azimuth_deg, or date and time)");
    } else {
        LocalTime time;
        read_date(*date, time);
        read_time(*clock, time);
        if (!site.latitude_rad || !site.longitude_rad || !site.time_zone_h) {
            const std::string text =
                "date and time need latitude_deg, longitude_deg and time_zone_h of the site (or give the sun "
                "altitude_deg and azimuth_deg)";
            site_value ? site_value->refuse(text) : object.refuse(text);
        }
        time.time_zone_h = *site.time_zone_h + (summer_time ? 1.0 : 0.0);
        place = {sun_position(time, *site.latitude_rad, *site.longitude_rad), day_of_year(time)};
    }
    if (object.has("refraction") && read_boolean(object.at("refraction")))
        place.angles.altitude_rad = refracted_altitude(place.angles.altitude_rad);
    return place;
}

/// Numbers of a text file, "#" starts a comment. Each line is kept with its number for messages.
struct NumberLine {
    std::size_t line;
    std::vector<double> numbers;
};

std::vector<NumberLine> number_lines(const SideFiles::Text& file) {
    std::vector<NumberLine> lines;
    std::istringstream stream(file.text);
    std::string text;
    for (std::size_t line = 1; std::getline(stream, text); ++line) {
        text.resize(std::min(text.size(), text.find('#')));
        NumberLine found{line, {}};
        constexpr std::string_view blanks = " \t\r,;";
        for (std::size_t at = text.find_first_not_of(blanks); at != std::string::npos;) {
            const std::size_t end = std::min(text.size(), text.find_first_of(blanks, at));
            double number = 0.0;
            const auto [stop, fault] = std::from_chars(text.data() + at, text.data() + end, number);
            if (fault != std::errc() || stop != text.data() + end || !std::isfinite(number))
                throw InputError(fmt::format("{}:{}:{}", file.file_name, line, at + 1),
                                 fmt::format("{} is not a number (a luminance is needed, holes are not allowed)",
                                             in_quotes(text.substr(at, end - at))));
            found.numbers.push_back(number);
            at = text.find_first_not_of(blanks, end);
        }
        if (!found.numbers.empty()) lines.push_back(std::move(found));
    }
    return lines;
}

double checked_luminance(double value, const std::string& where) {
    if (!(value >= 0.0 && value <= largest_light))
        throw InputError(where, fmt::format("{} is out of range (0 to {} would be right)", value, largest_light));
    return value;
}

double read_luminance(const JsonValue& value) {
    if (value.kind() == JsonKind::null) value.refuse("the table has a hole here (a number is needed)");
    return read_number(value, {0.0, largest_light});
}

/// The number of columns of a raster: azimuths 0, 360 / n, ...
constexpr int most_columns = 3600;

struct Raster {
    std::vector<double> altitudes_rad;
    int columns = 0;
    std::vector<double> values;
};

Raster read_inline_raster(const SceneObject& object) {
    if (!object.has("altitudes_deg"))
        object.refuse("a raster needs altitudes_deg (increasing, one per row of values)");
    Raster raster;
    double last = -1.0;
    for (const JsonValue& value : read_list(object.at("altitudes_deg"), "altitudes")) {
        const double altitude = read_number(value, {0.0, 90.0, "degrees"});
        if (altitude <= last) value.refuse(fmt::format("{} does not increase (altitudes rise from row to row)", altitude));
        last = altitude;
        raster.altitudes_rad.push_back(radians_from_degrees(altitude));
    }
    const std::vector<JsonValue> rows = read_list(object.at("values"), "rows, one per altitude");
    if (rows.size() != raster.altitudes_rad.size() || rows.empty()) {
        object.at("values").refuse(fmt::format("there are {} rows of values for {} altitudes (one each is needed)",
                                               rows.size(), raster.altitudes_rad.size()));
    }
    for (const JsonValue& row : rows) {
        const std::vector<JsonValue> values = read_list(row, "values at azimuth 0, 360/n, ...");
        if (values.empty() || values.size() > most_columns)
            row.refuse(fmt::format("the row has {} values (1 to {} are possible)", values.size(), most_columns));
        if (raster.columns == 0) raster.columns = static_cast<int>(values.size());
        if (static_cast<int>(values.size()) != raster.columns)
            row.refuse(fmt::format("the row has {} values, the first row {} (the table has a hole)", values.size(),
                                   raster.columns));
        for (const JsonValue& value : values)
            raster.values.push_back(read_luminance(value));
    }
    return raster;
}

/// Lines "altitude azimuth luminance", degrees, in any order.
Raster read_raster_file(const JsonValue& name, SideFiles& files) {
    const SideFiles::Text& text = files.read(name);
    const std::string& file = text.file_name;
    std::map<double, std::map<double, double>> table;
    for (const NumberLine& line : number_lines(text)) {
        const std::string where = fmt::format("{}:{}", file, line.line);
        if (line.numbers.size() != 3)
            throw InputError(where, fmt::format("the line has {} numbers (altitude, azimuth and luminance are needed)",
                                                line.numbers.size()));
        const double altitude = line.numbers[0], azimuth = line.numbers[1];
        if (!(altitude >= 0.0 && altitude <= 90.0) || !(azimuth >= 0.0 && azimuth < 360.0))
            throw InputError(where, fmt::format("altitude {} and azimuth {} are out of range (0 to 90, and 0 to "
                                                "less than 360 degrees, would be right)", altitude, azimuth));
        if (!table[altitude].emplace(azimuth, checked_luminance(line.numbers[2], where)).second)
            throw InputError(where, fmt::format("altitude {} and azimuth {} have a value already", altitude, azimuth));
    }
    Raster raster;
    if (table.empty()) throw InputError(file, "the file has no values (lines of altitude, azimuth, luminance)");
    for (const auto& [altitude, row] : table)
        raster.columns = std::max(raster.columns, static_cast<int>(std::min<std::size_t>(row.size(), most_columns + 1)));
    if (raster.columns > most_columns)
        throw InputError(file, fmt::format("a row has more than {} azimuths", most_columns));
    for (const auto& [altitude, row] : table) {
        raster.altitudes_rad.push_back(radians_from_degrees(altitude));
        for (int column = 0; column < raster.columns; ++column) {
            const double azimuth = 360.0 * column / raster.columns;
            // Azimuths are written with few digits: 17.14 for 360 / 21.
            const auto found = row.lower_bound(azimuth - 0.011);
            if (found == row.end() || found->first > azimuth + 0.011)
                throw InputError(file, fmt::format("the table has a hole at altitude {} and azimuth {:.4g} (every row "
                                                   "needs {} azimuths, the first of them 0, evenly spaced)",
                                                   altitude, azimuth, raster.columns));
            raster.values.push_back(found->second);
        }
        if (static_cast<int>(row.size()) != raster.columns)
            throw InputError(file, fmt::format("altitude {} has {} azimuths, another row {}", altitude, row.size(),
                                               raster.columns));
    }
    return raster;
}

std::vector<double> read_patch_values(const SceneObject& object, SideFiles& files, int count) {
    std::vector<double> values;
    if (const auto list = object.find("values")) {
        for (const JsonValue& value : read_list(*list, "luminances"))
            values.push_back(read_luminance(value));
        if (static_cast<int>(values.size()) != count)
            list->refuse(fmt::format("the table has {} values ({} are needed, one per patch)", values.size(), count));
        return values;
    }
    const JsonValue name = object.at("file");
    const SideFiles::Text& text = files.read(name);
    const std::string& file = text.file_name;
    for (const NumberLine& line : number_lines(text)) {
        for (const double number : line.numbers)
            values.push_back(checked_luminance(number, fmt::format("{}:{}", file, line.line)));
    }
    if (static_cast<int>(values.size()) != count)
        throw InputError(file, fmt::format("the table has {} values ({} are needed, one per patch)", values.size(), count));
    return values;
}

std::shared_ptr<const SkyTable> read_table_sky(const JsonValue& value, SideFiles& files) {
    const SceneObject object(value, scene_keys::sky_table);
    if (object.has("values") == object.has("file"))
        object.refuse("the values of the table are given twice or not at all (give either values or file)");
    constexpr int raster = 0;
    const int factor = read_word<int>(object.at("subdivision"), {{"tregenza", 1},
                                                                 {"reinhart_2", 2},
                                                                 {"reinhart_3", 3},
                                                                 {"reinhart_4", 4},
                                                                 {"reinhart_5", 5},
                                                                 {"reinhart_6", 6},
                                                                 {"raster", raster}});
    const bool interpolated =
        object.has("interpolation")
            ? read_word<bool>(object.at("interpolation"), {{"linear", true}, {"constant", false}})
            : factor == raster;
    if (factor != raster) {
        if (object.has("altitudes_deg"))
            object.at("altitudes_deg").refuse("a subdivision knows its altitudes (leave altitudes_deg out)");
        SkyPatches patches = reinhart_patches(factor);
        std::vector<double> values = read_patch_values(object, files, patches.count());
        return std::make_shared<SkyTable>(std::move(patches), std::move(values), interpolated);
    }
    Raster table = object.has("file") ? read_raster_file(object.at("file"), files) : read_inline_raster(object);
    return std::make_shared<SkyTable>(raster_patches(table.altitudes_rad, table.columns), std::move(table.values),
                                      interpolated);
}

PerezWeather read_perez(const SceneObject& object, const std::optional<int>& day) {
    constexpr std::string_view choice =
        "(give direct_normal_irradiance_w_m2 and diffuse_horizontal_irradiance_w_m2, or "
        "direct_normal_illuminance_lx and diffuse_horizontal_illuminance_lx)";
    const auto both = [&](std::string_view direct, std::string_view diffuse) {
        return static_cast<int>(object.has(direct)) + static_cast<int>(object.has(diffuse));
    };
    const int irradiances = both("direct_normal_irradiance_w_m2", "diffuse_horizontal_irradiance_w_m2");
    const int illuminances = both("direct_normal_illuminance_lx", "diffuse_horizontal_illuminance_lx");
    if (!(irradiances == 2 && illuminances == 0) && !(irradiances == 0 && illuminances == 2))
        object.refuse(fmt::format("the weather of the sky is not clear {}", choice));
    PerezWeather weather;
    if (irradiances == 2) {
        constexpr Range range{0.0, 1500.0, "W/m2"};
        weather.direct_normal_W_m2 = read_number(object.at("direct_normal_irradiance_w_m2"), range);
        weather.diffuse_horizontal_W_m2 = read_number(object.at("diffuse_horizontal_irradiance_w_m2"), range);
    } else {
        constexpr Range range{0.0, 200000.0, "lx"};
        weather.direct_normal_lx = read_number(object.at("direct_normal_illuminance_lx"), range);
        weather.diffuse_horizontal_lx = read_number(object.at("diffuse_horizontal_illuminance_lx"), range);
    }
    weather.dew_point_c = read_number(object, "dew_point_c", {-60.0, 40.0, "degrees Celsius"}, weather.dew_point_c);
    const int given_day = read_integer(object, "day_of_year", {1.0, 366.0}, day.value_or(0));
    if (given_day > 0) weather.eccentricity = eccentricity_of_day(given_day);
    if (const auto word = object.find("normalisation"))
        weather.normalise_by_patches = read_word<bool>(*word, {{"exact", false}, {"patches_145", true}});
    return weather;
}

/// Keys that only one model reads.
void refuse_foreign_keys(const SceneObject& object, const SkyModelInfo& info) {
    const auto only_for = [&](SkyModel model, std::initializer_list<std::string_view> keys, std::string_view name) {
        for (const std::string_view key : keys) {
            if (info.model != model && object.has(key))
                object.at(key).refuse(fmt::format("a sky of the model \"{}\" has no {} (it belongs to \"{}\")", info.name,
                                                  key, name));
        }
    };
    only_for(SkyModel::perez,
             {"direct_normal_irradiance_w_m2", "diffuse_horizontal_irradiance_w_m2", "direct_normal_illuminance_lx",
              "diffuse_horizontal_illuminance_lx", "dew_point_c", "day_of_year", "normalisation"},
             "perez");
    only_for(SkyModel::table, {"table"}, "table");
    only_for(SkyModel::expression, {"luminance"}, "expression");
}

SkyDescription read_sky(const SceneObject& object, const Primaries& primaries, SideFiles& files,
                        const std::optional<int>& day) {
    const JsonValue model = object.at("model");
    const SkyModelInfo* info = find_sky_model(read_text(model));
    if (info == nullptr) {
        model.refuse(fmt::format("unknown word {} {}", in_quotes(model.text()),
                                 suggestion(model.text(), sky_model_names())));
    }
    refuse_foreign_keys(object, *info);
    SkyDescription sky;
    sky.model = info->model;
    sky.cie_type = info->cie_type;
    const auto zenith = object.find("zenith_luminance_cd_m2");
    const auto horizontal = object.find("horizontal_illuminance_lx");
    if (zenith && horizontal)
        object.refuse(
            "both of zenith_luminance_cd_m2 and horizontal_illuminance_lx are given (one is enough)");
    if (zenith) sky.zenith_luminance_cd_m2 = read_number(*zenith, {0.0, largest_light, "cd/m2"});
    if (horizontal) sky.horizontal_illuminance_lx = read_number(*horizontal, {0.0, largest_light, "lx"});
    // Below 1.32 the clear zenith would be black; 12 is the haziest of the standard skies that show the sun.
    if (const auto turbidity = object.find("turbidity"))
        sky.turbidity = read_number(*turbidity, {1.4, 50.0});
    sky.highest_sun_rad = radians_from_degrees(read_number(object, "highest_sun_deg", {45.0, 90.0, "degrees"}, 90.0));
    if (const auto colour = object.find("colour")) sky.colour = read_light_colour(*colour, primaries);
    if (sky.model == SkyModel::perez) sky.perez = read_perez(object, day);
    if (sky.model == SkyModel::table) {
        if (!object.has("table")) object.refuse("the key \"table\" is missing (it holds the values of the sky)");
        sky.table = read_table_sky(object.at("table"), files);
    }
    if (sky.model == SkyModel::expression) {
        if (!object.has("luminance"))
            object.refuse("the key \"luminance\" is missing (a formula such as \"1 + 2*sin(altitude)\")");
        sky.expression = read_text(object.at("luminance"));
    }
    return sky;
}

/// Azimuths from true north.
glm::dvec3 world_direction(const std::optional<SunPlace>& sun) {
    return sun ? direction_from_angles(sun->angles.altitude_rad, sun->angles.azimuth_rad) : glm::dvec3(0.0, 0.0, 1.0);
}

/// Whether the formula can be read, needs the sun, and has sensible values.
bool check_expression(const JsonValue& value, const std::string& text, const std::optional<SunPlace>& sun) {
    try {
        const SkyExpression expression(text, world_direction(sun));
        // Without a sun there is nothing to compare with: the caller refuses it.
        if (!sun && expression.depends_on_sun()) return true;
        const std::string fault = expression_fault(expression);
        if (!fault.empty())
            value.refuse(fmt::format("{} (a luminance from 0 to 1e12 is needed everywhere above the horizon)", fault));
        return expression.depends_on_sun();
    } catch (const ExpressionError& error) {
        std::string names;
        for (const std::string_view variable : SkyExpression::variables)
            names += (names.empty() ? "" : ", ") + std::string(variable);
        value.refuse(fmt::format("character {} of the formula: {} (known: {}, pi, + - * / ^ ( ) ?: sin cos exp ...)",
                                 error.position, error.what(), names));
    }
}

double read_direct_normal(const SceneObject& object, const SkyDescription& sky, double altitude_rad) {
    const auto value = object.find("direct_normal_illuminance_lx");
    const bool sky_has_level = sky.zenith_luminance_cd_m2 || sky.horizontal_illuminance_lx;
    if (value && value->kind() == JsonKind::number) return read_number(*value, {0.0, largest_light, "lx"});
    if (altitude_rad <= 0.0) {
        if (value && value->kind() != JsonKind::text) read_number(*value, {0.0, largest_light, "lx"});
        return 0.0;
    }
    // A sky whose level follows from a formula brings its sun with it.
    if (!value) return sky_has_level ? 0.0 : formula_direct_normal_lx(sky, altitude_rad).value_or(0.0);
    if (value->kind() != JsonKind::text) {
        value->refuse(fmt::format("{} stands where a number or a formula belongs (0 to {} lx, \"from_sky\", \"gensky\", "
                                  "\"ies_clear\" or \"turbid\")",
                                  value->describe(), largest_light));
    }
    enum class Formula { from_sky, gensky, ies_clear, turbid };
    switch (read_word<Formula>(*value, {{"from_sky", Formula::from_sky},
                                        {"gensky", Formula::gensky},
                                        {"ies_clear", Formula::ies_clear},
                                        {"turbid", Formula::turbid}})) {
        case Formula::from_sky:
            if (const auto found = formula_direct_normal_lx(sky, altitude_rad)) return *found;
            value->refuse(fmt::format("a sky of the model \"{}\" has no formula for its sun (give a number, \"gensky\", "
                                      "\"ies_clear\" or \"turbid\")",
                                      sky_model(sky).name));
        case Formula::gensky:
            return gensky_direct_normal_lx(altitude_rad);
        case Formula::ies_clear:
            return ies_direct_normal_lx(altitude_rad);
        case Formula::turbid:
            break;
    }
    constexpr double usual_turbidity = 2.5;
    return turbid_direct_normal_lx(altitude_rad, sky.turbidity.value_or(usual_turbidity));
}

/// A sky that needs the sun has it, above the horizon; a level can be reached.
void check_sky(const SceneObject& root, const SceneObject& sky_object, const SkyDescription& sky,
               const std::optional<SunPlace>& sun) {
    bool needs_sun = sky_model(sky).needs_sun;
    if (sky.model == SkyModel::expression)
        needs_sun |= check_expression(sky_object.at("luminance"), sky.expression, sun);
    if (needs_sun && !sun) {
        sky_object.refuse("a sky of this model needs the place of the sun (add \"sun\", without illuminance if it shall not shine)");
    }
    const bool has_level = sky.zenith_luminance_cd_m2 || sky.horizontal_illuminance_lx;
    const bool level_by_formula = !has_level && sky.model != SkyModel::perez && sky.model != SkyModel::table &&
                                  sky.model != SkyModel::expression;
    if (level_by_formula && !sun) {
        sky_object.refuse("neither of zenith_luminance_cd_m2 and horizontal_illuminance_lx is given (one is needed, or a \"sun\" "
                          "from whose altitude the level follows)");
    }
    if ((needs_sun || level_by_formula) && sun->angles.altitude_rad <= 0.0) {
        root.at("sun").refuse(fmt::format(
            "the sun stands {:.4g} degrees high ({} needs it above the horizon)",
            degrees_from_radians(sun->angles.altitude_rad), needs_sun ? "a sky of this model" : "a sky without a level"));
    }
    const Sky trial(sky, world_direction(sun));
    if (sky.zenith_luminance_cd_m2.value_or(0.0) > 0.0 && trial.luminance({0.0, 0.0, 1.0}).value <= 0.0)
        sky_object.at("zenith_luminance_cd_m2").refuse("this sky is black at the zenith (give horizontal_illuminance_lx instead)");
    if (sky.horizontal_illuminance_lx.value_or(0.0) > 0.0 && trial.luminance({0.0, 0.0, 1.0}).value <= 0.0 &&
        SkyDescription(sky).horizontal_illuminance_lx) {
        SkyDescription raw = sky;
        raw.horizontal_illuminance_lx.reset();
        raw.zenith_luminance_cd_m2.reset();
        if (Sky(raw, world_direction(sun)).horizontal_illuminance().value <= 0.0)
            sky_object.at("horizontal_illuminance_lx").refuse("this sky is black (it cannot give light)");
    }
}

}  // namespace

SkyAndSun read_sky_and_sun(const SceneObject& root, const Primaries& primaries, SideFiles& files) {
    const Site site = root.has("site") ? read_site(root.at("site")) : Site{};
    std::optional<SceneObject> sun_object;
    std::optional<SunPlace> sun;
    const SceneObject sky_object(root.at("sky"), scene_keys::sky);
    if (const auto value = root.find("sun")) {
        sun_object.emplace(*value, scene_keys::sun);
        sun = read_sun_place(*sun_object, root.find("site"), site);
    }
    SkyAndSun light;
    light.north_rad = site.north_rad;
    light.sky = read_sky(sky_object, primaries, files, sun ? sun->day : std::nullopt);
    light.sky.north_rad = 0.0;  // for the checks, in the world's frame
    check_sky(root, sky_object, light.sky, sun);
    light.sky.north_rad = site.north_rad;
    if (sun) {
        light.sun = SunDescription{
            .altitude_rad = sun->angles.altitude_rad,
            .azimuth_rad = model_azimuth(sun->angles.azimuth_rad, site.north_rad),
            .direct_normal_illuminance_lx =
                read_direct_normal(*sun_object, light.sky, sun->angles.altitude_rad)};
        if (const auto colour = sun_object->find("colour"))
            light.sun->colour = read_light_colour(*colour, primaries);
    }
    return light;
}

SkyAndSun read_sky_and_sun_text(const std::string& text, const std::string& name) {
    const JsonDocument document(text, name);
    SideFiles files{std::filesystem::path()};
    return read_sky_and_sun(SceneObject(document.root(), scene_keys::sky_and_sun), Primaries(PrimariesName::ebu), files);
}

}  // namespace naturel
