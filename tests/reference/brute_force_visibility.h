#pragma once
#include "core/building.h"
#include "core/visibility.h"

namespace naturel::tests {

/// first_seen() by intersecting every ray with every facet, in double precision: slow and exact. It answers nothing
/// else.
class BruteForceVisibility final : public Visibility {
public:
    explicit BruteForceVisibility(const Building& building) : facets_(building.facets) {}

    std::string_view name() const noexcept override { return "brute force"; }
    std::vector<std::pair<std::string, std::string>> settings() const override { return {}; }
    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override;

    /// These throw std::logic_error.
    void form_factor_row(PatchId from, FormFactorRow& row) const override;
    void gather_row(const GatherPoint& from, FormFactorRow& row) const override;
    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override;

private:
    std::vector<Facet> facets_;
};

}  // namespace naturel::tests
