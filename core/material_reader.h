#pragma once
#include <string>
#include <unordered_map>

#include "core/colour.h"
#include "core/scene.h"
#include "core/scene_values.h"
#include "core/side_files.h"

// The parts of a scene file that say what light does at surfaces and panes, and what colour it has.
namespace naturel {

/// The "materials" table by name.
struct MaterialNames {
    std::unordered_map<std::string, MaterialId> materials;
    std::unordered_map<std::string, GlazingId> glazings;
};

/// Fills scene.materials and scene.glazings ("unglazed" first). The primaries of the scene must have been read.
MaterialNames read_materials(const JsonValue& value, SideFiles& files, Scene& scene);

MaterialId read_material_name(const JsonValue& value, const MaterialNames& names);
GlazingId read_glazing_name(const JsonValue& value, const MaterialNames& names);

Ground read_ground(const JsonValue& value, const Primaries& primaries);
PrimariesDescription read_primaries(const JsonValue& value);

/// Colour of sky or sun: {"cct_k": ...} or {"xy": [x, y]}.
LightColour read_light_colour(const JsonValue& value, const Primaries& primaries);

}  // namespace naturel
