#include "core/glazing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/errors.h"
#include "core/gauss_legendre.h"
#include "core/units.h"

namespace naturel {
namespace {

/// Refractive index of window glass in visible light; the one Radiance's material "glass" assumes.
constexpr double glass_index = 1.52;

/// Intervals of the table of the Fresnel law. It is uniform in the root of the cosine, because transmittance
/// bends hardest at grazing incidence. Linear interpolation is then within 1e-6 for up to 8 panes
/// (tests/core/glazing_test.cpp).
constexpr int table_intervals = 2048;

/// What one pane must let survive between its faces so that the unit has this transmittance at normal
/// incidence. In [0, 1]; 1 also where even glass without absorption would transmit less, docs/method.md eq.
/// (Glazing 5).
double pane_internal_transmittance(double normal_transmittance, int panes) {
    if (normal_transmittance >= multi_pane_transmittance(1.0, 1.0, panes, glass_index)) return 1.0;
    if (panes == 1) {
        // docs/method.md eq. (Glazing 4): the root of T r^2 tn^2 + (1 - r)^2 tn - T = 0, written without
        // cancellation.
        const double r = std::pow((glass_index - 1.0) / (glass_index + 1.0), 2.0);
        const double entering = (1.0 - r) * (1.0 - r);
        const double T = normal_transmittance;
        return 2.0 * T / (entering + std::sqrt(entering * entering + 4.0 * T * T * r * r));
    }
    double low = 0.0, high = 1.0;
    for (int bit = 0; bit < 53; ++bit) {  // as many as a double has
        const double middle = std::midpoint(low, high);
        const bool too_dark =
            multi_pane_transmittance(1.0, middle, panes, glass_index) < normal_transmittance;
        (too_dark ? low : high) = middle;
    }
    return high;
}

/// Transmittance of a fresnel glazing in one band, without maintenance and frame.
class FresnelBand {
public:
    FresnelBand(double normal_transmittance, int panes)
        : panes_(panes),
          pane_(normal_transmittance > 0.0 ? pane_internal_transmittance(normal_transmittance, panes) : 0.0) {
        if (pane_ > 0.0)
            scale_ = normal_transmittance / multi_pane_transmittance(1.0, pane_, panes, glass_index);
    }

    double transmittance(double cos_incidence) const {
        // A scaled lossless pile of six and more panes would let more than everything pass at its Brewster
        // angle.
        return std::min(1.0, scale_ * multi_pane_transmittance(cos_incidence, pane_, panes_, glass_index));
    }

private:
    int panes_;
    double pane_;         // internal transmittance of one pane
    double scale_ = 0.0;  // 1 but for rounding, unless the glazing transmits more than lossless glass
};

/// Transmittance of clear glass, docs/method.md eq. (Glazing 7); 0.87881 at normal incidence. The fit falls
/// below 0 when closer than 0.52 degrees to grazing: 0 there.
double mitalas_arseneault(double c) {
    return std::max(
        0.0, -0.028378 + c * (3.156075 + c * (-3.058376 + c * (-1.428919 + c * (4.014235 - c * 1.775827)))));
}

/// Relative to normal incidence, docs/method.md eq. (Glazing 8).
double rivero(double c) {
    const double sin_squared = 1.0 - c * c;
    return c * (1.0 + sin_squared * std::sqrt(std::max(0.0, sin_squared)));
}

}  // namespace

SlabResponse slab_response(double cos_incidence, double internal_transmittance, double n) {
    if (cos_incidence <= 0.0) return {0.0, 0.0, 1.0, 1.0};
    const double c = cos_incidence;
    const double ct = std::sqrt(1.0 - (1.0 - c * c) / (n * n));  // cosine inside the glass
    const double tau = std::pow(internal_transmittance, 1.0 / ct);

    // One face reflects r = ((a - b) / (a + b))^2 and lets 1 - r = 4 a b / (a + b)^2 enter; docs/method.md
    // eqs. (Glazing 1) and (Glazing 2). 1 - r is computed directly: at grazing incidence r is nearly 1.
    const auto polarised = [&](double a, double b, double& transmittance, double& reflectance) {
        const double r = (a - b) * (a - b) / ((a + b) * (a + b));
        const double entering = 4.0 * a * b / ((a + b) * (a + b));
        transmittance = entering * entering * tau / ((1.0 - tau + tau * entering) * (1.0 + tau * r));
        reflectance = r * (1.0 + tau * transmittance);
    };
    SlabResponse slab;
    polarised(c, n * ct, slab.transmittance_s, slab.reflectance_s);
    polarised(n * c, ct, slab.transmittance_p, slab.reflectance_p);
    return slab;
}

double multi_pane_transmittance(double cos_incidence, double internal_transmittance, int panes, double n) {
    NATUREL_EXPECT(panes >= 1);
    if (cos_incidence <= 0.0) return 0.0;
    const SlabResponse slab = slab_response(cos_incidence, internal_transmittance, n);
    const auto pile = [panes](double t, double r) {
        double T = t, R = r;
        for (int pane = 1; pane < panes; ++pane) {
            // docs/method.md eq. (Glazing 3). 1 - R r is no less than what pile or pane transmit; saying so
            // keeps rounding harmless at grazing incidence, where both sides go to 0.
            const double not_returned = std::max({1.0 - R * r, T, t});
            R += T * T * r / not_returned;
            T *= t / not_returned;
        }
        return T;
    };
    return 0.5 *
           (pile(slab.transmittance_s, slab.reflectance_s) + pile(slab.transmittance_p, slab.reflectance_p));
}

GlazingTransmission::GlazingTransmission(const Glazing& glazing)
    : law_(glazing.angular_law), normal_(glazing.maintenance * glazing.frame * glazing.normal_transmittance) {
    if (law_ == AngularLaw::fresnel) {
        const Band3& normal = glazing.normal_transmittance;
        const FresnelBand r(normal.r, glazing.panes), g(normal.g, glazing.panes), b(normal.b, glazing.panes);
        table_.reserve(table_intervals + 1);
        for (int k = 0; k <= table_intervals; ++k) {
            const double root = static_cast<double>(k) / table_intervals;
            const double c = root * root;
            table_.push_back(glazing.maintenance * glazing.frame *
                             Band3{r.transmittance(c), g.transmittance(c), b.transmittance(c)});
        }
    }
    // In the root of the cosine as well: 2 T(c) c dc = 4 T(t^2) t^3 dt.
    const QuadratureRule rule = gauss_legendre(64);
    for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
        const double t = rule.nodes[k];
        diffuse_ += rule.weights[k] * 4.0 * t * t * t * transmittance(t * t);
    }
}

Band3 GlazingTransmission::transmittance(double cos_incidence) const {
    const double c = std::clamp(cos_incidence, 0.0, 1.0);
    switch (law_) {
        case AngularLaw::fresnel:
            break;
        case AngularLaw::mitalas:
            return mitalas_arseneault(c) / mitalas_arseneault(1.0) * normal_;
        case AngularLaw::rivero:
            return rivero(c) * normal_;
        case AngularLaw::constant:
            return normal_;
    }
    const double place = std::sqrt(c) * table_intervals;
    const auto before = static_cast<std::size_t>(std::min(place, table_intervals - 1.0));
    const double share = place - static_cast<double>(before);
    return (1.0 - share) * table_[before] + share * table_[before + 1];
}

}  // namespace naturel
