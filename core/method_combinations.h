#pragma once
#include <array>
#include <string_view>
#include <vector>

#include "core/colour.h"
#include "core/daylight.h"

namespace naturel {

/// Illuminance by component, luminous, lx; of the total, what the sky causes: the numerator of the daylight factor.
struct ComponentsAndTotal {
    static constexpr std::array<std::string_view, 6> names{"sky", "sun", "erc", "irc", "total", "from_sky"};
    static constexpr std::size_t total_index = 4, from_sky_index = 5;
    std::array<double, 6> lx{};

    double total() const { return lx[total_index]; }
    friend ComponentsAndTotal operator-(const ComponentsAndTotal& a, const ComponentsAndTotal& b) {
        ComponentsAndTotal difference;
        for (std::size_t k = 0; k < a.lx.size(); ++k) difference.lx[k] = a.lx[k] - b.lx[k];
        return difference;
    }
};

/// The light in a building as one combination of methods finds it.
struct LightState {
    std::vector<ComponentsAndTotal> sensors{};         ///< [sensors]; outdoors and in solids: zero
    std::vector<ComponentsAndTotal> nodes{};           ///< [grid.nodes]
    std::vector<double> patch_exitance_lm_m2{};  ///< [gather_patch_count], luminous
};

/// Solutions of one scene whose parts - form factors, direct light, what points gather - come from different methods. Each part is
/// computed once and serves every combination. Refers to its arguments: keep them alive.
class MethodCombinations {
public:
    MethodCombinations(const Scene& scene, const Building& building, const PatchGrid& grid, const RadiosityOptions& radiosity,
                       Progress& progress);

    const std::vector<Sensor>& sensors() const { return sensors_; }

    struct Direct {
        DirectSolution grid;
        std::vector<DirectIlluminance> sensors;  ///< [sensors]
    };
    /// Direct light by one rule and one way of seeing.
    Direct direct(const Visibility& visibility, const DirectOptions& rule) const;

    /// What points see of the patches: geometry alone.
    struct Gathering {
        std::vector<FormFactorRow> sensors;  ///< [sensors]
        std::vector<FormFactorRow> nodes;    ///< [grid.nodes]; empty if only sensors gather
    };
    Gathering gathering(const Visibility& visibility) const;
    Gathering gathering_at_sensors(const Visibility& visibility) const;

    /// indirect: at the nodes; sensors gather. repair: that of the form factors.
    DaylightSolution solution(const FormFactors& form_factors, const Direct& direct, const Gathering& gathering,
                              IndirectMethod indirect, FormFactorRepair repair) const;
    LightState state(const DaylightSolution& solution) const;
    LightState state(const FormFactors& form_factors, const Direct& direct, const Gathering& gathering, IndirectMethod indirect,
                     FormFactorRepair repair) const {
        return state(solution(form_factors, direct, gathering, indirect, repair));
    }

private:
    ComponentsAndTotal components(const PointIlluminance& point) const;

    const Scene& scene_;
    const Building& building_;
    const PatchGrid& grid_;
    RadiosityOptions radiosity_;
    Progress& progress_;
    Primaries primaries_;
    std::vector<Sensor> sensors_;
};

}  // namespace naturel
