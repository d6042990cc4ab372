#include "core/visibility.h"

#include <algorithm>

#include "core/errors.h"
#include "core/parallel.h"

namespace naturel {

FormFactorRows Visibility::form_factor_rows(std::size_t count, bool with_errors, Progress& progress) const {
    // Rows are computed in parallel by the chunk; a chunk keeps its rows in one piece of memory until all are joined. Short chunks,
    // for at the end threads wait for the last one.
    constexpr std::size_t rows_per_chunk = 16;
    struct Chunk {
        std::vector<std::uint32_t> column;
        std::vector<double> value;
        std::vector<float> error;
    };
    const std::size_t chunk_count = (count + rows_per_chunk - 1) / rows_per_chunk;
    std::vector<Chunk> chunks(chunk_count);
    std::vector<std::uint64_t> length(count);
    FormFactorRows all;
    all.lost.resize(count);
    all.truncated.resize(count);
    all.escaped.resize(count);
    ThreadScratch<FormFactorRow> rows;
    ThreadScratch<Chunk> growing;  // its memory is used again and again
    progress.begin("form factors", count);
    parallel_for(chunk_count, 1, [&](std::size_t c) {
        FormFactorRow& row = rows.local();
        Chunk& chunk = growing.local();
        chunk.column.clear();
        chunk.value.clear();
        chunk.error.clear();
        const std::size_t end = std::min(count, (c + 1) * rows_per_chunk);
        for (std::size_t i = c * rows_per_chunk; i < end && !progress.interrupted(); ++i) {
            form_factor_row(make_id<PatchId>(i), row);
            for (const PatchId patch : row.patches) chunk.column.push_back(static_cast<std::uint32_t>(patch));
            chunk.value.insert(chunk.value.end(), row.values.begin(), row.values.end());
            if (with_errors) chunk.error.insert(chunk.error.end(), row.errors.begin(), row.errors.end());
            length[i] = row.values.size();
            all.lost[i] = row.lost;
            all.truncated[i] = row.truncated;
            all.escaped[i] = row.escaped;
            progress.advance();
        }
        chunks[c] = chunk;  // allocates what the rows need and no more
    });
    progress.end();
    if (progress.interrupted()) throw Interrupted();

    all.row_begin.resize(count + 1);
    for (std::size_t i = 0; i < count; ++i) all.row_begin[i + 1] = all.row_begin[i] + length[i];
    const bool errors_known = with_errors && std::ranges::all_of(chunks, [](const Chunk& chunk) {
        return chunk.error.size() == chunk.value.size();
    });
    // Half of the memory each: what costs time is that the system fills it with zeros.
    parallel_for(2, 1, [&](std::size_t part) {
        if (part == 0) return all.value.resize(all.row_begin.back());
        all.column.resize(all.row_begin.back());
        if (errors_known) all.error.resize(all.row_begin.back());
    });
    parallel_for(chunk_count, 1, [&](std::size_t c) {
        const std::uint64_t first = all.row_begin[c * rows_per_chunk];
        std::ranges::copy(chunks[c].column, all.column.data() + first);
        std::ranges::copy(chunks[c].value, all.value.data() + first);
        if (errors_known) std::ranges::copy(chunks[c].error, all.error.data() + first);
        chunks[c] = {};
    });
    return all;
}

void Visibility::occluded(const GatherPoint& from, std::span<const glm::dvec3> directions,
                          std::span<std::uint8_t> blocked) const {
    NATUREL_EXPECT(directions.size() == blocked.size());
    std::vector<FacetId> seen(directions.size());
    first_seen(from, directions, seen);
    for (std::size_t k = 0; k < seen.size(); ++k) blocked[k] = seen[k] != FacetId::none;
}

}  // namespace naturel
