#pragma once
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/scene.h"

namespace naturel {

/// The camera of a view: where the ray of each pixel starts, where it goes, and what it does not stop at.
struct Camera {
    ViewKind kind = ViewKind::perspective;
    FisheyeProjection projection = FisheyeProjection::equidistant;
    glm::dvec3 eye_m{};
    glm::dvec3 right{}, up{}, forward{};     ///< orthonormal, right x up = -forward
    /// Of the picture. Perspective: at distance 1; parallel: in metres; fisheye: radii of its circle; panorama: without meaning.
    double half_width = 0, half_height = 0;
    double half_angle_rad = 0;               ///< fisheye: between the axis and the rim of the circle
    int width = 0, height = 0;               ///< pixels
    std::vector<CutPlane> cut_planes{};
    SeeThrough see_through = SeeThrough::nothing;

    struct Ray {
        glm::dvec3 origin_m{};
        glm::dvec3 direction{};  ///< unit length
    };
    /// Through a point of the picture, in pixels from the top left corner; centres end in .5. docs/pictures.md, "Kinds of views".
    Ray ray(double column, double row) const;

    /// False outside the circle of a fisheye, where a picture shows nothing.
    bool shows(double column, double row) const;

    struct Place {
        double column = 0, row = 0;
    };
    /// Where what lies in a direction from the eye is shown: the inverse of ray(). Empty outside the picture, and of parallel
    /// views, which see one direction only.
    std::optional<Place> place_of(const glm::dvec3& direction) const;

    /// The part of a ray that the cut planes leave: distances from its origin.
    struct Reach {
        double begin_m = 0, end_m = 0;
        bool cut = false;  ///< it begins at a cut plane
        bool empty() const { return !(begin_m < end_m); }
    };
    Reach reach(const Ray& ray) const;
};

Camera make_camera(const View& view);

/// The camera of a picture with `samples` x `samples` pixels in place of each.
Camera with_samples(Camera camera, int samples);

/// Solid angle of a pixel as seen from the eye; 0 for a parallel view. Of a fisheye: of the whole pixel, also at the rim.
double pixel_solid_angle_sr(const Camera& camera, int column, int row);

/// What lies on a cut plane stays: it counts as behind the plane up to this far in front of it. More than the rounding of single
/// precision, less than anything that is built.
inline constexpr double cut_slack_m = 1e-5;

/// Height over a cut plane; what is above 0 is removed.
double height_over(const CutPlane& plane, const glm::dvec3& point_m);

}  // namespace naturel
