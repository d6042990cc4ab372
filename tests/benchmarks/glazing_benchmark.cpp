#include <benchmark/benchmark.h>

#include "core/glazing.h"
#include "core/units.h"

// The transmittance of a glazing is asked once per ray through an aperture: the inner loop of direct light.
namespace naturel {
namespace {

Glazing glazing_of(AngularLaw law) {
    Glazing glazing;
    glazing.angular_law = law;
    glazing.normal_transmittance = {0.7, 0.75, 0.72};
    glazing.panes = 2;
    if (law == AngularLaw::table)
        for (const double degrees : {0.0, 30.0, 60.0, 75.0, 90.0})
            glazing.angular_table.push_back({radians_from_degrees(degrees), grey(0.78 * (1.0 - degrees / 90.0))});
    return glazing;
}

void transmittance(benchmark::State& state, AngularLaw law) {
    const GlazingTransmission glazing(glazing_of(law));
    double c = 0.0;
    for (auto _ : state) {
        c += 0.618033988749895;  // cosines all over [0, 1], in no order a cache would like
        if (c > 1.0) c -= 1.0;
        benchmark::DoNotOptimize(glazing.transmittance(c));
    }
}

/// What the table stands for: the formula, one band.
void fresnel_formula(benchmark::State& state) {
    double c = 0.0;
    for (auto _ : state) {
        c += 0.618033988749895;
        if (c > 1.0) c -= 1.0;
        benchmark::DoNotOptimize(multi_pane_transmittance(c, 0.95, 2, window_glass_index));
    }
}

void prepare(benchmark::State& state) {
    for (auto _ : state)
        benchmark::DoNotOptimize(GlazingTransmission(glazing_of(AngularLaw::fresnel)));
}

BENCHMARK_CAPTURE(transmittance, fresnel, AngularLaw::fresnel);
BENCHMARK_CAPTURE(transmittance, table, AngularLaw::table);
BENCHMARK_CAPTURE(transmittance, mitalas, AngularLaw::mitalas);
BENCHMARK_CAPTURE(transmittance, rivero, AngularLaw::rivero);
BENCHMARK_CAPTURE(transmittance, constant, AngularLaw::constant);
BENCHMARK(fresnel_formula);
BENCHMARK(prepare);

}  // namespace
}  // namespace naturel
