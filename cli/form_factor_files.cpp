#include "cli/form_factor_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <span>

#include "cli/file_writer.h"
#include "cli/little_endian.h"
#include "cli/npy.h"
#include "cli/zip_writer.h"
#include "core/parallel.h"

namespace naturel {
namespace {

/// What the files say of each row, as arrays.
struct RowArrays {
    std::vector<double> area_m2, centre_m, normal;  ///< [rows], [rows x 3], [rows x 3]
    std::vector<std::uint32_t> face;                ///< [rows], into the names of faces

    explicit RowArrays(const FormFactorTable& table) {
        for (std::size_t i = 0; i < table.form_factors.row_count(); ++i) {
            const Patch& patch = table.grid.patches[i];
            area_m2.push_back(patch.area_m2);
            centre_m.insert(centre_m.end(), {patch.centroid_m.x, patch.centroid_m.y, patch.centroid_m.z});
            normal.insert(normal.end(), {patch.normal.x, patch.normal.y, patch.normal.z});
            face.push_back(static_cast<std::uint32_t>(index(patch.face)));
        }
    }
};

std::string csv_text(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text)
        quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
}

std::string entry_lines(const FormFactors& f, std::size_t first_row, std::size_t end_row) {
    std::string text;
    for (std::size_t i = first_row; i < end_row; ++i) {
        for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) {
            fmt::format_to(std::back_inserter(text), "{},{},{},", i, f.column[e], f.value[e]);
            if (!f.error.empty()) fmt::format_to(std::back_inserter(text), "{}", f.error[e]);
            text += '\n';
        }
    }
    return text;
}

/// To write out numbers takes longer than to compute them from few rays: in parallel, piece by piece.
void write_entries_csv(WholeFile& file, const FormFactors& f) {
    constexpr std::size_t pieces_at_a_time = 32, entries_per_piece = 10'000;  // some 10 MB of text
    file.write("row,column,form_factor,error\n");
    std::vector<std::size_t> begin;  // rows of the pieces
    std::vector<std::string> pieces;
    for (std::size_t row = 0; row < f.row_count();) {
        begin.assign(1, row);
        while (begin.size() <= pieces_at_a_time && row < f.row_count()) {
            const std::uint64_t full = f.row_begin[row] + entries_per_piece;
            while (row < f.row_count() && f.row_begin[row] < full) ++row;
            begin.push_back(row);
        }
        pieces.assign(begin.size() - 1, {});
        parallel_for(pieces.size(), 1, [&](std::size_t p) { pieces[p] = entry_lines(f, begin[p], begin[p + 1]); });
        for (const std::string& piece : pieces) file.write(piece);
    }
}

void write_patches_csv(WholeFile& file, const FormFactorTable& table) {
    std::string text = "patch,face,area_m2,x_m,y_m,z_m,nx,ny,nz,row_sum,lost,truncated,escaped,reciprocity_gap\n";
    for (std::size_t i = 0; i < table.form_factors.row_count(); ++i) {
        const Patch& patch = table.grid.patches[i];
        // + 0.0 turns -0 into 0.
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", i,
                       csv_text(table.building.faces[index(patch.face)].name), patch.area_m2, patch.centroid_m.x + 0.0,
                       patch.centroid_m.y + 0.0, patch.centroid_m.z + 0.0, patch.normal.x + 0.0, patch.normal.y + 0.0,
                       patch.normal.z + 0.0, table.row_sum[i], table.form_factors.lost[i], table.form_factors.truncated[i],
                       table.form_factors.escaped[i], table.reciprocity_gap[i]);
    }
    file.write(text);
}

template <class T>
void add_array(ZipWriter& zip, std::string_view name, const std::vector<T>& values, std::size_t columns = 1) {
    const std::string shape = columns == 1 ? fmt::format("({},)", values.size())
                                           : fmt::format("({}, {})", values.size() / columns, columns);
    const std::string header = npy_header(npy_type<T>(), shape);
    const std::string_view parts[] = {header, bytes_of(std::span<const T>(values))};
    zip.add(fmt::format("{}.npy", name), parts);
}

/// A text, as bytes; numpy knows it as an array without dimensions.
void add_text(ZipWriter& zip, std::string_view name, std::string_view text) {
    const std::string header = npy_header(fmt::format("|S{}", text.size()), "()");
    const std::string_view parts[] = {header, text};
    zip.add(fmt::format("{}.npy", name), parts);
}

void add_names(ZipWriter& zip, std::string_view name, const std::vector<Face>& faces) {
    std::size_t longest = 1;
    for (const Face& face : faces)
        longest = std::max(longest, face.name.size());
    std::string bytes;
    for (const Face& face : faces)
        bytes += face.name + std::string(longest - face.name.size(), '\0');
    const std::string header = npy_header(fmt::format("|S{}", longest), fmt::format("({},)", faces.size()));
    const std::string_view parts[] = {header, bytes};
    zip.add(fmt::format("{}.npy", name), parts);
}

void write_npz(WholeFile& file, const FormFactorTable& table) {
    const FormFactors& f = table.form_factors;
    const RowArrays rows(table);
    const auto count = static_cast<std::int64_t>(f.row_count());
    ZipWriter zip(file);
    // What scipy.sparse.load_npz() asks for.
    add_text(zip, "format", "csr");
    add_array(zip, "shape", std::vector<std::int64_t>{count, count});
    add_array(zip, "indptr", std::vector<std::int64_t>(f.row_begin.begin(), f.row_begin.end()));
    add_array(zip, "indices", std::vector<std::int32_t>(f.column.begin(), f.column.end()));
    add_array(zip, "data", f.value);
    if (!f.error.empty()) add_array(zip, "error", f.error);
    add_array(zip, "area_m2", rows.area_m2);
    add_array(zip, "centre_m", rows.centre_m, 3);
    add_array(zip, "normal", rows.normal, 3);
    add_array(zip, "face", rows.face);
    add_names(zip, "face_names", table.building.faces);
    add_array(zip, "row_sum", table.row_sum);
    add_array(zip, "lost", f.lost);
    add_array(zip, "truncated", f.truncated);
    add_array(zip, "escaped", f.escaped);
    add_array(zip, "reciprocity_gap", table.reciprocity_gap);
    add_text(zip, "description", table.description);
    zip.finish();
}

void write_binary(WholeFile& file, const FormFactorTable& table) {
    constexpr std::uint32_t version = 2, has_errors = 1;
    const FormFactors& f = table.form_factors;
    const RowArrays rows(table);
    std::string names;
    for (const Face& face : table.building.faces)
        names += face.name + '\n';

    std::string header = "NATURLFF";
    append_bytes(header, version);
    append_bytes(header, f.error.empty() ? 0u : has_errors);
    append_bytes<std::uint64_t>(header, f.row_count());
    append_bytes<std::uint64_t>(header, f.column.size());
    append_bytes<std::uint64_t>(header, table.building.faces.size());
    append_bytes<std::uint64_t>(header, table.description.size());
    append_bytes<std::uint64_t>(header, names.size());
    file.write(header);
    const auto write = [&](std::string_view bytes) {
        file.write(bytes);
        file.write(std::string((8 - bytes.size() % 8) % 8, '\0'));
    };
    const auto write_array = [&]<class T>(const std::vector<T>& values) { write(bytes_of(std::span<const T>(values))); };
    write(table.description);
    write(names);
    write_array(rows.area_m2);
    write_array(rows.centre_m);
    write_array(rows.normal);
    write_array(rows.face);
    write_array(table.row_sum);
    write_array(f.lost);
    write_array(f.truncated);
    write_array(f.escaped);
    write_array(table.reciprocity_gap);
    write_array(f.row_begin);
    write_array(f.column);
    write_array(f.value);
    if (!f.error.empty()) write_array(f.error);
}

}  // namespace

std::vector<std::filesystem::path> names_of_form_factor_files(const std::filesystem::path& file) {
    if (file.extension() != ".csv") return {file};
    const auto beside = [&](const char* ending) {
        std::filesystem::path name = file;
        return name.replace_extension(ending);
    };
    // Not plain .json: room.csv is a likely name where the scene is room.json.
    return {beside(".patches.csv"), beside(".description.json"), file};
}

std::vector<std::filesystem::path> write_form_factor_files(const std::filesystem::path& file, const FormFactorTable& table) {
    std::vector<std::filesystem::path> names = names_of_form_factor_files(file);
    std::vector<std::unique_ptr<WholeFile>> files;
    for (const std::filesystem::path& name : names) files.push_back(std::make_unique<WholeFile>(name));
    if (file.extension() == ".csv") {
        write_patches_csv(*files[0], table);
        files[1]->write(table.description);
        write_entries_csv(*files[2], table.form_factors);
    } else if (file.extension() == ".npz") {
        write_npz(*files[0], table);
    } else {
        write_binary(*files[0], table);
    }
    for (const auto& whole : files)
        whole->close();
    // The named file goes first and comes last: where it is, it belongs to those beside it.
    if (files.size() > 1) files.back()->remove_earlier();
    for (const auto& whole : files)
        whole->put_in_place();
    return names;
}

}  // namespace naturel
