#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/band3.h"
#include "core/chromaticity.h"
#include "core/ids.h"
#include "core/light_colour.h"
#include "core/picture_options.h"
#include "core/sky_description.h"

namespace naturel {

/// Where a finish or a facet faces: the air inside the building or the open air.
enum class Environment { indoor, outdoor };

/// An opaque, diffuse (Lambert) surface.
struct Material {
    std::string name{};
    Band3 reflectance = grey(0.5);  ///< 1, each band in [0, 0.99]
    Band3 exitance_lm_m2{};         ///< light the surface emits by itself, lm/m2
    Desaturation desaturation{};
};

/// How transmittance falls with the angle of incidence (docs/method.md, "Glazing").
enum class AngularLaw {
    fresnel,   ///< slab(s) of refractive index 1.52: the default
    mitalas,   ///< Mitalas-Arseneault polynomial for clear glass, scaled
    rivero,    ///< Rivero's formula, scaled
    constant,  ///< the same at every angle: unglazed openings
    diffuse,   ///< at every angle what the Fresnel law lets pass of diffuse light: the article's option
    table,     ///< Glazing::angular_table
};

/// A measured transmittance of a glazing.
struct AngularSample {
    double incidence_rad = 0.0;  ///< from the normal, [0, pi/2]
    Band3 transmittance{};       ///< of the whole unit, each band in [0, 1]
};

/// Refractive index of window glass in visible light; the one Radiance's material "glass" assumes.
inline constexpr double window_glass_index = 1.52;

/// What fills an aperture.
struct Glazing {
    std::string name{};
    Band3 normal_transmittance = grey(1.0);  ///< of the whole unit at normal incidence, each band in [0, 1]
    int panes = 1;                           ///< identical panes behind each other; shapes the Fresnel law
    AngularLaw angular_law = AngularLaw::fresnel;
    double refractive_index = window_glass_index;  ///< of the panes; Fresnel and diffuse law
    std::vector<AngularSample> angular_table{};    ///< from 0 to pi/2, angles increasing; law `table` only
    Band3 inner_reflectance{};                     ///< diffuse, seen from the room, each band in [0, 1]
    double maintenance = 1.0;                      ///< share of light left by dirt, [0, 1]
    double frame = 1.0;                            ///< glazed share of the opening, [0, 1]
    Desaturation desaturation{};                   ///< of the transmittance, when it was given as a spectrum
};

enum class PolyhedronKind { parallelepiped, prism, tetrahedron };
enum class Effect {
    fill,   ///< the space inside becomes solid
    carve,  ///< solid inside becomes indoor air; outdoor air stays outdoor air
};

/// What the file says about one face of a polyhedron; empty = as the whole polyhedron.
struct FaceFinish {
    std::optional<MaterialId> material{};
    std::optional<GlazingId> glazing{};
};

/// vertices_m: an origin O and the ends A, B, C of its three edges. A prism's base is the triangle O, A, B and OC
/// extrudes it. Faces are numbered as in polyhedron_faces() (core/polyhedra.h).
struct Polyhedron {
    std::string id{};
    PolyhedronKind kind = PolyhedronKind::parallelepiped;
    Effect effect = Effect::fill;
    std::array<glm::dvec3, 4> vertices_m{};
    MaterialId material{};
    std::optional<GlazingId> glazing{};  ///< of apertures this polyhedron opens; unglazed if empty
    std::array<FaceFinish, 6> faces{};
};

/// A plane surface without thickness, e.g. from an imported model. Counter-clockwise seen from its lit side.
/// Its back is opaque and black unless two_sided.
struct SurfacePolygon {
    std::string id{};
    std::vector<glm::dvec3> vertices_m{};            ///< at least 3, plane, simple
    std::vector<std::vector<glm::dvec3>> holes_m{};  ///< each at least 3, in the same plane
    MaterialId material{};
    Environment side = Environment::indoor;
    bool two_sided = false;
};

/// An opening given as a polygon. Counter-clockwise seen from indoors. It is cut out of coplanar SurfacePolygons.
struct AperturePolygon {
    std::string id{};
    std::vector<glm::dvec3> vertices_m{};
    std::vector<std::vector<glm::dvec3>> holes_m{};
    GlazingId glazing{};
};

/// The ground outdoors: an infinite, diffuse, horizontal plane.
struct Ground {
    double z_m = 0.0;
    Band3 reflectance = grey(0.2);
    Desaturation desaturation{};
    bool shadows = false;  ///< buildings shade the ground around them, and light it
};

/// How light goes on between ground and buildings.
struct OutdoorOptions {
    int interreflections = 0;  ///< passes after the first reflection
};

/// The sun in the frame of the model (site north already applied by the reader).
struct SunDescription {
    double altitude_rad = 0.0;  ///< from the horizon up
    double azimuth_rad = 0.0;   ///< from the model's +y axis, clockwise seen from above
    double direct_normal_illuminance_lx = 0.0;  ///< as given; without effect at or below the horizon
    LightColour colour{};
};

/// Finer cells where light changes fast. Judged by geometry alone, so that the grid is the same for every visibility method.
struct GridRefinement {
    int levels = 0;         ///< how often a cell may be divided in four; 0: never
    double contrast = 0.5;  ///< divide where what corners get from unobstructed apertures differs by more than this share
};

struct GridOptions {
    double spacing_m = 0.25;          ///< indoor faces and apertures: cells no longer than this
    double outdoor_spacing_m = 1.0;  ///< outdoor faces, which only carry reflected light
    bool zones = true;               ///< cells are cut along sunspots and umbra zones
    /// Patches below this share of a cell, or longer than this for their width, are joined with a neighbour of the same zone
    /// where the result is convex.
    double sliver_area = 0.1;
    double sliver_aspect = 10.0;
    GridRefinement refine{};  ///< indoor faces only
};

enum class DirectMethod {
    article,   ///< 16, 64 or 256 aperture elements, 256 sky zones close to the aperture
    adaptive,  ///< aperture elements subdivided to a tolerance
};

/// Parts of the article's rule that a study of errors may leave out.
struct ArticleRule {
    bool count_by_solid_angle = true;  ///< 16, 64 or 256 aperture elements; else always 256
    bool near_zones = true;            ///< 256 sky zones close to an aperture
};

struct DirectOptions {
    DirectMethod method = DirectMethod::adaptive;
    double tolerance = 1e-3;  ///< adaptive: relative error aimed at for sky and outdoor light of a point
    ArticleRule article{};
};

struct SensorPoint {
    glm::dvec3 position_m{};
    glm::dvec3 normal{0, 0, 1};  ///< unit length
};

/// A horizontal grid laid over all indoor air at one height.
struct SensorGrid {
    double z_m = 0.85;
    double spacing_m = 0.5;
    double margin_m = 0.5;  ///< points keep this distance from walls
};

struct SensorSet {
    std::string id{};
    std::optional<SensorGrid> grid{};
    std::vector<SensorPoint> points{};  ///< used when there is no grid
};

enum class ViewKind {
    perspective,  ///< rays leave one eye
    parallel,     ///< rays leave a rectangle, all in one direction; what lies behind its plane is not seen
    fisheye,      ///< all around an axis, in a circle
    panorama,     ///< everything around the eye: azimuth across, altitude upwards, both in equal steps
};

/// Where a fisheye shows what lies at an angle from its axis: at a radius that grows with ...
enum class FisheyeProjection {
    equidistant,  ///< the angle
    equal_area,   ///< the sine of half the angle: equal areas are equal solid angles
};

/// Takes away from a view what lies in front of it.
struct CutPlane {
    glm::dvec3 point_m{};
    glm::dvec3 normal{0, 0, 1};  ///< unit length, to the side that is removed
};

/// What rays of a view pass through.
enum class SeeThrough {
    nothing,
    backs,  ///< surfaces that turn their backs on the viewer
    walls,  ///< those and all outdoor surfaces: from outside one looks into the rooms
};

/// Where the light on indoor surfaces in a picture comes from.
enum class PictureQuality {
    interpolated,  ///< the nodes of the grid
    gather,        ///< computed at each pixel, from the patches: right near contacts and in corners, and slow
};

struct View {
    std::string id{};
    ViewKind kind = ViewKind::perspective;
    FisheyeProjection projection = FisheyeProjection::equidistant;
    glm::dvec3 from_m{};  ///< the eye, or the middle of the rectangle
    glm::dvec3 to_m{0, 1, 0};
    glm::dvec3 up{0, 0, 1};
    double field_of_view_rad = 1.2;  ///< perspective: horizontal, < pi; fisheye: across the circle, at most pi
    double width_m = 10.0;           ///< of the rectangle; parallel only
    int width = 1280;                ///< pixels
    int height = 960;                ///< pixels
    std::vector<CutPlane> cut_planes{};
    SeeThrough see_through = SeeThrough::nothing;
    int samples = 4;                 ///< along each side of a pixel
    PictureQuality quality = PictureQuality::interpolated;
    PictureOptions picture{};
};

/// Which three-band basis the scene's bands are (core/colour.h).
enum class PrimariesName { srgb, ebu, p22, smpte_c, trinitron_p22, custom };

struct PrimariesDescription {
    PrimariesName name = PrimariesName::ebu;
    std::array<Chromaticity, 3> custom{};  ///< red, green, blue; only of `custom`
};

/// Everything a scene file says, checked and in SI units and radians. Built by read_scene().
/// glazings[0] is always "unglazed" (transmittance 1).
struct Scene {
    std::string name{};
    double north_rad = 0.0;  ///< azimuth of the model's +y axis
    std::vector<Material> materials{};
    std::vector<Glazing> glazings{};
    Ground ground{};
    OutdoorOptions outdoors{};
    std::vector<Polyhedron> polyhedra{};  ///< in the order they are applied
    std::vector<SurfacePolygon> polygons{};
    std::vector<AperturePolygon> apertures{};
    SkyDescription sky{};
    std::optional<SunDescription> sun{};
    GridOptions grid{};
    DirectOptions direct{};
    PrimariesDescription primaries{};
    std::vector<SensorSet> sensors{};
    PictureOptions picture{};  ///< of views that do not say otherwise
    std::vector<View> views{};
    std::string source_sha256{};  ///< of the file's bytes, hex; identifies the input in results
};

}  // namespace naturel
