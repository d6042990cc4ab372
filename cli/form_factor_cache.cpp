#include "cli/form_factor_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>

#include "cli/file_reader.h"
#include "cli/file_writer.h"
#include "cli/fingerprint.h"
#include "core/errors.h"

namespace naturel {
namespace {

constexpr std::string_view entry_magic = "NATURFF1";
constexpr std::string_view ending = ".rows";
constexpr std::size_t entry_checksum_bytes = 64;

void note(const FormFactorCache& cache, const std::string& text) {
    if (cache.tell)
        cache.tell("cache: " + text);
    else
        std::fputs(("naturel: cache: " + text + "\n").c_str(), stderr);
}

/// Numbers of entries, then arrays one after the other, then the SHA-256 of all that.
std::string bytes_of_rows(const FormFactorRows& rows) {
    std::string bytes(entry_magic);
    append_bytes<std::uint64_t>(bytes, rows.lost.size());
    append_bytes<std::uint64_t>(bytes, rows.column.size());
    append_bytes<std::uint64_t>(bytes, rows.error.size());
    const auto append = [&]<class T>(const std::vector<T>& values) { bytes += bytes_of(std::span<const T>(values)); };
    append(rows.row_begin), append(rows.column), append(rows.value), append(rows.error);
    append(rows.lost), append(rows.truncated), append(rows.escaped);
    return bytes += sha256_hex(bytes);
}

/// Empty if the bytes are not what bytes_of_rows() wrote for so many rows.
std::optional<FormFactorRows> rows_of_bytes(std::string_view bytes, std::size_t row_count) {
    if (bytes.size() < entry_magic.size() + 3 * sizeof(std::uint64_t) + entry_checksum_bytes || !bytes.starts_with(entry_magic)) return std::nullopt;
    const std::string_view content = bytes.substr(0, bytes.size() - entry_checksum_bytes);
    if (bytes.substr(content.size()) != sha256_hex(content)) return std::nullopt;
    const char* at = content.data() + entry_magic.size();
    const auto take = [&](void* target, std::size_t size) {
        if (size > 0) std::memcpy(target, at, size);  // an empty array has no place
        at += size;
    };
    std::uint64_t counts[3];
    take(counts, sizeof counts);
    if (counts[0] != row_count) return std::nullopt;
    FormFactorRows rows;
    const auto take_array = [&]<class T>(std::vector<T>& values, std::uint64_t count) {
        values.resize(count);
        if (count > 0) take(values.data(), count * sizeof(T));
    };
    take_array(rows.row_begin, counts[0] + 1), take_array(rows.column, counts[1]), take_array(rows.value, counts[1]);
    take_array(rows.error, counts[2]);
    take_array(rows.lost, counts[0]), take_array(rows.truncated, counts[0]), take_array(rows.escaped, counts[0]);
    return rows;
}

/// Nothing where there is no file, or a damaged one.
std::optional<FormFactorRows> rows_of_file(const FormFactorCache& cache, const std::filesystem::path& file, std::size_t count) {
    std::error_code error;
    if (!std::filesystem::exists(file, error)) return {};
    try {
        if (auto rows = rows_of_bytes(file_content(file), count)) {
            std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now(), error);
            return rows;
        }
        note(cache, fmt::format("{} is damaged: its form factors are computed again", file.string()));
    } catch (const std::bad_alloc&) {
        note(cache, fmt::format("{} does not fit into memory beside the rest: its form factors are computed again", file.string()));
    } catch (const InputError& unreadable) {
        // Another process may just have removed it, to make room.
        if (std::filesystem::exists(file, error)) note(cache, unreadable.what());
    }
    return {};
}

/// Removes what was used longest ago, `kept` never. Another process may do the same at the same time: what is gone is gone.
void keep_below(const std::filesystem::path& folder, double limit_bytes, const std::filesystem::path& kept) {
    remove_left_parts(folder);
    struct File {
        std::filesystem::file_time_type used;
        std::filesystem::path path;
        double bytes;
    };
    std::vector<File> files;
    double all_bytes = 0.0;
    std::error_code gone;
    for (const auto& entry : entries_of(folder, gone)) {
        if (entry.path().extension() != ending) continue;
        const auto used = entry.last_write_time(gone);
        const auto bytes = gone ? 0 : entry.file_size(gone);
        if (gone) continue;
        files.push_back({used, entry.path(), static_cast<double>(bytes)});
        all_bytes += files.back().bytes;
    }
    std::ranges::sort(files, {}, [](const File& file) { return std::pair(file.used, file.path); });
    for (const File& file : files) {
        if (all_bytes <= limit_bytes) return;
        if (file.path == kept) continue;
        std::filesystem::remove(file.path, gone);
        all_bytes -= file.bytes;
    }
}

class CachedVisibility final : public Visibility {
public:
    CachedVisibility(std::unique_ptr<Visibility> seen, const Building& building, const PatchGrid& grid, const FormFactorCache& cache,
                     FormFactorMemory* memory)
        : seen_(std::move(seen)), building_(building), grid_(grid), cache_(cache), memory_(memory) {}

    std::string_view name() const noexcept override { return seen_->name(); }
    std::vector<std::pair<std::string, std::string>> settings() const override { return seen_->settings(); }
    void form_factor_row(PatchId from, FormFactorRow& row) const override { seen_->form_factor_row(from, row); }
    void gather_row(const GatherPoint& from, FormFactorRow& row) const override { seen_->gather_row(from, row); }
    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions, std::span<FacetId> seen) const override {
        seen_->first_seen(from, directions, seen);
    }
    void occluded(const GatherPoint& from, std::span<const glm::dvec3> directions, std::span<std::uint8_t> blocked) const override {
        seen_->occluded(from, directions, blocked);
    }
    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override {
        seen_->view_facets(camera, row_begin, row_end, seen);
    }

    FormFactorRows form_factor_rows(std::size_t count, bool with_errors, Progress& progress) const override {
        const std::string key = form_factor_key(building_, grid_, *seen_, count, with_errors);
        const std::filesystem::path file = cache_.folder / (key + std::string(ending));
        std::optional<FormFactorRows> rows;
        if (memory_ != nullptr) rows = memory_->find(key);
        if (rows) {
            found_ = true;
            return std::move(*rows);
        }
        if (!cache_.folder.empty()) rows = rows_of_file(cache_, file, count);
        if (rows) {
            found_ = true;
        } else {
            const auto start = std::chrono::steady_clock::now();
            rows = seen_->form_factor_rows(count, with_errors, progress);
            const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
            if (!cache_.folder.empty() && taken.count() >= cache_.least_seconds) keep(file, *rows);
        }
        if (memory_ != nullptr) memory_->keep(key, *rows);
        return std::move(*rows);
    }

    bool came_from_cache() const { return found_; }

private:
    void keep(const std::filesystem::path& file, const FormFactorRows& rows) const {
        try {
            const std::string bytes = bytes_of_rows(rows);
            if (static_cast<double>(bytes.size()) > cache_.limit_bytes) {
                note(cache_, fmt::format("form factors of {:.1f} MB are more than the limit lets in", static_cast<double>(bytes.size()) / 1e6));
                return;
            }
            std::error_code error;
            std::filesystem::create_directories(cache_.folder, error);
            if (error) {
                note(cache_, fmt::format("the folder {} cannot be made: {}; form factors are not kept", cache_.folder.string(), error.message()));
                return;
            }
            write_file(file, bytes);
            keep_below(cache_.folder, cache_.limit_bytes, file);
        } catch (const std::bad_alloc&) {
            note(cache_, "there is no memory for a copy of the form factors; they are not kept");
        } catch (const InputError& error) {
            note(cache_, fmt::format("{}; form factors are not kept", error.what()));
        }
    }

    std::unique_ptr<Visibility> seen_;
    const Building& building_;
    const PatchGrid& grid_;
    FormFactorCache cache_;
    FormFactorMemory* memory_;
    mutable std::atomic<bool> found_ = false;
};

}  // namespace

void remove_kept_rows(const std::filesystem::path& folder) {
    std::error_code gone;
    if (!std::filesystem::is_directory(folder, gone)) return;
    keep_below(folder, -1.0, {});
    std::filesystem::remove(folder, gone);  // not if there is anything of somebody else's
}

std::optional<FormFactorRows> FormFactorMemory::find(const std::string& key) {
    if (key != key_) {
        // Of a set that is done with.
        key_.clear();
        rows_ = {};
        return {};
    }
    if (more_) return rows_;
    key_.clear();
    return std::move(rows_);
}

void FormFactorMemory::keep(const std::string& key, const FormFactorRows& rows) {
    key_.clear();
    rows_ = {};
    if (!more_) return;
    try {
        rows_ = rows;
        key_ = key;
    } catch (const std::bad_alloc&) {
        rows_ = {};  // then they are computed again
    }
}

std::string form_factor_key(const Building& building, const PatchGrid& grid, const Visibility& visibility, std::size_t rows, bool with_errors) {
    Fingerprint print;
    print.add(std::string_view(NATUREL_VERSION)).add(visibility.name()).add(rows).add(with_errors);
    for (const auto& [name, value] : visibility.settings()) print.add(std::string_view(name)).add(std::string_view(value));
    print.add(building.facets.size());
    for (const Facet& facet : building.facets) {
        const Face& face = building.faces[index(facet.face)];
        print.add(index(facet.face)).add(facet.environment).add(facet.is_aperture).add(face.sheet).add(facet.vertices_m.size());
        for (const glm::dvec3& vertex : facet.vertices_m) print.add(vertex);
        print.add(face.frame.origin_m).add(face.frame.u_m).add(face.frame.v_m).add(face.normal);
    }
    print.add(grid.patches.size());
    for (std::size_t p = 0; p < grid.patches.size(); ++p) {
        print.add(index(grid.patches[p].face)).add(grid.patches[p].corner_count).add(grid.patches[p].centroid_m);
        for (const glm::dvec3& corner : grid.polygon_of(make_id<PatchId>(p))) print.add(corner);
    }
    return print.digest();
}

std::unique_ptr<Visibility> with_cache(std::unique_ptr<Visibility> visibility, const Building& building, const PatchGrid& grid,
                                       const FormFactorCache& cache, FormFactorMemory* memory) {
    if (cache.folder.empty() && memory == nullptr) return visibility;
    return std::make_unique<CachedVisibility>(std::move(visibility), building, grid, cache, memory);
}

bool came_from_cache(const Visibility& visibility) {
    const auto* cached = dynamic_cast<const CachedVisibility*>(&visibility);
    return cached != nullptr && cached->came_from_cache();
}

}  // namespace naturel
