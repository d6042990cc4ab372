#pragma once
#include <array>
#include <string_view>

#include "cli/options.h"
#include "core/daylight.h"
#include "core/scene.h"
#include "embree_backend/embree_visibility.h"
#include "hemicube_backend/hemicube_visibility.h"

namespace naturel {

/// The word for a value of an enumeration, on the command line and in result files.
template <class Enum>
struct Choice {
    Enum value;
    std::string_view name;
};

inline constexpr std::array indirect_methods{
    Choice{IndirectMethod::patch, "patch"},
    Choice{IndirectMethod::gather, "gather"},
};
inline constexpr std::array form_factor_methods{
    Choice{FormFactorMethod::hemisphere, "hemisphere"},
    Choice{FormFactorMethod::pairwise, "pairwise"},
};
inline constexpr std::array form_factor_repairs{
    Choice{FormFactorRepair::none, "none"},
    Choice{FormFactorRepair::renormalise, "renormalise"},
    Choice{FormFactorRepair::reciprocal, "reciprocal"},
};
inline constexpr std::array projection_surfaces{
    Choice{ProjectionSurface::hemicube, "hemicube"},
    Choice{ProjectionSurface::single_plane, "single_plane"},
};
inline constexpr std::array cell_spacings{
    Choice{CellSpacing::equal_solid_angle, "equal_solid_angle"},
    Choice{CellSpacing::equal_form_factor, "equal_form_factor"},
    Choice{CellSpacing::equal_plane_angle, "equal_plane_angle"},
    Choice{CellSpacing::uniform, "uniform"},
};
inline constexpr std::array rim_shares{
    Choice{RimShare::left_out, "left_out"},
    Choice{RimShare::renormalised, "renormalised"},
    Choice{RimShare::strip, "strip"},
};
inline constexpr std::array direct_methods{
    Choice{DirectMethod::article, "article"},
    Choice{DirectMethod::adaptive, "adaptive"},
};
inline constexpr std::array primaries_names{
    Choice{PrimariesName::srgb, "srgb"},
    Choice{PrimariesName::ebu, "ebu"},
    Choice{PrimariesName::p22, "p22"},
    Choice{PrimariesName::smpte_c, "smpte_c"},
    Choice{PrimariesName::trinitron_p22, "trinitron_p22"},
    Choice{PrimariesName::custom, "custom"},
};

inline constexpr std::array tone_mappings{
    Choice{ToneMapping::linear, "linear"},
    Choice{ToneMapping::reinhard, "reinhard"},
};
inline constexpr std::array white_points{
    Choice{WhitePoint::d65, "d65"},
    Choice{WhitePoint::sky, "sky"},
};
inline constexpr std::array exposure_modes{
    Choice{ExposureMode::automatic, "auto"},
    Choice{ExposureMode::white, "white"},
    Choice{ExposureMode::ev100, "ev100"},
    Choice{ExposureMode::percentile, "percentile"},
};

inline constexpr std::array false_colour_quantities{
    Choice{FalseColourQuantity::none, "none"},
    Choice{FalseColourQuantity::luminance, "luminance"},
    Choice{FalseColourQuantity::illuminance, "illuminance"},
    Choice{FalseColourQuantity::daylight_factor, "daylight_factor"},
};
inline constexpr std::array view_kinds{
    Choice{ViewKind::perspective, "perspective"},
    Choice{ViewKind::parallel, "parallel"},
    Choice{ViewKind::fisheye, "fisheye"},
    Choice{ViewKind::panorama, "panorama"},
};
inline constexpr std::array fisheye_projections{
    Choice{FisheyeProjection::equidistant, "equidistant"},
    Choice{FisheyeProjection::equal_area, "equal_area"},
};
inline constexpr std::array image_formats{
    Choice{ImageFormat::exr, "exr"},
    Choice{ImageFormat::png, "png"},
    Choice{ImageFormat::hdr, "hdr"},
};
inline constexpr std::array colour_scale_kinds{
    Choice{ColourScaleKind::linear, "linear"},
    Choice{ColourScaleKind::logarithmic, "logarithmic"},
};

inline constexpr std::array job_scripts{
    Choice{JobScript::slurm, "slurm"},
    Choice{JobScript::parallel, "parallel"},
};
inline constexpr std::array progress_forms{
    Choice{ProgressForm::text, "text"},
    Choice{ProgressForm::json, "json"},
};

/// The word for `value`, which must be among the choices.
template <class Enum, std::size_t count>
constexpr std::string_view name_of(const std::array<Choice<Enum>, count>& choices, Enum value) {
    for (const Choice<Enum>& choice : choices)
        if (choice.value == value) return choice.name;
    return {};
}

}  // namespace naturel
