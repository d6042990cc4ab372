#pragma once
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "core/visibility.h"
#include "core/building.h"
#include "core/patch_grid.h"

namespace naturel::tests {

/// A visibility method under test, with the errors its own discretisation allows.
struct Backend {
    std::string name;
    std::function<std::unique_ptr<Visibility>(const Building&, const PatchGrid&)> make;
};

/// Every method built into this test program, at its default options (and the single plane).
std::vector<Backend> all_backends();

inline std::ostream& operator<<(std::ostream& out, const Backend& backend) { return out << backend.name; }

}  // namespace naturel::tests
