#pragma once
#include <string>
#include <vector>

#include "core/scene.h"

namespace naturel {

/// A sentence for every colour of the scene that its primaries cannot show: what became of it, and by how much.
std::vector<std::string> colour_notes(const Scene& scene);

/// Whether sky or sun has another colour than D65, and which; for the assumptions of a run.
std::string light_colour_note(const Scene& scene);

}  // namespace naturel
