// Views of a finished run, drawn from what it stored.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/false_colour.h"
#include "tests/catch.h"
#include "tests/cli/png.h"
#include "tests/cli/program.h"
#include "tests/cli/xml.h"

using namespace naturel::tests;

namespace {

constexpr double pi = 3.14159265358979323846;

const std::string eye_view =
    R"({"id": "eye", "kind": "fisheye", "from": [2, 3, 1.2], "to": [2, 0, 1.2], "width": 48})";

/// The small room with an eye that looks at the window, computed once.
class FinishedRun {
public:
    FinishedRun() {
        std::string scene(small_room);
        scene.insert(scene.find("\"views\": [") + 10, eye_view + ",");
        write(folder_ / "room.json", scene);
        const Outcome outcome = run_naturel({"run", (folder_ / "room.json").string(), "--out", (folder_ / "out").string(), "--backend",
                                             "hemicube", "--cells", "32", "--no-error-estimate", "--format", "exr,png,hdr", "--threads", "2",
                                             "--false-colour", "daylight_factor", "--contours", "1,2,5", "--exposure", "white=900"});
        INFO(outcome.errors);
        REQUIRE(outcome.exit_code == 0);
        account = outcome.output;
        std::filesystem::remove(folder_ / "room.json");
    }
    std::filesystem::path result() const { return folder_ / "out" / "hemicube"; }
    std::string account;

private:
    TemporaryFolder folder_;
};

const FinishedRun& finished_run() {
    static const FinishedRun run;
    return run;
}

/// Draws into a folder of its own. result: empty for the finished run.
struct Rendered {
    Outcome outcome;
    std::map<std::string, std::string> files;
};
Rendered render(std::vector<std::string> options, std::filesystem::path result = {}) {
    const TemporaryFolder folder;
    if (result.empty()) result = finished_run().result();
    options.insert(options.begin(), {"render", result.string(), "--out", (folder / "out").string(), "--quiet"});
    Outcome outcome = run_naturel(options);
    return {std::move(outcome), files_below(folder / "out")};
}

/// Luminances of a Radiance picture, by the book of its format: cd/m2, rows from the top.
struct RadiancePicture {
    std::string header;
    std::size_t width = 0, height = 0;
    std::vector<double> luminance_cd_m2;
};
RadiancePicture read_radiance(const std::string& bytes) {
    RadiancePicture picture;
    REQUIRE(bytes.starts_with("#?RADIANCE\n"));
    std::size_t at = bytes.find("\n\n");
    REQUIRE(at != std::string::npos);
    picture.header = bytes.substr(0, at + 1);
    at += 2;
    const std::size_t end = bytes.find('\n', at);
    std::istringstream size(bytes.substr(at, end - at));
    std::string y, x;
    size >> y >> picture.height >> x >> picture.width;
    REQUIRE(y == "-Y");
    REQUIRE(x == "+X");
    at = end + 1;
    const auto next = [&] { return static_cast<unsigned char>(bytes.at(at++)); };
    for (std::size_t row = 0; row < picture.height; ++row) {
        REQUIRE(next() == 2);
        REQUIRE(next() == 2);
        std::size_t columns = next();
        columns = 256 * columns + next();
        REQUIRE(columns == picture.width);
        std::vector<std::vector<unsigned char>> channels(4);
        for (auto& channel : channels) {
            while (channel.size() < columns) {
                const unsigned n = next();
                if (n > 128)
                    channel.insert(channel.end(), n - 128, next());
                else
                    for (unsigned k = 0; k < n; ++k) channel.push_back(next());
            }
            REQUIRE(channel.size() == columns);
        }
        for (std::size_t k = 0; k < columns; ++k) {
            const auto band = [&](std::size_t c) { return channels[3][k] == 0 ? 0.0 : std::ldexp(channels[c][k] + 0.5, channels[3][k] - 136); };
            picture.luminance_cd_m2.push_back(179.0 * (0.265074126 * band(0) + 0.670114631 * band(1) + 0.064811243 * band(2)));
        }
    }
    CHECK(at == bytes.size());
    return picture;
}

nlohmann::json glare_of(const std::map<std::string, std::string>& files) {
    return nlohmann::json::parse(files.at("glare.json"))["views"].at(0);
}

/// The text after a name in an OpenEXR header, where attributes stand as "name\0type\0size value".
std::string exr_text(const std::string& exr, const std::string& name) {
    const std::string key = name + std::string("\0string\0", 8);
    const std::size_t at = exr.find(key);
    if (at == std::string::npos) return "(absent)";
    const std::size_t size = at + key.size();
    return exr.substr(size + 4, static_cast<unsigned char>(exr.at(size)) + 256u * static_cast<unsigned char>(exr.at(size + 1)));
}

}  // namespace

TEST_CASE("render draws the pictures of the run to the byte, whatever the number of threads", "[cli][render]") {
    const std::string threads = GENERATE("1", "3");
    const Rendered rendered = render({"--format", "exr,png,hdr", "--threads", threads, "--false-colour", "daylight_factor", "--contours", "1,2,5"});
    INFO(rendered.outcome.errors);
    REQUIRE(rendered.outcome.exit_code == 0);
    const auto run = files_below(finished_run().result());
    std::size_t pictures = 0;
    for (const auto& [name, content] : run) {
        if (!name.starts_with("views/") && name != "glare.json") continue;
        INFO(name);
        REQUIRE(rendered.files.contains(name));
        CHECK((rendered.files.at(name) == content));
        ++pictures;
    }
    CHECK(pictures == 13);  // three views, three formats and false colour; glare
    CHECK(rendered.files.size() == pictures);
}

TEST_CASE("a view in words is the view of the scene, and options replace what it says", "[cli][render]") {
    const auto run = files_below(finished_run().result());
    const Rendered words = render({"--view", eye_view, "--format", "exr"});
    INFO(words.outcome.errors);
    REQUIRE(words.outcome.exit_code == 0);
    CHECK((words.files.at("views/eye.exr") == run.at("views/eye.exr")));
    const TemporaryFolder folder;
    write(folder / "views.json", "[" + eye_view + R"(, {"id": "plan", "kind": "plan", "z": 1.2, "width": 20}])");
    const Rendered file = render({"--view", (folder / "views.json").string(), "--format", "hdr", "--width", "30", "--samples", "1"});
    INFO(file.outcome.errors);
    REQUIRE(file.outcome.exit_code == 0);
    const RadiancePicture eye = read_radiance(file.files.at("views/eye.hdr")), plan = read_radiance(file.files.at("views/plan.hdr"));
    CHECK(eye.width == 30);
    CHECK(eye.height == 30);
    CHECK(plan.width == 30);
    CHECK(plan.header.find("naturel:cut_plane_1= through") != std::string::npos);
}

TEST_CASE("another backend sees the same picture but for edges", "[cli][render]") {
    if (backend_names().size() < 2) return;
    const RadiancePicture own = read_radiance(files_below(finished_run().result()).at("views/to__window.hdr"));
    const Rendered rendered = render({"--view", "to: window", "--format", "hdr", "--backend", "embree"});
    INFO(rendered.outcome.errors);
    REQUIRE(rendered.outcome.exit_code == 0);
    const RadiancePicture other = read_radiance(rendered.files.at("views/to__window.hdr"));
    CHECK(other.header.find("naturel:backend= embree") != std::string::npos);
    std::size_t different = 0;
    double own_sum = 0.0, other_sum = 0.0;
    for (std::size_t k = 0; k < own.luminance_cd_m2.size(); ++k) {
        // Half a step of RGBE is up to 1 / 256 of the largest band.
        if (std::abs(own.luminance_cd_m2[k] - other.luminance_cd_m2[k]) > 0.01 * own.luminance_cd_m2[k]) ++different;
        own_sum += own.luminance_cd_m2[k];
        other_sum += other.luminance_cd_m2[k];
    }
    // The window's edges and the corners of the room take some 150 of 768 pixels; one of 16 samples falls elsewhere in few of them.
    CHECK(different < 40);
    CHECK(std::abs(own_sum / other_sum - 1.0) < 0.005);
}

TEST_CASE("a Radiance picture holds luminance / 179 and says how it looks", "[cli][render]") {
    const auto run = files_below(finished_run().result());
    const RadiancePicture eye = read_radiance(run.at("views/eye.hdr"));
    CHECK(eye.header.find("\nVIEW= -vta -vp 2 3 1.2 -vd 0 -1 0 -vu 0 0 1 -vh 180 -vv 180") != std::string::npos);
    CHECK(eye.header.find("\nFORMAT=32-bit_rle_rgbe\n") != std::string::npos);
    CHECK(eye.header.find("\nPRIMARIES= ") != std::string::npos);
    CHECK(eye.header.find("EXPOSURE") == std::string::npos);
    const double fov_v = 2.0 * std::atan(std::tan(35.0 * pi / 180.0) * 0.75) * 180.0 / pi;
    std::ostringstream vertical;
    vertical.precision(9);
    vertical << "-vtv -vp 2 3 1.5 -vd 0 -1 0 -vu 0 0 1 -vh 70 -vv " << fov_v << " ";
    CHECK(read_radiance(run.at("views/to__window.hdr")).header.find(vertical.str()) != std::string::npos);

    // The illuminance at the eye by angles of an equidistant fisheye: d omega = sin(theta) / r dA, in units of the angle.
    double sum_lx = 0.0;
    const double size = static_cast<double>(eye.width), step = pi / size;
    for (std::size_t row = 0; row < eye.height; ++row) {
        for (std::size_t column = 0; column < eye.width; ++column) {
            const double x = (static_cast<double>(column) + 0.5 - 0.5 * size) * step, y = (static_cast<double>(row) + 0.5 - 0.5 * size) * step;
            const double theta = std::hypot(x, y);
            if (theta < pi / 2) sum_lx += eye.luminance_cd_m2[row * eye.width + column] * std::cos(theta) * std::sin(theta) / theta * step * step;
        }
    }
    // RGBE is right within 0.4 %, its errors average out over 1800 pixels; those of the same middles make the other sum.
    const double expected_lx = glare_of(run)["vertical_illuminance_of_picture_lx"].get<double>();
    CHECK(std::abs(sum_lx / expected_lx - 1.0) < 0.002);
}

TEST_CASE("pictures say how they were made", "[cli][render]") {
    const auto run = files_below(finished_run().result());
    const std::string& exr = run.at("views/eye.exr");
    CHECK(exr_text(exr, "naturel:kind") == "fisheye");
    CHECK(exr_text(exr, "naturel:projection") == "equidistant");
    CHECK(exr_text(exr, "naturel:from_m") == "2 3 1.2");
    CHECK(exr_text(exr, "naturel:to_m") == "2 0 1.2");
    CHECK(exr_text(exr, "naturel:up") == "0 0 1");
    CHECK(exr_text(exr, "naturel:horizontal_fov_deg") == "180");
    CHECK(exr_text(exr, "naturel:unit") == "cd/m2");
    CHECK(exr_text(exr, "naturel:sky") == "moon_spencer");
    CHECK(exr_text(exr, "naturel:outdoor_illuminance_lx") == "10000");
    CHECK(exr_text(exr, "naturel:backend") == "hemicube");
    CHECK(exr_text(exr, "naturel:scene_sha256").size() == 64);
    CHECK(exr_text(exr, "Software").starts_with("naturel "));
    CHECK(exr_text(exr, "naturel:white_cd_m2") == "(absent)");  // nothing of the exposure
    CHECK(exr_text(exr, "naturel:see_through") == "nothing");
    CHECK(exr_text(exr, "naturel:quality") == "interpolated");
    CHECK(exr_text(exr, "naturel:resolution") == "(absent)");
    const Rendered gathered = render({"--view", R"({"id": "x", "from": [2, 3, 1], "to": [2, 1, 1], "width": 2, "height": 2, "quality": "gather", "see_through": "backs"})"});
    INFO(gathered.outcome.errors);
    REQUIRE(gathered.outcome.exit_code == 0);
    CHECK(exr_text(gathered.files.at("views/x.exr"), "naturel:see_through") == "backs");
    CHECK(exr_text(gathered.files.at("views/x.exr"), "naturel:quality") == "gather");
    CHECK(exr_text(gathered.files.at("views/x.exr"), "naturel:resolution") == "32");
}

TEST_CASE("glare is judged from the illuminance at the eye, and its picture agrees", "[cli][render][glare]") {
    const nlohmann::json glare = glare_of(files_below(finished_run().result()));
    const double at_eye_lx = glare["vertical_illuminance_lx"].get<double>();
    CHECK(std::abs(glare["dgps"].get<double>() - (6.22e-5 * at_eye_lx + 0.184)) < 1e-12);
    // Coarse pixels, and nodes a metre apart.
    CHECK(std::abs(glare["vertical_illuminance_of_picture_lx"].get<double>() / at_eye_lx - 1.0) < 0.05);
    CHECK(finished_run().account.find("  eye: ") != std::string::npos);
    // The point of the scene's second set is this eye.
    const std::string table = content_of(finished_run().result() / "sensors.csv");
    const std::size_t row = table.find("\n\"eye, \"\"left\"\"/1\"");
    REQUIRE(row != std::string::npos);
    std::size_t at = table.find(",2,3,1.2,0,-1,0,", row) + 16;
    for (int k = 0; k < 4; ++k) at = table.find(',', at) + 1;
    CHECK(std::abs(std::stod(table.substr(at)) / at_eye_lx - 1.0) < 1e-8);  // digits of the table
    CHECK(glare["dgp"].get<double>() > 0.16);
}

TEST_CASE("false colour has the colour of each pixel's luminance on its scale, and a legend of both ends", "[cli][render][false_colour]") {
    const std::string kind = GENERATE("linear", "logarithmic");
    INFO(kind);
    constexpr double maximum = 400.0;
    const Rendered rendered = render({"--view", eye_view, "--format", "hdr", "--width", "320", "--false-colour", "luminance", "--false-colour-max", "400",
                                      "--false-colour-scale", kind, "--contours", "200,5000"});
    INFO(rendered.outcome.errors);
    REQUIRE(rendered.outcome.exit_code == 0);
    const RadiancePicture luminance = read_radiance(rendered.files.at("views/eye.hdr"));
    const PngPicture mapped = read_png(rendered.files.at("views/false_colour/eye.png"));
    const auto place_of = [&](double value) {
        const double share = value / maximum;
        return std::clamp(kind == "linear" ? share : 1.0 + std::log10(share) / 3.0, 0.0, 1.0);
    };
    const auto is_near = [](const naturel::Rgb8& a, const naturel::Rgb8& b) {
        // Half a step of RGBE, 0.4 %, is at most that on viridis, whose channels change by 60 a ninth at most.
        for (std::size_t c = 0; c < 3; ++c)
            if (std::abs(int{a[c]} - int{b[c]}) > 4) return false;
        return true;
    };
    const naturel::Rgb8 black{0, 0, 0}, white{255, 255, 255}, grey{200, 200, 200};
    constexpr std::size_t top = 32;  // of the title: 24 rows for its letters and 8 below
    std::size_t colours = 0, wrong = 0, of_lines = 0, unshown = 0;
    for (std::size_t row = 0; row < luminance.height; ++row) {
        for (std::size_t column = 0; column < luminance.width; ++column) {
            const double value = luminance.luminance_cd_m2[row * luminance.width + column];
            const naturel::Rgb8 colour = mapped.rgb(column, row + top);
            if (colour == black || colour == white) {
                ++of_lines;
            } else if (colour == grey) {
                ++unshown;
                wrong += value > 0.0;
            } else {
                ++colours;
                // Pixels of the rim are dimmed by their share of the circle in one file and not in the other.
                const double x = static_cast<double>(column) - 159.5, y = static_cast<double>(row) - 159.5;
                if (std::hypot(x, y) < 159.0) wrong += !is_near(colour, naturel::viridis(place_of(value)));
            }
        }
    }
    CHECK(wrong == 0);
    CHECK(colours > 60000);
    CHECK(of_lines < 8000);
    CHECK(unshown > 20000);  // the corners around the circle: (1 - pi / 4) 320^2 = 21975

    // The bar stands 12 columns beside the picture, 24 wide; marks of its numbers follow.
    const std::size_t bar = luminance.width + 12, marks = bar + 24;
    const naturel::Rgb8 ink{30, 30, 30};
    std::vector<std::size_t> marked, rows;
    for (std::size_t row = 0; row < mapped.height; ++row) {
        const naturel::Rgb8 colour = mapped.rgb(bar, row);
        if (colour == naturel::viridis(1.0) || is_near(colour, naturel::viridis(1.0))) rows.push_back(row);
        if (mapped.rgb(marks + 2, row) == ink && mapped.rgb(marks, row) == ink && mapped.rgb(marks + 4, row) == ink) marked.push_back(row);
    }
    REQUIRE(!rows.empty());
    REQUIRE(marked.size() >= 3);
    const std::size_t first = marked.front(), last = marked.back();
    CHECK(first == rows.front());
    const double bar_rows = static_cast<double>(last - first);
    CHECK(is_near(mapped.rgb(bar + 4, first), naturel::viridis(1.0)));
    CHECK(is_near(mapped.rgb(bar + 4, last), naturel::viridis(0.0)));
    for (std::size_t row = first; row <= last; ++row) {
        const naturel::Rgb8 colour = mapped.rgb(bar + 4, row);
        const auto of_200 = first + static_cast<std::size_t>(std::lround((1.0 - place_of(200.0)) * bar_rows));
        // The line at 200 is marked, that at 5000 has no place.
        if (row == of_200)
            CHECK((colour == black || colour == white));
        else
            CHECK(is_near(colour, naturel::viridis(1.0 - (static_cast<double>(row - first) + 0.5) / (bar_rows + 1.0))));
    }
    // Marks between the ends stand where round values are.
    for (const std::size_t row : marked) {
        double nearest = 1e9;
        for (const double value : naturel::ColourScale(kind == "linear" ? naturel::ColourScaleKind::linear : naturel::ColourScaleKind::logarithmic, maximum).round_values(12))
            for (const double end : {value, maximum, maximum / 1000.0})
                nearest = std::min(nearest, std::abs(static_cast<double>(row - first) - (1.0 - place_of(end)) * bar_rows));
        CHECK(nearest <= 0.5 + 1e-9);
    }
    // Something is brighter than the scale: the sign before the number, whose pointed half is left of what "400" alone has.
    const Rendered higher = render({"--view", eye_view, "--format", "hdr", "--width", "320", "--false-colour", "luminance", "--false-colour-max", "4e6",
                                    "--false-colour-scale", kind});
    const PngPicture all = read_png(higher.files.at("views/false_colour/eye.png"));
    const auto sign = [&](const PngPicture& picture) {  // its stroke below: five columns of two pixels, six rows of two below its top
        const std::size_t left = marks + 9, row = first - 7 + 12;
        for (std::size_t k = 0; k < 10; ++k)
            if (picture.rgb(left + k, row) != ink) return false;
        return true;
    };
    CHECK(sign(mapped));
    CHECK_FALSE(sign(all));
}

TEST_CASE("what is written in false colour grows with the picture", "[cli][render][false_colour]") {
    for (const auto& [width, factor] : {std::pair{"1300", std::size_t{1}}, {"1400", std::size_t{2}}, {"2700", std::size_t{3}}}) {
        INFO(width);
        const Rendered rendered = render({"--view", "to: window", "--format", "png", "--width", width, "--height", "20", "--samples", "1", "--false-colour", "luminance",
                                          "--false-colour-max", "400"});
        INFO(rendered.outcome.errors);
        REQUIRE(rendered.outcome.exit_code == 0);
        const PngPicture mapped = read_png(rendered.files.at("views/false_colour/to__window.png"));
        // The title takes 24 rows for its letters and 8 below; a mark of the legend is one row thick and 5 columns long, 24 beside the bar's left.
        const naturel::Rgb8 paper{245, 245, 245}, ink{30, 30, 30};
        CHECK(mapped.rgb(0, 32 * factor - 1) == paper);
        CHECK(mapped.rgb(0, 32 * factor) != paper);
        const std::size_t marks = std::stoul(width) + (12 + 24) * factor;
        std::size_t row = (32 + 26) * factor, thickness = 0, length = 0;  // behind the unit
        while (mapped.rgb(marks, row) != ink) ++row;
        while (mapped.rgb(marks, row + thickness) == ink) ++thickness;
        while (mapped.rgb(marks + length, row) == ink) ++length;
        CHECK(thickness == factor);
        CHECK(length == 5 * factor);
    }
}

TEST_CASE("what is drawn into a folder later leaves what is known of the other pictures there", "[cli][render][glare]") {
    const TemporaryFolder folder;
    const std::string result = finished_run().result().string(), out = (folder / "out").string();
    const auto draw = [&](const std::string& view, const std::string& into) {
        return run_naturel({"render", result, "--out", into, "--quiet", "--format", "png", "--view", view});
    };
    const auto ids = [&] {
        const auto glare = nlohmann::json::parse(content_of(folder / "out/glare.json"));
        std::vector<std::string> found;
        for (const auto& view : glare["views"]) found.push_back(view["view"]);
        return found;
    };
    REQUIRE(draw("eye", out).exit_code == 0);
    REQUIRE(draw("to: window", out).exit_code == 0);
    CHECK(ids() == std::vector<std::string>{"eye"});
    REQUIRE(draw(R"({"id": "other", "kind": "fisheye", "from": [2, 2, 1.2], "to": [2, 0, 1.2], "width": 32})", out).exit_code == 0);
    CHECK(ids() == std::vector<std::string>{"eye", "other"});
    REQUIRE(draw("eye", out).exit_code == 0);
    CHECK(ids() == std::vector<std::string>{"other", "eye"});
    // A picture that takes the place of an eye's takes its glare.
    REQUIRE(draw(R"({"id": "eye", "from": [2, 2, 1.2], "to": [2, 0, 1.2], "width": 8, "height": 8})", out).exit_code == 0);
    CHECK(ids() == std::vector<std::string>{"other"});

    // The folder of a run is not touched.
    const auto before = files_below(finished_run().result());
    for (const std::string& view : {std::string("eye"), std::string(R"({"id": "eye", "kind": "plan", "z": 1, "width": 8})")}) {
        const Outcome refused = draw(view, result);
        CHECK(refused.exit_code == 2);
        CHECK(refused.errors.find("is the folder of a run, whose pictures and glare would be replaced (name another one)") != std::string::npos);
    }
    CHECK((files_below(finished_run().result()) == before));
}

TEST_CASE("a fisheye whose glare is not judged says why, and one from where nobody looks warns", "[cli][render][glare]") {
    const auto draw = [](const std::string& keys) {
        const Rendered rendered = render({"--format", "png", "--view", R"({"id": "x", "kind": "fisheye", "width": 32, )" + keys + "}"});
        INFO(rendered.outcome.errors);
        CHECK(rendered.outcome.exit_code == 0);
        return rendered;
    };
    const std::string inside = R"("from": [2, 2, 1.2], "to": [2, 0, 1.2])";
    for (const auto& [keys, why] : {std::pair{R"("fov_deg": 120, )" + inside, "the fisheye shows 120 degrees (an eye sees 180)"},
                                    {R"("height": 20, )" + inside, "the picture has 32 x 20 pixels (it must be as wide as high)"},
                                    {R"("see_through": "walls", )" + inside, "the view sees through surfaces"},
                                    {std::string(R"("from": [2, 3.8, 1.2], "to": [2, 0, 1.2])"), "the eye is inside a solid"}}) {
        const Rendered rendered = draw(keys);
        CHECK(rendered.outcome.output.find(std::string("  x: glare not judged: ") + why + "\n") != std::string::npos);
        CHECK_FALSE(rendered.files.contains("glare.json"));
    }
    CHECK(draw(inside).outcome.errors.empty());
    CHECK(draw(R"("from": [2, 3.8, 1.2], "to": [2, 0, 1.2])").outcome.errors.find("warning: view \"x\" looks from inside a solid (at 2.000, 3.800, 1.200)") != std::string::npos);
    CHECK(draw(R"("from": [2, 3.5, 1.2], "to": [2, 0, 1.2])").outcome.errors.find("warning: view \"x\" looks from a surface (at 2.000, 3.500, 1.200)") != std::string::npos);
    // Four pixels are too few for the sum of a hemisphere.
    const Rendered coarse = render({"--format", "png", "--view", eye_view, "--width", "2"});
    CHECK(coarse.outcome.errors.find("warning: view \"eye\": a sensor at the eye has ") != std::string::npos);
    CHECK(coarse.outcome.errors.find("glare is not reliable") != std::string::npos);
    const Rendered sunny = draw(R"("from": [2, 0.6, 1.2], "to": [2, -1, 2])");
    const nlohmann::json glare = glare_of(sunny.files);
    REQUIRE(glare["direct_sun_lx"].get<double>() > 1000.0);
    CHECK(glare["dgps"] == 1.0);
    CHECK(glare["dgps_valid"] == false);
    CHECK(sunny.outcome.output.find("DGPs 1.00 (not valid: sun at the eye)") != std::string::npos);
}

TEST_CASE("maps of sensors are SVG with the numbers of the table", "[cli][render]") {
    const auto run = files_below(finished_run().result());
    const auto files = nlohmann::json::parse(run.at("summary.json"))["files"];
    for (const auto& [folder, column] : {std::pair{"illuminance", "total_lx"}, std::pair{"daylight_factor", "daylight_factor_percent"}}) {
        const std::string name = std::string("sensors/") + folder + "/work_plane.svg";
        INFO(name);
        REQUIRE(run.contains(name));
        CHECK(std::count(files.begin(), files.end(), name) == 1);
        const std::string& svg = run.at(name);
        CHECK(xml_fault(svg).empty());
        CHECK(svg.find("uniformity") != std::string::npos);
        // Values and cells stand in the order of the table.
        const auto numbers_after = [&](const std::string& element, const std::string& mark, int base) {
            std::vector<double> numbers;
            for (std::size_t at = svg.find(element); at != std::string::npos; at = svg.find(element, at + 1)) {
                const std::string text = svg.substr(svg.find(mark, at) + mark.size() + (base == 16 ? 2 : 0), 12);
                numbers.push_back(base == 16 ? std::stoi(text.substr(0, 2), nullptr, 16) : std::stod(text));
            }
            return numbers;
        };
        const auto shown = numbers_after("<text class=\"value", ">", 10), x_mm = numbers_after("<text class=\"value", " x=\"", 10),
                   y_mm = numbers_after("<text class=\"value", " y=\"", 10), green = numbers_after("<path class=\"cell\"", "fill=\"#", 16);
        const double mm_per_m = 1000.0 / std::stod(svg.substr(svg.find("scale 1:") + 8));
        std::vector<double> expected, x_m, y_m;
        std::istringstream table(run.at("sensors.csv"));
        std::string line;
        std::getline(table, line);
        const auto cell_number = std::count(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(line.find("," + std::string(column) + ",")) + 1, ',');
        const auto x_cell = std::count(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(line.find(",x_m,")) + 1, ',');
        while (std::getline(table, line)) {
            if (!line.starts_with("work plane/")) continue;
            std::size_t at = 0;
            for (std::ptrdiff_t k = 0; k < cell_number; ++k) {
                at = line.find(',', at) + 1;
                if (k == x_cell - 1) x_m.push_back(std::stod(line.substr(at)));
                if (k == x_cell) y_m.push_back(std::stod(line.substr(at)));
            }
            expected.push_back(std::stod(line.substr(at)));
        }
        REQUIRE(shown.size() == expected.size());
        REQUIRE(green.size() == expected.size());
        for (std::size_t k = 0; k < shown.size(); ++k) {
            CHECK(std::abs(shown[k] - expected[k]) <= (expected[k] >= 9.95 ? 0.5 : 0.05) * (1.0 + 1e-9));  // as rounded
            // At their places, to 0.01 mm; north is up.
            CHECK(std::abs(x_mm[k] - x_mm[0] - mm_per_m * (x_m[k] - x_m[0])) < 0.021);
            CHECK(std::abs(y_mm[k] - y_mm[0] + mm_per_m * (y_m[k] - y_m[0])) < 0.021);
            // The more light, the more green there is in viridis.
            for (std::size_t other = 0; other < k; ++other)
                CHECK((expected[k] - expected[other]) * (green[k] - green[other]) >= 0.0);
        }
    }
    CHECK_FALSE(run.contains("sensors/illuminance/eye___left_.svg"));
}

TEST_CASE("a stored solution that is damaged, foreign or of another version is refused", "[cli][render]") {
    const std::string whole = content_of(finished_run().result() / "solution.bin");
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& content, const std::string& message) {
        write(folder / "solution.bin", content);
        const Rendered rendered = render({}, folder.path());
        INFO(message);
        CHECK(rendered.outcome.exit_code == 3);
        CHECK(rendered.outcome.errors.find(message) != std::string::npos);
        CHECK(std::count(rendered.outcome.errors.begin(), rendered.outcome.errors.end(), '\n') == 1);
        CHECK(rendered.files.empty());
    };
    for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{90}, std::size_t{20}})
        refused(whole.substr(0, size), "the stored solution is damaged or cut off");
    for (const std::size_t at : {std::size_t{30}, std::size_t{84}, std::size_t{100}, whole.size() / 2, whole.size() - 1}) {
        std::string flipped = whole;
        flipped[at] = static_cast<char>(flipped[at] ^ 4);
        refused(flipped, "the stored solution is damaged or cut off");
    }
    refused("", "this is not a stored solution");
    refused(std::string(small_room), "this is not a stored solution");
    std::string newer = whole;
    newer.replace(newer.find(" 1 "), 3, " 2 ");
    refused(newer, "another version of the format (1 would be right: run the scene again)");
    const Rendered absent = render({}, folder / "nowhere");
    CHECK(absent.outcome.exit_code == 3);
    CHECK(absent.outcome.errors.find("there is no such file (give the folder") != std::string::npos);
}

TEST_CASE("views that cannot be drawn are refused before anything is written", "[cli][render]") {
    const auto refused = [](const std::vector<std::string>& options, int exit_code, const std::string& message) {
        const Rendered rendered = render(options);
        INFO(rendered.outcome.errors);
        CHECK(rendered.outcome.exit_code == exit_code);
        CHECK(rendered.outcome.errors.find(message) != std::string::npos);
        CHECK(rendered.files.empty());
    };
    refused({"--view", "eyes"}, 3, "the scene has no view \"eyes\", and there is no such file (did you mean \"eye\"?)");
    refused({"--view", R"({"id": "x", "kind": "fisheye", "from": [0, 0, 1]})"}, 3, "--view:1:1: /: the key \"to\" is missing");
    refused({"--view", R"({"id": "x", "from": [0, 0, 1], "to": [0, 1, 1], "fov": 3})"}, 3, "--view:1:");
    refused({"--view", "eye", "--width", "9000"}, 3, "(at most 64 million)");
    const TemporaryFolder folder;
    write(folder / "bad.txt", "all of them\n");
    refused({"--view", (folder / "bad.txt").string()}, 3, "bad.txt: this is not JSON (a view, an object in { }, or a list of views in [ ] is expected)");
    refused({"--contours", "5"}, 2, "--contours: nothing is drawn in false colour");
    refused({"--format", "tiff"}, 2, "unknown word \"tiff\" (known: exr, png, hdr)");
    refused({"--backend", "both"}, 2, "unknown backend \"both\"");
}

TEST_CASE("render draws every shipped scene as its run does", "[cli][render][slow]") {
    for (const auto& entry : std::filesystem::directory_iterator(NATUREL_SOURCE_DIR "/scenes")) {
        if (entry.path().extension() != ".json") continue;
        INFO(entry.path());
        const TemporaryFolder folder;
        const std::string out = (folder / "out").string();
        const Outcome run = run_naturel({"run", entry.path().string(), "--out", out, "--backend", backend_names().back(), "--quality", "draft",
                                         "--no-error-estimate", "--quiet"});
        REQUIRE(run.exit_code == 0);
        const Rendered rendered = render({}, folder / "out" / backend_names().back());
        INFO(rendered.outcome.errors);
        const auto files = files_below(folder / "out" / backend_names().back());
        if (rendered.outcome.exit_code == 3) {
            CHECK(rendered.outcome.errors.find("the scene of this result has no views") != std::string::npos);
            continue;
        }
        REQUIRE(rendered.outcome.exit_code == 0);
        for (const auto& [name, content] : rendered.files) CHECK((files.at(name) == content));
    }
}
