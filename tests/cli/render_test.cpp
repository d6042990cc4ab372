// Views of a finished run, drawn from what it stored.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/catch.h"
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
}

TEST_CASE("glare is judged from the illuminance at the eye, and its picture agrees", "[cli][render][glare]") {
    const nlohmann::json glare = glare_of(files_below(finished_run().result()));
    const double at_eye_lx = glare["vertical_illuminance_lx"].get<double>();
    CHECK(std::abs(glare["dgps"].get<double>() - (6.22e-5 * at_eye_lx + 0.184)) < 1e-12);
    // Coarse pixels and nodes a metre apart; the sum over a fine picture of a fine grid is within 1 % (docs/pictures.md).
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
