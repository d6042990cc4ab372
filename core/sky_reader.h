#pragma once
#include <optional>
#include <string>

#include "core/scene.h"

namespace naturel {

class Primaries;
class SceneObject;
class SideFiles;

/// What a scene says about the light outdoors: its keys "site", "sky" and "sun".
struct SkyAndSun {
    SkyDescription sky{};
    std::optional<SunDescription> sun{};
    double north_rad = 0.0;
};

/// root: an object with the key "sky", and perhaps "site" and "sun". files: where a table's file is looked for.
/// Throws InputError.
SkyAndSun read_sky_and_sun(const SceneObject& root, const Primaries& primaries, SideFiles& files);

/// The same for a JSON text that has these three keys alone; name: in messages. Files are looked for in the current folder.
SkyAndSun read_sky_and_sun_text(const std::string& text, const std::string& name);

}  // namespace naturel
