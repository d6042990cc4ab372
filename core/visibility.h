#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/progress.h"
#include "core/view.h"

namespace naturel {

/// A point that collects light from the half-space its normal looks into.
struct GatherPoint {
    glm::dvec3 position_m{};
    glm::dvec3 normal{0, 0, 1};  ///< unit length, into the air
};

/// One sparse row of form factors.
struct FormFactorRow {
    std::vector<PatchId> patches{};  ///< increasing
    std::vector<double> values{};    ///< F > 0, same order
    /// Estimated error of each value, same order: one standard error of a sampled value, a bound that holds for 99 % of computed
    /// ones. Empty where the method gives none.
    std::vector<float> errors{};
    double lost = 0.0;             ///< share that met nothing (a leak, a crack, the back of a one-sided polygon)
    double truncated = 0.0;        ///< share the method does not look at (outside a single plane's square)
    /// Share that slipped through a surface by rounding where nothing can be lost; `values` have it back already.
    double escaped = 0.0;

    void clear() {
        patches.clear();
        values.clear();
        errors.clear();
        lost = truncated = escaped = 0.0;
    }
};

/// Rows [0, n) in compressed form.
struct FormFactorRows {
    std::vector<std::uint64_t> row_begin{};  ///< [n + 1]
    std::vector<std::uint32_t> column{};     ///< [entries], patches, increasing in a row
    std::vector<double> value{};             ///< [entries]
    std::vector<float> error{};              ///< [entries] or empty, as FormFactorRow::errors
    std::vector<double> lost{};              ///< [n]
    std::vector<double> truncated{};         ///< [n]
    std::vector<double> escaped{};           ///< [n]
};

/// Answers "what does this point see?" for one fixed building and patch grid. The one thing that differs between
/// projection and ray casting; everything else in naturel is shared.
/// Every method is const and may be called from many threads at once; equal arguments give bitwise equal answers
/// whatever the number of threads. An implementation copies what it needs of building and grid.
class Visibility {
public:
    Visibility() = default;
    Visibility(const Visibility&) = delete;
    Visibility& operator=(const Visibility&) = delete;
    virtual ~Visibility() = default;

    /// Name used on the command line and written in result files.
    virtual std::string_view name() const noexcept = 0;

    /// Name and value of every option in force, for result files: enough to run it again.
    virtual std::vector<std::pair<std::string, std::string>> settings() const = 0;

    /// Form factors from one patch (of an indoor face or an aperture) to the patches it sees. Apertures are surfaces
    /// here: what falls on them is theirs.
    /// row: cleared, then filled with (patch, F_ij) in increasing patch order, each patch once; F_ii absent;
    /// dimensionless; sum of values + lost + truncated = 1, but for the errors of values that are computed and not counted.
    /// Sparse: memory and time follow what is seen, not the number of patches. Source: docs/method.md, "Form factors".
    virtual void form_factor_row(PatchId from, FormFactorRow& row) const = 0;

    /// form_factor_row() of the patches [0, count), in parallel. A method that computes each pair of patches once may answer
    /// for all rows together; its values are those of form_factor_row(), to the last bit.
    /// with_errors: keep the estimated errors, too. Throws Interrupted.
    virtual FormFactorRows form_factor_rows(std::size_t count, bool with_errors, Progress& progress) const;

    /// The same from a point: row.values[k] x exitance = illuminance at the point.
    virtual void gather_row(const GatherPoint& from, FormFactorRow& row) const = 0;

    /// First opaque facet met along each direction; FacetId::none means the sky or the ground.
    /// Apertures let light pass, so one answer serves sky light (none), reflected light (outdoor facet) and blocking
    /// (indoor facet). A facet hit from behind is reported like any other.
    /// directions: [n], unit length, in the half-space of from.normal; seen: [n], same order.
    virtual void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                            std::span<FacetId> seen) const = 0;

    /// Whether anything opaque stands in a direction: first_seen() where a yes or no is enough.
    /// directions: as for first_seen(); blocked: [n], 1 or 0.
    virtual void occluded(const GatherPoint& from, std::span<const glm::dvec3> directions,
                          std::span<std::uint8_t> blocked) const;

    /// What rows [row_begin, row_end) of a picture show: along the ray through the centre of each pixel, in what the cut planes
    /// leave of it, the first opaque facet that the view does not see through; apertures are transparent. FacetId::none where
    /// there is none and outside the circle of a fisheye.
    /// seen: [row_end - row_begin x width], from the top, in each row from the left. Pixel centres, rays and cuts: core/view.h.
    virtual void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const = 0;
};

}  // namespace naturel
