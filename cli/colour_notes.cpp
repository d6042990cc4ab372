#include "cli/colour_notes.h"

#include <fmt/format.h>

#include "cli/choices.h"
#include "core/colour.h"

namespace naturel {
namespace {

std::string chromaticity_words(const Primaries& primaries, const LightColour& colour) {
    const glm::dvec3 xyY = xyY_from_xyz(primaries.xyz(colour.band));
    return fmt::format("x {:.4f}, y {:.4f}", xyY.x, xyY.y);
}

}  // namespace

std::vector<std::string> colour_notes(const Scene& scene) {
    std::vector<std::string> notes;
    const auto note = [&](const std::string& what, const Desaturation& desaturation) {
        if (desaturation.saturation_kept < 1.0)
            notes.push_back(fmt::format(
                "the primaries \"{}\" cannot show the colour of {}: it is drawn towards grey by {:.4f} in CIE "
                "x, y ({:.1f} % of its saturation kept)",
                name_of(primaries_names, scene.primaries.name), what, desaturation.chromaticity_shift,
                100.0 * desaturation.saturation_kept));
    };
    for (const Material& material : scene.materials)
        note(fmt::format("material \"{}\"", material.name), material.desaturation);
    for (const Glazing& glazing : scene.glazings)
        note(fmt::format("glazing \"{}\"", glazing.name), glazing.desaturation);
    note("the ground", scene.ground.desaturation);
    note("the sky", scene.sky.colour.desaturation);
    if (scene.sun) note("the sun", scene.sun->colour.desaturation);
    return notes;
}

std::string light_colour_note(const Scene& scene) {
    const LightColour sun = scene.sun ? scene.sun->colour : LightColour{};
    if (scene.sky.colour.band == grey(1.0) && sun.band == grey(1.0)) return "Sky and sun have the colour of D65.";
    const Primaries primaries(scene.primaries);
    const std::string sky_words = "The sky has the colour " + chromaticity_words(primaries, scene.sky.colour);
    if (!scene.sun) return sky_words + " (CIE 1931).";
    return sky_words + ", the sun " + chromaticity_words(primaries, sun) + " (CIE 1931).";
}

}  // namespace naturel
