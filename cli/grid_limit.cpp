#include "cli/grid_limit.h"

#include <fmt/format.h>

#include "core/errors.h"

namespace naturel {

void refuse_too_fine_grid(const Building& building, double spacing_m) {
    constexpr double most_patches = 1e7;
    double patches = 0.0;
    for (const Facet& facet : building.facets)
        if (facet.environment == Environment::indoor) patches += facet.area_m2 / (spacing_m * spacing_m);
    if (patches > most_patches)
        throw InputError("--grid-spacing",
                         fmt::format("{} m makes about {:.2g} patches indoors (at most {:.2g})", spacing_m,
                                     patches, most_patches));
}

}  // namespace naturel
