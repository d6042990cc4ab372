#pragma once
#include <memory>
#include <span>
#include <vector>

#include "core/daylight.h"

namespace naturel {

/// Daylight on the sensors of one building under many skies: everything that geometry alone decides is done once, and each
/// further sky costs milliseconds (docs/method.md, "Series of skies").
///
/// Variants of the scene may differ from the one given here in
///   - the sky, and the sun (where it is, how strong, whether there is any);
///   - the numbers of materials (reflectance, exitance) and glazings, the reflectance of the ground;
///   - the number of outdoor interreflections.
/// What must be equal: polyhedra, polygons, apertures, height and shadows of the ground, grid, direct options, sensors, and the
/// order of materials and glazings, which faces refer to by number. What is worked out for one set of reflectances and
/// glazings is kept for later variants with the same set.
///
/// A grid that serves every sun cannot be cut along the sunspots of one: make it with find_light_zones(scene, building, nullptr),
/// or without zones. Sunspots are exact all the same; a patch gets the mean of the light of its lit part.
///
/// Direct light is always adaptive, to the tolerance of the scene given here.
///
/// The answer to a variant has the same bits whichever variants are solved with it, before or after it, and on any number of
/// threads. Refers to its arguments but for the sensors: keep them alive.
class SkySeries {
public:
    /// form_factors: of this grid and visibility, repaired as options.form_factors says. Throws Interrupted.
    SkySeries(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
              const FormFactors& form_factors, std::vector<Sensor> sensors, const DaylightOptions& options, Progress& progress);
    ~SkySeries();

    /// [variants], as compute_daylight() would answer with these sensors, but without what belongs to nodes and patches:
    /// `nodes`, `patch_*`, `stage_seconds`, the fields [patch] of `outdoors` and `radiosity` are empty. In parallel; call it with
    /// many variants at a time. Throws Interrupted.
    std::vector<DaylightSolution> solve(std::span<const Scene> variants, Progress& progress);

    /// The same for sets with few variants, where it does not pay to find out what each sensor owes to each patch: their
    /// interreflection is solved forwards, variant by variant. Both ways stop at the tolerance of the radiosity.
    /// alike: [variants], how many variants with the same set there are in all. It decides, so that the bits of an answer depend on it.
    std::vector<DaylightSolution> solve(std::span<const Scene> variants, std::span<const std::size_t> alike, Progress& progress);

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// What a series costs beside its form factors, at most.
struct SkySeriesCost {
    double bytes = 0.0;
    // CPU time, as measured in docs/batch.md.
    double set_seconds = 0.0;      ///< of each set of reflectances and glazings
    double variant_seconds = 0.0;  ///< of each variant, beside what all take
};
/// sets: how many among the variants. alike: variants of a set. entries: of the form factors.
SkySeriesCost sky_series_cost(const Scene& scene, const PatchGrid& grid, std::size_t sensors, std::size_t sets, std::size_t alike,
                              double entries);

}  // namespace naturel
