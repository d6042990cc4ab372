#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

/// What every file of form factors holds, whatever its form.
struct Rows {
    std::vector<std::uint64_t> begin;
    std::vector<std::uint32_t> column;
    std::vector<double> value;
    std::vector<float> error;
    std::vector<double> area_m2, centre_m, normal, row_sum, lost, truncated, escaped, reciprocity_gap;
    std::vector<std::string> face;  ///< [rows], names
    std::string description;

    std::size_t count() const { return begin.size() - 1; }
};

template <class T>
T number_at(std::string_view bytes, std::size_t offset) {
    REQUIRE(offset + sizeof(T) <= bytes.size());
    T number;
    std::memcpy(&number, bytes.data() + offset, sizeof number);
    return number;
}

template <class T>
std::vector<T> array_of(std::string_view bytes) {
    REQUIRE(bytes.size() % sizeof(T) == 0);
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(line);
    return lines;
}

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
        if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            cells.emplace_back();
        else
            cells.back() += c;
    }
    return cells;
}

Rows read_csv(const std::filesystem::path& file) {
    Rows rows;
    auto beside = file;
    const std::vector<std::string> patches = lines_of(content_of(beside.replace_extension(".patches.csv")));
    rows.description = content_of(beside.replace_extension("").replace_extension(".description.json"));
    REQUIRE(patches.at(0) == "patch,face,area_m2,x_m,y_m,z_m,nx,ny,nz,row_sum,lost,truncated,escaped,reciprocity_gap");
    for (std::size_t i = 1; i < patches.size(); ++i) {
        const auto cells = cells_of(patches[i]);
        REQUIRE(cells.size() == 14);
        CHECK(cells[0] == std::to_string(i - 1));
        const auto number = [&](std::size_t k) { return std::stod(cells[k]); };
        rows.face.push_back(cells[1]);
        rows.area_m2.push_back(number(2));
        for (std::size_t k : {3u, 4u, 5u}) rows.centre_m.push_back(number(k));
        for (std::size_t k : {6u, 7u, 8u}) rows.normal.push_back(number(k));
        rows.row_sum.push_back(number(9));
        rows.lost.push_back(number(10));
        rows.truncated.push_back(number(11));
        rows.escaped.push_back(number(12));
        rows.reciprocity_gap.push_back(number(13));
    }
    const std::vector<std::string> entries = lines_of(content_of(file));
    REQUIRE(entries.at(0) == "row,column,form_factor,error");
    rows.begin.assign(patches.size(), 0);
    for (std::size_t e = 1; e < entries.size(); ++e) {
        const auto cells = cells_of(entries[e]);
        REQUIRE(cells.size() == 4);
        ++rows.begin.at(std::stoul(cells[0]) + 1);
        rows.column.push_back(static_cast<std::uint32_t>(std::stoul(cells[1])));
        rows.value.push_back(std::stod(cells[2]));
        if (!cells[3].empty()) rows.error.push_back(std::stof(cells[3]));
    }
    for (std::size_t i = 1; i < rows.begin.size(); ++i)
        rows.begin[i] += rows.begin[i - 1];
    return rows;
}

/// CRC-32 bit by bit.
std::uint32_t crc_of(std::string_view bytes) {
    std::uint32_t crc = ~0u;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit)
            crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

/// Content of the files of an archive of stored files, found through its directory.
std::map<std::string, std::string> unzip(std::string_view archive) {
    std::map<std::string, std::string> files;
    REQUIRE(archive.size() > 22);
    const std::size_t end = archive.size() - 22;
    REQUIRE(number_at<std::uint32_t>(archive, end) == 0x06054b50u);
    const auto entries = number_at<std::uint16_t>(archive, end + 10);
    std::size_t at = number_at<std::uint32_t>(archive, end + 16);
    CHECK(at + number_at<std::uint32_t>(archive, end + 12) == end);
    for (unsigned k = 0; k < entries; ++k) {
        REQUIRE(number_at<std::uint32_t>(archive, at) == 0x02014b50u);
        CHECK(number_at<std::uint16_t>(archive, at + 10) == 0);  // stored
        const auto crc = number_at<std::uint32_t>(archive, at + 16);
        const auto size = number_at<std::uint32_t>(archive, at + 24);
        CHECK(number_at<std::uint32_t>(archive, at + 20) == size);
        const auto name_size = number_at<std::uint16_t>(archive, at + 28);
        const std::string name(archive.substr(at + 46, name_size));
        const std::size_t local = number_at<std::uint32_t>(archive, at + 42);
        REQUIRE(number_at<std::uint32_t>(archive, local) == 0x04034b50u);
        CHECK(number_at<std::uint32_t>(archive, local + 14) == crc);
        CHECK(number_at<std::uint32_t>(archive, local + 22) == size);
        CHECK(archive.substr(local + 30, number_at<std::uint16_t>(archive, local + 26)) == name);
        const std::size_t data = local + 30 + name_size + number_at<std::uint16_t>(archive, local + 28);
        REQUIRE(data + size <= archive.size());
        files[name] = archive.substr(data, size);
        CHECK(crc_of(files[name]) == crc);
        at += 46 + name_size + number_at<std::uint16_t>(archive, at + 30) + number_at<std::uint16_t>(archive, at + 32);
    }
    CHECK(at == end);
    return files;
}

struct Array {
    std::string header, data;
};

/// NPY version 1.0.
Array npy(const std::map<std::string, std::string>& files, const std::string& name) {
    INFO(name);
    const auto found = files.find(name + ".npy");
    REQUIRE(found != files.end());
    const std::string& bytes = found->second;
    REQUIRE(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
    const std::size_t length = number_at<std::uint16_t>(bytes, 8);
    CHECK((10 + length) % 64 == 0);
    CHECK(bytes.at(10 + length - 1) == '\n');
    return {bytes.substr(10, length), bytes.substr(10 + length)};
}

Rows read_npz(const std::filesystem::path& file) {
    const auto files = unzip(content_of(file));
    const auto typed = [&](const std::string& name, const std::string& type) {
        const Array array = npy(files, name);
        INFO(name << ": " << array.header);
        CHECK(array.header.find("'descr': '" + type + "'") != std::string::npos);
        CHECK(array.header.find("'fortran_order': False") != std::string::npos);
        return array.data;
    };
    Rows rows;
    CHECK(typed("format", "|S3") == "csr");
    for (const std::int64_t begin : array_of<std::int64_t>(typed("indptr", "<i8")))
        rows.begin.push_back(static_cast<std::uint64_t>(begin));
    const auto count = static_cast<std::int64_t>(rows.count());
    CHECK(array_of<std::int64_t>(typed("shape", "<i8")) == std::vector<std::int64_t>{count, count});
    rows.column = array_of<std::uint32_t>(typed("indices", "<i4"));
    rows.value = array_of<double>(typed("data", "<f8"));
    if (files.count("error.npy") > 0) rows.error = array_of<float>(typed("error", "<f4"));
    rows.area_m2 = array_of<double>(typed("area_m2", "<f8"));
    rows.centre_m = array_of<double>(typed("centre_m", "<f8"));
    CHECK(npy(files, "centre_m").header.find("'shape': (" + std::to_string(count) + ", 3)") != std::string::npos);
    rows.normal = array_of<double>(typed("normal", "<f8"));
    rows.row_sum = array_of<double>(typed("row_sum", "<f8"));
    rows.lost = array_of<double>(typed("lost", "<f8"));
    rows.truncated = array_of<double>(typed("truncated", "<f8"));
    rows.escaped = array_of<double>(typed("escaped", "<f8"));
    rows.reciprocity_gap = array_of<double>(typed("reciprocity_gap", "<f8"));
    const Array names = npy(files, "face_names");
    const std::size_t width = std::stoul(names.header.substr(names.header.find("|S") + 2));
    for (const std::uint32_t face : array_of<std::uint32_t>(typed("face", "<u4"))) {
        const std::string padded = names.data.substr(face * width, width);
        rows.face.push_back(padded.substr(0, padded.find('\0')));
    }
    rows.description = npy(files, "description").data;
    return rows;
}

Rows read_binary(const std::filesystem::path& file) {
    const std::string bytes = content_of(file);
    REQUIRE(bytes.substr(0, 8) == "NATURLFF");
    REQUIRE(number_at<std::uint32_t>(bytes, 8) == 2);
    const bool has_errors = (number_at<std::uint32_t>(bytes, 12) & 1u) != 0;
    const auto n = number_at<std::uint64_t>(bytes, 16), entries = number_at<std::uint64_t>(bytes, 24);
    const auto faces = number_at<std::uint64_t>(bytes, 32);
    const auto description = number_at<std::uint64_t>(bytes, 40), names = number_at<std::uint64_t>(bytes, 48);
    std::size_t at = 56;
    const auto next = [&](std::uint64_t size) {
        REQUIRE(at + size <= bytes.size());
        const std::string_view part = std::string_view(bytes).substr(at, size);
        at += (size + 7) / 8 * 8;
        return part;
    };
    Rows rows;
    rows.description = next(description);
    const auto face_names = lines_of(std::string(next(names)));
    REQUIRE(face_names.size() == faces);
    rows.area_m2 = array_of<double>(next(8 * n));
    rows.centre_m = array_of<double>(next(24 * n));
    rows.normal = array_of<double>(next(24 * n));
    for (const std::uint32_t face : array_of<std::uint32_t>(next(4 * n)))
        rows.face.push_back(face_names.at(face));
    rows.row_sum = array_of<double>(next(8 * n));
    rows.lost = array_of<double>(next(8 * n));
    rows.truncated = array_of<double>(next(8 * n));
    rows.escaped = array_of<double>(next(8 * n));
    rows.reciprocity_gap = array_of<double>(next(8 * n));
    rows.begin = array_of<std::uint64_t>(next(8 * (n + 1)));
    rows.column = array_of<std::uint32_t>(next(4 * entries));
    rows.value = array_of<double>(next(8 * entries));
    if (has_errors) rows.error = array_of<float>(next(4 * entries));
    CHECK(at == bytes.size());
    return rows;
}

Rows read_rows(const std::filesystem::path& file) {
    if (file.extension() == ".csv") return read_csv(file);
    return file.extension() == ".npz" ? read_npz(file) : read_binary(file);
}

/// A folder with the small room and what formfactors makes of it.
struct Workshop {
    Workshop() { write(folder / "room.json", small_room); }
    Outcome make(const std::string& name, std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(),
                         {"formfactors", (folder / "room.json").string(), "--out", (folder / name).string()});
        return run_naturel(arguments);
    }
    TemporaryFolder folder;
};

}  // namespace

TEST_CASE("a file of form factors holds the same in each of its forms", "[cli][form_factors]") {
    const Workshop workshop;
    for (const std::string& backend : backend_names()) {
        INFO(backend);
        Rows first;
        for (const char* name : {"f.csv", "f.npz", "f.bin"}) {
            INFO(name);
            const Outcome outcome = workshop.make(name, {"--backend", backend, "--quality", "draft"});
            INFO(outcome.errors);
            REQUIRE(outcome.exit_code == 0);
            const Rows rows = read_rows(workshop.folder / name);
            if (first.value.empty()) first = rows;
            // Numbers in CSV files have as many digits as it takes to read them back to the last bit.
            CHECK(rows.begin == first.begin);
            CHECK(rows.column == first.column);
            CHECK(rows.value == first.value);
            CHECK(rows.error == first.error);
            CHECK(rows.area_m2 == first.area_m2);
            CHECK(rows.centre_m == first.centre_m);
            CHECK(rows.normal == first.normal);
            CHECK(rows.face == first.face);
            CHECK(rows.row_sum == first.row_sum);
            CHECK(rows.lost == first.lost);
            CHECK(rows.truncated == first.truncated);
            CHECK(rows.escaped == first.escaped);
            CHECK(rows.reciprocity_gap == first.reciprocity_gap);
            CHECK(rows.description == first.description);
        }
        const auto description = nlohmann::json::parse(first.description);
        CHECK(description["backend"]["name"] == backend);
        CHECK(description["entries"] == first.value.size());
        CHECK(description["rows"] == first.count());
        double area_m2 = 0.0, mean_escaped = 0.0;
        for (std::size_t i = 0; i < first.count(); ++i) {
            area_m2 += first.area_m2[i];
            mean_escaped += first.area_m2[i] * first.escaped[i];
        }
        // Rounding of a mean of numbers below 1.
        CHECK(std::abs(description["mean_escaped"].get<double>() - mean_escaped / area_m2) < 1e-14);
        CHECK(description["worst_escaped"] == *std::ranges::max_element(first.escaped));
    }
}

TEST_CASE("a file of form factors fits the room, and its sums and gaps are those of its values", "[cli][form_factors]") {
    const Workshop workshop;
    for (const std::string& backend : backend_names()) {
        for (const char* repair : {"none", "reciprocal"}) {
            INFO(backend << ", repair " << repair);
            REQUIRE(workshop.make("f.bin", {"--backend", backend, "--quality", "draft", "--form-factor-repair", repair})
                        .exit_code == 0);
            const Rows rows = read_rows(workshop.folder / "f.bin");
            REQUIRE(rows.begin.back() == rows.value.size());
            double area_m2 = 0.0;
            for (const double area : rows.area_m2)
                area_m2 += area;
            // Floor and ceiling 3 x 3 m, walls 4 x 3 x 2.5 m, the reveal of a window of 2 x 1.5 m, 0.5 m deep; the window's
            // opening in the wall comes back as the aperture at the end of the reveal.
            CHECK(std::abs(area_m2 - (18.0 + 30.0 + 3.5)) < 1e-9);
            std::map<std::pair<std::uint32_t, std::uint32_t>, double> exchange;
            for (std::uint32_t i = 0; i < rows.count(); ++i)
                for (std::size_t e = rows.begin[i]; e < rows.begin[i + 1]; ++e)
                    exchange[{i, rows.column[e]}] = rows.area_m2[i] * rows.value[e];
            for (std::uint32_t i = 0; i < rows.count(); ++i) {
                double sum = 0.0, gap = 0.0, all = 0.0;
                for (std::uint32_t j = 0; j < rows.count(); ++j) {
                    const auto there = exchange.find({i, j}), back = exchange.find({j, i});
                    const double a = there == exchange.end() ? 0.0 : there->second;
                    const double b = back == exchange.end() ? 0.0 : back->second;
                    sum += a / rows.area_m2[i];
                    gap += std::abs(a - b);
                    all += a + b;
                }
                // Rounding alone: some hundred terms of order 1.
                CHECK(std::abs(sum - rows.row_sum[i]) < 1e-12);
                CHECK(std::abs(gap / all - rows.reciprocity_gap[i]) < 1e-12);
                // Rays and cells of a closed room all meet something; the repair meets its targets to 1e-10.
                CHECK(std::abs(sum + rows.lost[i] + rows.truncated[i] - 1.0) < 1e-9);
                if (std::string_view(repair) == "reciprocal") CHECK(rows.reciprocity_gap[i] < 1e-12);
            }
        }
    }
}

#ifdef NATUREL_HAS_EMBREE
TEST_CASE("pairs of patches come with estimated errors within the tolerance, and agree with rays", "[cli][form_factors]") {
    const Workshop workshop;
    REQUIRE(workshop.make("pairs.npz", {"--form-factors", "pairwise", "--pair-tolerance", "1e-5"}).exit_code == 0);
    REQUIRE(workshop.make("rays.npz", {"--rays", "65536"}).exit_code == 0);
    const Rows pairs = read_rows(workshop.folder / "pairs.npz"), rays = read_rows(workshop.folder / "rays.npz");
    CHECK(nlohmann::json::parse(pairs.description)["backend"]["settings"]["form_factors"] == "pairwise");
    REQUIRE(pairs.error.size() == pairs.value.size());
    for (std::size_t i = 0; i < pairs.count(); ++i) {
        // Both directions are computed at once, to rounding of products of areas.
        CHECK(pairs.reciprocity_gap[i] < 1e-13);
        for (std::size_t e = pairs.begin[i]; e < pairs.begin[i + 1]; ++e)
            // The tolerance is for what occluders hide; the closed form has an error of its own, far smaller.
            CHECK(static_cast<double>(pairs.error[e]) <= 1.01e-5);
    }
    std::map<std::pair<std::size_t, std::uint32_t>, double> exact;
    for (std::size_t i = 0; i < pairs.count(); ++i)
        for (std::size_t e = pairs.begin[i]; e < pairs.begin[i + 1]; ++e)
            exact[{i, pairs.column[e]}] = pairs.value[e];
    REQUIRE(rays.count() == pairs.count());
    for (std::size_t i = 0; i < rays.count(); ++i)
        for (std::size_t e = rays.begin[i]; e < rays.begin[i + 1]; ++e) {
            const double f = exact[{i, rays.column[e]}];
            // Five standard deviations of 65536 independent rays; strata are better than that.
            CHECK(std::abs(rays.value[e] - f) < 5.0 * std::sqrt((f + 1e-4) / 65536.0));
        }
}
#endif

TEST_CASE("a file of form factors has the same bytes for any number of threads", "[cli][form_factors]") {
    const Workshop workshop;
    for (const std::string& backend : backend_names()) {
        INFO(backend);
        std::map<std::string, std::string> first;
        for (const char* threads : {"1", "2", "3"}) {
            for (const char* name : {"f.csv", "f.npz", "f.bin"})
                REQUIRE(workshop.make(std::string(threads) + "/" + name,
                                      {"--backend", backend, "--quality", "draft", "--threads", threads})
                            .exit_code == 0);
            const auto files = files_below(workshop.folder / threads);
            REQUIRE(files.size() == 5);  // f.csv has f.patches.csv and f.description.json beside it
            if (first.empty()) first = files;
            CHECK(files == first);
        }
    }
}

TEST_CASE("form factors that cannot be written leave nothing behind", "[cli][form_factors]") {
    const Workshop workshop;
    write(workshop.folder / "file", "keep me");
    const Outcome below_a_file = workshop.make("file/f.npz", {});
    CHECK(below_a_file.exit_code == 3);
    CHECK(below_a_file.errors.find("file") != std::string::npos);
    CHECK(content_of(workshop.folder / "file") == "keep me");

    // A folder stands where the file shall be: found when it is renamed, after all is computed.
    std::filesystem::create_directories(workshop.folder / "taken.npz" / "inside");
    CHECK(workshop.make("taken.npz", {"--quality", "draft"}).exit_code == 3);
    CHECK(std::filesystem::exists(workshop.folder / "taken.npz" / "inside"));
    for (const auto& entry : std::filesystem::directory_iterator(workshop.folder.path()))
        CHECK(entry.path().extension() != ".part");

    const Outcome ending = workshop.make("f.txt", {});
    CHECK(ending.exit_code == 2);
    CHECK(ending.errors.find("does not end in .csv, .npz or .bin") != std::string::npos);
    CHECK(workshop.make("f.bin", {"--backend", "both"}).exit_code == 2);
}

TEST_CASE("form factors are never written over the scene, nor over a table that it reads", "[cli][form_factors]") {
    const Workshop workshop;
    const std::string scene = content_of(workshop.folder / "room.json");
    REQUIRE(workshop.make("room.csv", {"--quality", "draft"}).exit_code == 0);
    CHECK(content_of(workshop.folder / "room.json") == scene);
    CHECK(std::filesystem::exists(workshop.folder / "room.description.json"));

    std::string with_table(small_room);
    const std::string wall = R"("wall": {"reflectance": 0.5})";
    with_table.replace(with_table.find(wall), wall.size(), R"("wall": {"spectral_reflectance": {"file": "wall.csv"}})");
    struct Danger {
        const char* scene;  // its name
        const char* out;
    };
    for (const Danger& danger : {Danger{"f.csv", "f.csv"}, {"f.npz", "f.npz"}, {"f.bin", "f.bin"}, {"f.description.json", "f.csv"},
                                 {"f.patches.csv", "f.csv"}, {"f.json", "wall.csv"}, {"f.json", "other name of wall.csv"}}) {
        INFO(danger.scene << " to " << danger.out);
        const TemporaryFolder folder;
        write(folder / danger.scene, with_table);
        write(folder / "wall.csv", "wavelength,value\n400,0.5\n700,0.5\n");
        std::filesystem::create_hard_link(folder / "wall.csv", folder / "other name of wall.csv");
        const auto before = files_below(folder.path());
        const Outcome outcome = run_naturel({"formfactors", (folder / danger.scene).string(), "--quality", "draft", "--out", (folder / danger.out).string()});
        CHECK(outcome.exit_code == 3);
        CHECK(outcome.errors.find("would be written over it (give another --out)") != std::string::npos);
        CHECK(files_below(folder.path()) == before);
    }
}

TEST_CASE("form factors that memory cannot hold are refused with what would help", "[cli][form_factors]") {
    const Workshop workshop;
    const bool has_embree = backend_names().back() == "embree";
    // Half a million patches with a row of up to 130000 or 60000 entries each.
    const Outcome outcome = workshop.make("f.npz", {"--grid-spacing", "0.01", has_embree ? "--rays" : "--cells", has_embree ? "131072" : "1024"});
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 3);
    for (const char* part : {"and this machine has", "--grid-spacing", "\"spacing_m\" of the scene's \"grid\"", has_embree ? "fewer \"--rays\"" : "fewer \"--cells\""})
        CHECK(outcome.errors.find(part) != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(workshop.folder / "f.npz"));
}

TEST_CASE("a dry run of form factors tells memory, size and time, and writes nothing", "[cli][form_factors]") {
    const Workshop workshop;
    for (const std::string& backend : backend_names()) {
        const Outcome outcome = workshop.make("somewhere/f.npz", {"--backend", backend, "--dry-run"});
        INFO(outcome.output);
        REQUIRE(outcome.exit_code == 0);
        for (const std::string& part : {backend + ": form factors, quality normal", std::string("grid 1 m indoors"), std::string("memory at most about"),
                                        std::string("f.npz: at most about"), std::string("work:"), std::string("of one core")})
            CHECK(outcome.output.find(part) != std::string::npos);
        CHECK_FALSE(std::filesystem::exists(workshop.folder / "somewhere"));
    }
}

TEST_CASE("a scene without a surface indoors has no form factors", "[cli][form_factors]") {
    const TemporaryFolder folder;
    write(folder / "plate.json", R"({"naturel": 1, "materials": {"w": {"reflectance": 0.5}},
        "polygons": [{"id": "plate", "vertices": [[0, 0, 1], [1, 0, 1], [1, 1, 1]], "material": "w", "side": "outdoor"}],
        "sky": {"model": "uniform", "horizontal_illuminance_lx": 1000}})");
    const Outcome outcome = run_naturel({"formfactors", (folder / "plate.json").string(), "--out", (folder / "f.csv").string()});
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find("no surface indoors") != std::string::npos);
    CHECK(files_below(folder.path()).size() == 1);
}

TEST_CASE("help shows what the presets choose for form factors", "[cli][form_factors]") {
    const Outcome outcome = run_naturel({"formfactors", "--help"});
    CHECK(outcome.exit_code == 0);
    for (const char* part : {"grid indoors, m", "hemisphere: rays per patch", "pairwise: tolerance", "hemicube: cells along side", "--dry-run", "--target-error"})
        CHECK(outcome.output.find(part) != std::string::npos);
    for (const char* part : {"radiosity", "--rays-per-point"})  // what this command has no use for
        CHECK(outcome.output.find(part) == std::string::npos);
}

#ifdef NATUREL_HAS_EMBREE
TEST_CASE("pairs are forecast to take longer for a smaller tolerance", "[cli][form_factors]") {
    const Workshop workshop;
    double before_s = 0.0;
    for (const char* tolerance : {"1e-4", "1e-5", "1e-6", "1e-7"}) {
        const std::string told = workshop.make("f.bin", {"--form-factors", "pairwise", "--grid-spacing", "0.1", "--pair-tolerance", tolerance, "--dry-run"}).output;
        const std::size_t at = told.find("time about ");
        REQUIRE(at != std::string::npos);
        const double minutes_or_s = std::stod(told.substr(at + 11));
        const double s = told.find(" min of one core") != std::string::npos ? 60.0 * minutes_or_s : minutes_or_s;
        INFO(told);
        CHECK(s > before_s);
        before_s = s;
    }
}

TEST_CASE("rays are doubled until a row has the error that is asked for", "[cli][form_factors]") {
    const Workshop workshop;
    constexpr double target = 0.01;
    const auto row_errors = [](const Rows& rows) {
        std::vector<double> errors;
        for (std::size_t i = 0; i < rows.count(); ++i) {
            double squares = 0.0;
            for (std::size_t e = rows.begin[i]; e < rows.begin[i + 1]; ++e) squares += static_cast<double>(rows.error[e]) * static_cast<double>(rows.error[e]);
            errors.push_back(std::sqrt(squares));
        }
        return errors;
    };
    REQUIRE(workshop.make("few.bin", {"--rays", "256"}).exit_code == 0);
    const auto few = row_errors(read_rows(workshop.folder / "few.bin"));
    REQUIRE(*std::ranges::max_element(few) > target);

    for (const char* threads : {"1", "2"})
        REQUIRE(workshop.make(std::string(threads) + ".bin", {"--rays", "256", "--target-error", "0.01", "--threads", threads}).exit_code == 0);
    CHECK(content_of(workshop.folder / "1.bin") == content_of(workshop.folder / "2.bin"));
    const Rows rows = read_rows(workshop.folder / "1.bin");
    // Errors in the file are floats.
    for (const double error : row_errors(rows)) CHECK(error <= target * (1.0 + 1e-6));
    const auto settings = nlohmann::json::parse(rows.description)["backend"]["settings"];
    CHECK(settings["target_error"] == "0.01");
    CHECK(settings["most_rays_per_patch"] == "1048576");

    // Nobody reaches a millionth with so few rays.
    REQUIRE(workshop.make("most.bin", {"--rays", "256", "--target-error", "1e-6", "--most-rays", "1024"}).exit_code == 0);
    REQUIRE(workshop.make("1024.bin", {"--rays", "1024"}).exit_code == 0);
    const Rows most = read_rows(workshop.folder / "most.bin");
    CHECK(nlohmann::json::parse(most.description)["backend"]["settings"]["most_rays_per_patch"] == "1024");
    const auto rms = [](const std::vector<double>& errors) {
        double squares = 0.0;
        for (const double error : errors) squares += error * error;
        return std::sqrt(squares / static_cast<double>(errors.size()));
    };
    // The same number of rays, differently stratified.
    const double limited = rms(row_errors(most)), plain = rms(row_errors(read_rows(workshop.folder / "1024.bin")));
    CHECK(limited < rms(few) / 1.7);
    CHECK(limited > 0.5 * plain);
    CHECK(limited < 2.0 * plain);

    const Outcome dry = workshop.make("dry.bin", {"--target-error", "0.01", "--dry-run"});
    CHECK(dry.output.find("work: at most ") != std::string::npos);
    CHECK(dry.output.find("time at most about ") != std::string::npos);
}

TEST_CASE("a closed room that loses what its patches see is told of", "[cli][form_factors]") {
    // A kilometre high and a tenth of a millimetre wide: rays start further from a wall than the other wall is.
    constexpr std::string_view needle = R"({"naturel": 1, "materials": {"w": {"reflectance": 0.5}}, "polyhedra": [
        {"id": "shell", "kind": "parallelepiped", "effect": "fill", "material": "w",
         "vertices": [[-1e-05, -1e-05, 0.99999], [0.00011, -1e-05, 0.99999], [-1e-05, 0.00011, 0.99999], [-1e-05, -1e-05, 1001.00001]]},
        {"id": "room", "kind": "parallelepiped", "effect": "carve", "material": "w",
         "vertices": [[0, 0, 1], [0.0001, 0, 1], [0, 0.0001, 1], [0, 0, 1001]]}],
        "sky": {"model": "uniform", "horizontal_illuminance_lx": 10000}, "grid": {"spacing_m": 100, "zones": false}})";
    const Workshop workshop;
    write(workshop.folder / "needle.json", needle);
    for (const char* command : {"formfactors", "run"}) {
        INFO(command);
        const auto out = workshop.folder / (std::string_view(command) == "run" ? "out" : "f.csv");
        const Outcome outcome = run_naturel({command, (workshop.folder / "needle.json").string(), "--out", out.string()});
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 0);
        CHECK(outcome.errors.find("warning: ") != std::string::npos);
        CHECK(outcome.errors.find("patches lose more than 1 % of what leaves them") != std::string::npos);
    }
    const Outcome sound = workshop.make("f.csv", {"--quality", "draft"});
    CHECK(sound.errors.find("warning") == std::string::npos);
}
#endif
