#pragma once
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/sky_description.h"
#include "core/sky_shape.h"

namespace naturel {

/// One line of the list of models. A new model is a file with a maker (core/sky_shape.h) and a line here.
struct SkyModelInfo {
    std::string_view name;  ///< in scene files, on the command line and in results
    SkyModel model;
    int cie_type;    ///< of cie_general
    bool needs_sun;  ///< its distribution depends on where the sun stands
    std::unique_ptr<SkyShape> (*make)(const SkyDescription&, const glm::dvec3& sun);
    std::string_view summary;  ///< for people
};

std::span<const SkyModelInfo> sky_models();
const SkyModelInfo& sky_model(const SkyDescription& description);
/// nullptr if there is none of that name.
const SkyModelInfo* find_sky_model(std::string_view name);
std::vector<std::string_view> sky_model_names();

}  // namespace naturel
