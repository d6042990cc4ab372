#include "core/glazing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/errors.h"
#include "core/gauss_legendre.h"
#include "core/units.h"

namespace naturel {
namespace {

/// Intervals of the table of the laws fresnel and table. It is uniform in the root of the cosine, because transmittance
/// bends hardest at grazing incidence. Linear interpolation is then within 1e-6 for up to 8 panes
/// (tests/core/glazing_test.cpp).
constexpr int table_intervals = 2048;

/// Transmittance of a fresnel glazing in one band, without maintenance and frame.
class FresnelBand {
public:
    FresnelBand(double normal_transmittance, int panes, double n)
        : panes_(panes), n_(n), pane_(internal_transmittance(normal_transmittance, panes, n)) {
        if (pane_ > 0.0) scale_ = normal_transmittance / multi_pane_transmittance(1.0, pane_, panes, n);
    }

    double transmittance(double cos_incidence) const {
        // A scaled lossless pile of six and more panes would let more than everything pass at its Brewster
        // angle.
        return std::min(1.0, scale_ * multi_pane_transmittance(cos_incidence, pane_, panes_, n_));
    }
    /// Of the panes, without the scale of a glazing that claims to be clearer than glass.
    double reflectance(double cos_incidence) const {
        return multi_pane_response(cos_incidence, pane_, panes_, n_).reflectance;
    }

private:
    int panes_;
    double n_;
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

/// A smooth curve through the samples of one band: piecewise cubic in the angle, level at normal incidence (the law
/// is even in the angle), and between two samples never outside their values.
/// Fritsch & Carlson 1980, slopes as in Fritsch & Butland 1984; docs/method.md eq. (Glazing 11).
class MonotoneCurve {
public:
    MonotoneCurve(const std::vector<AngularSample>& samples, double Band3::* band) {
        for (const AngularSample& sample : samples) {
            x_.push_back(sample.incidence_rad);
            y_.push_back(sample.transmittance.*band);
        }
        NATUREL_EXPECT(x_.size() >= 2);
        const std::size_t last = x_.size() - 1;
        slope_.assign(x_.size(), 0.0);
        for (std::size_t k = 1; k < last; ++k) {
            const double before = secant(k - 1), after = secant(k);
            if (before * after <= 0.0) continue;
            const double h0 = x_[k] - x_[k - 1], h1 = x_[k + 1] - x_[k];
            const double w0 = 2.0 * h1 + h0, w1 = h1 + 2.0 * h0;
            slope_[k] = (w0 + w1) / (w0 / before + w1 / after);
        }
        // Absorption flattens the end of the law: a parabola through the last samples is further from it than a line.
        slope_[last] = secant(last - 1);
    }

    double at(double x) const {
        const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
        const auto k = static_cast<std::size_t>(above - x_.begin()) - 1;
        const double h = x_[k + 1] - x_[k];
        const double t = std::clamp((x - x_[k]) / h, 0.0, 1.0);
        const double y = y_[k] + t * (h * slope_[k] + t * (3.0 * (y_[k + 1] - y_[k]) - h * (2.0 * slope_[k] + slope_[k + 1]) +
                                                 t * (2.0 * (y_[k] - y_[k + 1]) + h * (slope_[k] + slope_[k + 1]))));
        return std::clamp(y, std::min(y_[k], y_[k + 1]), std::max(y_[k], y_[k + 1]));  // rounding
    }

private:
    double secant(std::size_t k) const { return (y_[k + 1] - y_[k]) / (x_[k + 1] - x_[k]); }

    std::vector<double> x_, y_, slope_;
};

/// 2 x integral of f(c) c dc over [0, 1], in the root of the cosine: 4 f(t^2) t^3 dt.
template <class Function>
auto diffuse_mean(const Function& f) {
    static const QuadratureRule rule = gauss_legendre(64);
    decltype(f(1.0)) sum{};
    for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
        const double t = rule.nodes[k];
        sum += rule.weights[k] * 4.0 * t * t * t * f(t * t);
    }
    return sum;
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

PileResponse multi_pane_response(double cos_incidence, double internal_transmittance, int panes, double n) {
    NATUREL_EXPECT(panes >= 1);
    if (cos_incidence <= 0.0) return {0.0, 1.0};
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
        return PileResponse{T, R};
    };
    const PileResponse s = pile(slab.transmittance_s, slab.reflectance_s);
    const PileResponse p = pile(slab.transmittance_p, slab.reflectance_p);
    return {0.5 * (s.transmittance + p.transmittance), 0.5 * (s.reflectance + p.reflectance)};
}

double multi_pane_transmittance(double cos_incidence, double internal_transmittance, int panes, double n) {
    return multi_pane_response(cos_incidence, internal_transmittance, panes, n).transmittance;
}

double internal_transmittance(double normal_transmittance, int panes, double n) {
    if (normal_transmittance <= 0.0) return 0.0;
    if (normal_transmittance >= multi_pane_transmittance(1.0, 1.0, panes, n)) return 1.0;
    if (panes == 1) {
        // docs/method.md eq. (Glazing 4): the root of T r^2 tn^2 + (1 - r)^2 tn - T = 0, written without
        // cancellation.
        const double r = std::pow((n - 1.0) / (n + 1.0), 2.0);
        const double entering = (1.0 - r) * (1.0 - r);
        const double T = normal_transmittance;
        return 2.0 * T / (entering + std::sqrt(entering * entering + 4.0 * T * T * r * r));
    }
    double low = 0.0, high = 1.0;
    for (int bit = 0; bit < 53; ++bit) {  // as many as a double has
        const double middle = std::midpoint(low, high);
        const bool too_dark =
            multi_pane_transmittance(1.0, middle, panes, n) < normal_transmittance;
        (too_dark ? low : high) = middle;
    }
    return high;
}

GlazingTransmission::GlazingTransmission(const Glazing& glazing)
    : law_(glazing.angular_law), normal_(glazing.maintenance * glazing.frame * glazing.normal_transmittance) {
    const double kept = glazing.maintenance * glazing.frame;
    const auto tabulate = [&](const auto& band_at) {
        table_.reserve(table_intervals + 1);
        for (int k = 0; k <= table_intervals; ++k) {
            const double root = static_cast<double>(k) / table_intervals;
            table_.push_back(kept * band_at(root * root));
        }
    };
    if (law_ == AngularLaw::fresnel || law_ == AngularLaw::diffuse) {
        const Band3& normal = glazing.normal_transmittance;
        const auto band = [&](double T) { return FresnelBand(T, glazing.panes, glazing.refractive_index); };
        tabulate([r = band(normal.r), g = band(normal.g), b = band(normal.b)](double c) {
            return Band3{r.transmittance(c), g.transmittance(c), b.transmittance(c)};
        });
    } else if (law_ == AngularLaw::table) {
        const MonotoneCurve r(glazing.angular_table, &Band3::r), g(glazing.angular_table, &Band3::g),
            b(glazing.angular_table, &Band3::b);
        tabulate([&](double c) {
            const double angle = std::acos(c);
            return Band3{r.at(angle), g.at(angle), b.at(angle)};
        });
    }
    const bool one_value = law_ == AngularLaw::diffuse;
    if (one_value) law_ = AngularLaw::fresnel;
    diffuse_ = diffuse_mean([this](double c) { return transmittance(c); });
    if (one_value) {
        law_ = AngularLaw::constant;
        normal_ = diffuse_;
        table_.clear();
    }
}

Band3 GlazingTransmission::transmittance(double cos_incidence) const {
    const double c = std::clamp(cos_incidence, 0.0, 1.0);
    switch (law_) {
        case AngularLaw::fresnel:
        case AngularLaw::table:
            break;
        case AngularLaw::mitalas:
            return mitalas_arseneault(c) / mitalas_arseneault(1.0) * normal_;
        case AngularLaw::rivero:
            return rivero(c) * normal_;
        case AngularLaw::constant:
        case AngularLaw::diffuse:
            return normal_;
    }
    const double place = std::sqrt(c) * table_intervals;
    const auto before = static_cast<std::size_t>(std::min(place, table_intervals - 1.0));
    const double share = place - static_cast<double>(before);
    return (1.0 - share) * table_[before] + share * table_[before + 1];
}

Band3 pane_reflectance(const Glazing& glazing, const std::optional<Band3>& normal_reflectance) {
    const bool panes_known = glazing.angular_law != AngularLaw::constant && glazing.angular_law != AngularLaw::table;
    if (!panes_known && !normal_reflectance) return {};
    Glazing glass = glazing;  // the frame hides glass, dirt lies on its outside
    glass.frame = glass.maintenance = 1.0;
    const Band3 through = GlazingTransmission(glass).diffuse_transmittance();
    const auto band = [&](double Band3::* b) {
        const FresnelBand panes(glazing.normal_transmittance.*b, glazing.panes, glazing.refractive_index);
        double reflectance = diffuse_mean([&](double c) { return panes.reflectance(c); });
        if (normal_reflectance) reflectance *= (*normal_reflectance).*b / panes.reflectance(1.0);
        return glazing.frame * std::clamp(1.0 - through.*b, 0.0, reflectance);
    };
    return {band(&Band3::r), band(&Band3::g), band(&Band3::b)};
}

}  // namespace naturel
