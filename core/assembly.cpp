#include <algorithm>
#include <ranges>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <span>

#include "core/building.h"
#include "core/polyhedra.h"

// How it works (docs/method.md, "Assembly"). A boundary between solid and air can only lie in the plane of some face. So
// for every plane that carries faces we ask, in two dimensions, what is made of solid, indoor air and outdoor air just in
// front of the plane and just behind it: each polyhedron meets the plane in a convex polygon, and the polygons act in file
// order like the polyhedra do. Where the answers differ there is a facet or an aperture. Coincident faces need no special
// care: they share a plane, and differ in which side of it they cover.

namespace naturel {

namespace {

using glm::dvec3;

// Faces closer than this to a common plane are coincident: scene files are written with a few decimals.
constexpr double coincidence_m = 1e-6;

enum class Side { front, back };  // of a plane, as its normal points

Region polygon_region(const PlaneFrame& plane, const std::vector<dvec3>& vertices_m) {
    Ring ring;
    for (const dvec3& v : vertices_m) ring.push_back(plane.to_plane(v));
    if (!ClipperLib::Orientation(ring)) ClipperLib::ReversePath(ring);
    return {ring};
}

struct Bounds {
    double left = std::numeric_limits<double>::max(), right = std::numeric_limits<double>::lowest();
    double bottom = left, top = right;

    void add(const PlanePoint& p) {
        left = std::min(left, static_cast<double>(p.X)), right = std::max(right, static_cast<double>(p.X));
        bottom = std::min(bottom, static_cast<double>(p.Y)), top = std::max(top, static_cast<double>(p.Y));
    }
    void add(const Ring& ring) {
        for (const PlanePoint& p : ring) add(p);
    }
    bool overlaps(const Bounds& o) const {
        return left <= o.right && o.left <= right && bottom <= o.top && o.bottom <= top;
    }
};

Bounds bounds_of(const Region& region) {
    Bounds bounds;
    for (const Ring& ring : region) bounds.add(ring);
    return bounds;
}

// A polyhedron with what every section of it needs.
struct Solid {
    const Polyhedron* polyhedron = nullptr;
    std::vector<PolyhedronFace> faces;
    std::vector<dvec3> vertices_m;
    std::vector<std::array<std::size_t, 2>> edges;
    dvec3 centre_m{};
    double radius_m = 0.0;
};

Solid make_solid(const Polyhedron& polyhedron) {
    Solid solid{.polyhedron = &polyhedron, .faces = polyhedron_faces(polyhedron), .vertices_m = {}, .edges = {}};
    const auto vertex_number = [&](const dvec3& v) {
        // Corners of two faces are the same sum of the same edges up to rounding.
        for (std::size_t i = 0; i < solid.vertices_m.size(); ++i)
            if (glm::distance(solid.vertices_m[i], v) < coincidence_m / 100.0) return i;
        solid.vertices_m.push_back(v);
        return solid.vertices_m.size() - 1;
    };
    std::set<std::array<std::size_t, 2>> edges;
    for (const PolyhedronFace& face : solid.faces) {
        for (std::size_t i = 0; i < face.vertices_m.size(); ++i) {
            const std::size_t a = vertex_number(face.vertices_m[i]);
            const std::size_t b = vertex_number(face.vertices_m[(i + 1) % face.vertices_m.size()]);
            edges.insert({std::min(a, b), std::max(a, b)});
        }
    }
    solid.edges.assign(edges.begin(), edges.end());
    for (const dvec3& v : solid.vertices_m) solid.centre_m += v / static_cast<double>(solid.vertices_m.size());
    for (const dvec3& v : solid.vertices_m) solid.radius_m = std::max(solid.radius_m, glm::distance(v, solid.centre_m));
    return solid;
}

// The polygons in which a polyhedron meets the two sides of a plane; empty where it does not.
struct Section {
    Ring front, back;
};

Section section(const Solid& solid, const PlaneFrame& plane) {
    if (std::abs(glm::dot(solid.centre_m - plane.origin_m, plane.normal)) > solid.radius_m + coincidence_m) return {};
    std::array<double, 8> height_m{};
    bool above = false, below = false;
    Ring corners;
    for (std::size_t i = 0; i < solid.vertices_m.size(); ++i) {
        double& h = height_m[i];
        h = glm::dot(solid.vertices_m[i] - plane.origin_m, plane.normal);
        if (std::abs(h) < coincidence_m) {
            h = 0.0;
            corners.push_back(plane.to_plane(solid.vertices_m[i]));
        }
        above = above || h > 0.0;
        below = below || h < 0.0;
    }
    for (const auto& [a, b] : solid.edges) {
        if (height_m[a] * height_m[b] >= 0.0) continue;
        const double t = height_m[a] / (height_m[a] - height_m[b]);
        corners.push_back(plane.to_plane(solid.vertices_m[a] + t * (solid.vertices_m[b] - solid.vertices_m[a])));
    }
    const Ring outline = convex_hull(std::move(corners));
    return {above ? outline : Ring{}, below ? outline : Ring{}};
}

// What one side of a plane is made of, inside some region of it.
struct Layers {
    Region solid;   // filled by a polyhedron
    Region ground;  // solid because it lies below the ground plane
    Region indoor;
    Region outdoor;
};

// A polyhedron's polygon on one side of a plane, in file order.
struct Action {
    Effect effect;
    Ring outline;
    Bounds bounds;
    std::size_t polyhedron;
};

// The part of `region` (in `plane`) that has solid ground on `side` before any polyhedron acts.
Region below_ground(const Region& region, const PlaneFrame& plane, Side side, double ground_z_m) {
    if (region.empty()) return {};
    const double height_m = plane.origin_m.z - ground_z_m;
    const double slope = std::hypot(plane.x.z, plane.y.z);
    const Bounds bounds = bounds_of(region);
    const double extent_m = (bounds.right - bounds.left + bounds.top - bounds.bottom) / nanometres_per_metre;
    if (slope * extent_m < coincidence_m) {
        // Horizontal: height of the plane over the ground is the same everywhere.
        const double side_sign = (side == Side::front ? 1.0 : -1.0) * plane.normal.z;
        const bool is_below = std::abs(height_m) < coincidence_m ? side_sign < 0.0 : height_m < 0.0;
        return is_below ? region : Region{};
    }
    // The half-plane z < ground in plane coordinates: gradient.x X + gradient.y Y < -height.
    const double gx = plane.x.z / slope, gy = plane.y.z / slope;
    const double cx = (bounds.left + bounds.right) / 2.0, cy = (bounds.bottom + bounds.top) / 2.0;
    const double offset = -height_m * nanometres_per_metre / slope - (gx * cx + gy * cy);
    const double reach = 2.0 * extent_m * nanometres_per_metre;
    const double upper = std::clamp(offset, -reach, reach);
    const auto at = [&](double along_gradient, double across) {
        return PlanePoint(std::llround(cx + along_gradient * gx - across * gy),
                          std::llround(cy + along_gradient * gy + across * gx));
    };
    Ring half{at(upper, -reach), at(upper, reach), at(-2.0 * reach, reach), at(-2.0 * reach, -reach)};
    if (!ClipperLib::Orientation(half)) ClipperLib::ReversePath(half);
    return intersect(region, {half});
}

// Moves the part of `from` that lies in one of `outlines` to `to`.
void move_part(Region& from, const Region& outlines, Region& to) {
    if (from.empty()) return;
    Region part = intersect(from, outlines);
    if (part.empty()) return;
    from = subtract(from, outlines);
    to.insert(to.end(), part.begin(), part.end());
}

// The last polyhedron that acts on a point decides, so we go backwards: what a `fill` covers is settled at once, what a
// `carve` covers is air, indoors or outdoors as what lies under it is solid or open.
Layers layers(const Region& domain, const std::vector<Action>& actions, const PlaneFrame& plane, Side side,
              double ground_z_m) {
    Layers result;
    Region open = domain;  // not yet decided
    Region carved;         // air, kind not yet decided
    const Bounds bounds = bounds_of(domain);
    for (auto action = actions.rbegin(); action != actions.rend() && !(open.empty() && carved.empty());) {
        // Neighbours in the order that do the same act together: thousands of boxes on a floor would each cut all of it.
        const Effect effect = action->effect;
        Region outlines;
        for (; action != actions.rend() && action->effect == effect; ++action)
            if (action->bounds.overlaps(bounds)) outlines.push_back(action->outline);
        if (outlines.empty()) continue;
        if (effect == Effect::fill) {
            move_part(open, outlines, result.solid);
            move_part(carved, outlines, result.indoor);
        } else {
            move_part(open, outlines, carved);
        }
    }
    const Region underground = below_ground(domain, plane, side, ground_z_m);
    result.ground = intersect(open, underground);
    result.outdoor = unite(subtract(open, underground), subtract(carved, underground));
    result.indoor = unite(result.indoor, intersect(carved, underground));
    result.solid = unite(result.solid, {});
    return result;
}

// A face of a polyhedron that lies in a plane.
struct PlaneMember {
    std::size_t polyhedron = 0;
    std::size_t face = 0;
    Region outline{};
    Bounds bounds{};
    bool claims = true;  // false: only widens the search (ground plane), makes no facets
};

struct PlaneGroup {
    PlaneFrame plane;
    std::vector<std::pair<std::size_t, std::size_t>> faces;  // (polyhedron, face)
};

std::vector<PlaneGroup> group_by_plane(const std::vector<Solid>& solids) {
    std::vector<PlaneGroup> groups;
    const auto lies_in = [](const PlaneFrame& plane, const PolyhedronFace& face) {
        return std::all_of(face.vertices_m.begin(), face.vertices_m.end(), [&](const dvec3& v) {
            return std::abs(glm::dot(v - plane.origin_m, plane.normal)) < coincidence_m;
        });
    };
    for (std::size_t p = 0; p < solids.size(); ++p) {
        for (std::size_t f = 0; f < solids[p].faces.size(); ++f) {
            const PolyhedronFace& face = solids[p].faces[f];
            auto group = std::find_if(groups.begin(), groups.end(),
                                      [&](const PlaneGroup& g) { return lies_in(g.plane, face); });
            if (group == groups.end()) {
                groups.push_back({make_plane_frame(face.frame.origin_m, face.outward), {}});
                group = groups.end() - 1;
            }
            group->faces.emplace_back(p, f);
        }
    }
    return groups;
}

// Members whose bounding boxes hang together; each cluster is treated by itself.
std::vector<std::vector<PlaneMember>> clusters(std::vector<PlaneMember> members) {
    std::vector<std::vector<PlaneMember>> result;
    std::vector<Bounds> cluster_bounds;
    std::sort(members.begin(), members.end(),
              [](const PlaneMember& a, const PlaneMember& b) { return a.bounds.left < b.bounds.left; });
    for (PlaneMember& member : members) {
        std::vector<PlaneMember> merged;
        Bounds bounds = member.bounds;
        merged.push_back(std::move(member));
        for (std::size_t i = result.size(); i-- > 0;) {
            if (!cluster_bounds[i].overlaps(bounds)) continue;
            std::move(result[i].begin(), result[i].end(), std::back_inserter(merged));
            bounds.left = std::min(bounds.left, cluster_bounds[i].left);
            bounds.right = std::max(bounds.right, cluster_bounds[i].right);
            bounds.bottom = std::min(bounds.bottom, cluster_bounds[i].bottom);
            bounds.top = std::max(bounds.top, cluster_bounds[i].top);
            result.erase(result.begin() + static_cast<std::ptrdiff_t>(i));
            cluster_bounds.erase(cluster_bounds.begin() + static_cast<std::ptrdiff_t>(i));
            i = result.size();
        }
        result.push_back(std::move(merged));
        cluster_bounds.push_back(bounds);
    }
    return result;
}

// The frame of the grid on a polygon that is not the face of a polyhedron: its own edges when it is a parallelogram or a
// triangle, else the rectangle around it along its longest edge.
FaceFrame frame_of(const Region& region, const PlaneFrame& plane) {
    const Ring& outline = region.front();
    const std::size_t n = outline.size();
    if (region.size() == 1 && n == 3) {
        const dvec3 a = plane.to_world(outline[0]);
        return {a, plane.to_world(outline[1]) - a, plane.to_world(outline[2]) - a};
    }
    const bool parallelogram = region.size() == 1 && n == 4 &&
                               std::abs(static_cast<double>(outline[0].X - outline[1].X + outline[2].X - outline[3].X)) < 1e3 &&
                               std::abs(static_cast<double>(outline[0].Y - outline[1].Y + outline[2].Y - outline[3].Y)) < 1e3;
    if (parallelogram) {
        const dvec3 a = plane.to_world(outline[0]);
        return {a, plane.to_world(outline[1]) - a, plane.to_world(outline[3]) - a};
    }
    std::size_t longest = 0;
    const auto edge_vector = [&](std::size_t i) {
        return plane.to_world(outline[(i + 1) % n]) - plane.to_world(outline[i]);
    };
    for (std::size_t i = 1; i < n; ++i)
        if (glm::length(edge_vector(i)) > glm::length(edge_vector(longest)) * (1.0 + 1e-9)) longest = i;
    const dvec3 u = glm::normalize(edge_vector(longest));
    const dvec3 v = glm::cross(plane.normal, u);
    double low_u = std::numeric_limits<double>::max(), high_u = -low_u, low_v = low_u, high_v = -low_u;
    for (const PlanePoint& p : outline) {
        const dvec3 d = plane.to_world(p) - plane.origin_m;
        low_u = std::min(low_u, glm::dot(d, u)), high_u = std::max(high_u, glm::dot(d, u));
        low_v = std::min(low_v, glm::dot(d, v)), high_v = std::max(high_v, glm::dot(d, v));
    }
    return {plane.origin_m + low_u * u + low_v * v, (high_u - low_u) * u, (high_v - low_v) * v};
}

// A plane and a region in it, seen from the other side: x and y change places.
PlaneFrame turned(const PlaneFrame& plane) { return {plane.origin_m, plane.y, plane.x, -plane.normal}; }

Region turned(const Region& region) {
    Region result;
    for (const Ring& ring : region) {
        Ring other;
        for (auto p = ring.rbegin(); p != ring.rend(); ++p) other.emplace_back(p->Y, p->X);
        result.push_back(std::move(other));
    }
    return result;
}

class Assembler {
public:
    explicit Assembler(const Scene& scene) : scene_(scene) {
        building_.ground_z_m = scene.ground.z_m;
        for (const Polyhedron& polyhedron : scene.polyhedra) solids_.push_back(make_solid(polyhedron));
    }

    Building run() {
        std::vector<PlaneGroup> groups = group_by_plane(solids_);
        const auto is_ground = [&](const PlaneFrame& plane) {
            return std::abs(plane.normal.z) > 1.0 - 1e-12 &&
                   std::abs(plane.origin_m.z - scene_.ground.z_m) < coincidence_m;
        };
        if (std::none_of(groups.begin(), groups.end(), [&](const PlaneGroup& g) { return is_ground(g.plane); }))
            groups.push_back({make_plane_frame({0, 0, scene_.ground.z_m}, {0, 0, 1}), {}});
        for (const PlaneGroup& group : groups) assemble_plane(group, is_ground(group.plane));
        add_polygons();
        order_and_number();
        return std::move(building_);
    }

    // What lies on one side of a plane inside `domain`.
    Layers layers_at(const PlaneFrame& plane, Side side, const Region& domain) const {
        std::vector<Action> actions;
        for (std::size_t p = 0; p < solids_.size(); ++p) {
            Section cut = section(solids_[p], plane);
            add_action(actions, p, std::move(side == Side::front ? cut.front : cut.back));
        }
        return layers(domain, actions, plane, side, scene_.ground.z_m);
    }

    // A polygon of the scene by itself, cut into convex facets.
    std::vector<Facet> polygon_facets(const SurfacePolygon& polygon) const {
        const PlaneFrame plane = polygon_plane(polygon.vertices_m);
        std::vector<Facet> facets;
        for (const Ring& ring : convex_parts(region_of(plane, polygon.vertices_m, polygon.holes_m))) {
            Facet facet{.normal = plane.normal};
            for (const PlanePoint& p : ring) facet.vertices_m.push_back(plane.to_world(p));
            facets.push_back(std::move(facet));
        }
        return facets;
    }

private:
    void add_action(std::vector<Action>& actions, std::size_t polyhedron, Ring outline) const {
        if (outline.empty()) return;
        Bounds bounds;
        bounds.add(outline);
        actions.push_back({scene_.polyhedra[polyhedron].effect, std::move(outline), bounds, polyhedron});
    }

    void assemble_plane(const PlaneGroup& group, bool is_ground) {
        const PlaneFrame& plane = group.plane;
        std::vector<Action> front_actions, back_actions;
        std::vector<PlaneMember> members;
        const Sphere reach = sphere_around(group);
        for (std::size_t p = 0; p < solids_.size(); ++p) {
            // The ground is open everywhere; elsewhere what does not reach the faces in the plane does nothing to them.
            if (!is_ground && glm::distance(reach.centre_m, solids_[p].centre_m) > reach.radius_m + solids_[p].radius_m + coincidence_m)
                continue;
            Section cut = section(solids_[p], plane);
            // Carved below and open above: an aperture in the ground plane that no face marks.
            if (is_ground && scene_.polyhedra[p].effect == Effect::carve && !cut.front.empty() && !cut.back.empty()) {
                PlaneMember opening{.polyhedron = p, .face = 0, .outline = {cut.front}, .bounds = {}, .claims = false};
                opening.bounds.add(cut.front);
                members.push_back(std::move(opening));
            }
            add_action(front_actions, p, std::move(cut.front));
            add_action(back_actions, p, std::move(cut.back));
        }
        for (const auto& [p, f] : group.faces) {
            PlaneMember member{.polyhedron = p, .face = f, .outline = polygon_region(plane, solids_[p].faces[f].vertices_m)};
            member.bounds = bounds_of(member.outline);
            members.push_back(std::move(member));
        }
        for (std::vector<PlaneMember>& cluster : clusters(std::move(members))) {
            // Latest polyhedron first: it names the material where faces coincide.
            std::sort(cluster.begin(), cluster.end(), [](const PlaneMember& a, const PlaneMember& b) {
                return a.polyhedron != b.polyhedron ? a.polyhedron > b.polyhedron : a.face > b.face;
            });
            Region domain;
            for (const PlaneMember& member : cluster) domain.insert(domain.end(), member.outline.begin(), member.outline.end());
            domain = unite(domain, {});
            const Layers front = layers(domain, front_actions, plane, Side::front, scene_.ground.z_m);
            const Layers back = layers(domain, back_actions, plane, Side::back, scene_.ground.z_m);
            add_surfaces(cluster, plane, Environment::indoor, intersect(front.indoor, unite(back.solid, back.ground)), false);
            add_surfaces(cluster, plane, Environment::outdoor, intersect(front.outdoor, unite(back.solid, back.ground)), false);
            add_surfaces(cluster, plane, Environment::indoor, intersect(back.indoor, unite(front.solid, front.ground)), true);
            add_surfaces(cluster, plane, Environment::outdoor, intersect(back.outdoor, unite(front.solid, front.ground)), true);
            add_apertures(cluster, plane, intersect(front.indoor, back.outdoor), front_actions, false);
            add_apertures(cluster, plane, intersect(back.indoor, front.outdoor), back_actions, true);
            add_inner_apertures(cluster, plane, intersect(front.indoor, back.indoor));
        }
    }

    struct Sphere {
        dvec3 centre_m{};
        double radius_m = 0.0;
    };

    // A sphere that holds the faces in a plane.
    Sphere sphere_around(const PlaneGroup& group) const {
        Sphere sphere;
        const auto for_each_vertex = [&](const auto& visit) {
            for (const auto& [p, f] : group.faces)
                for (const dvec3& v : solids_[p].faces[f].vertices_m) visit(v);
        };
        double count = 0.0;
        for_each_vertex([&](const dvec3& v) { sphere.centre_m += v, ++count; });
        if (count > 0.0) sphere.centre_m /= count;
        for_each_vertex([&](const dvec3& v) { sphere.radius_m = std::max(sphere.radius_m, glm::distance(v, sphere.centre_m)); });
        return sphere;
    }

    // Facets of one kind in a plane go to the latest face that covers them. `reverse`: the air is behind the plane.
    void add_surfaces(const std::vector<PlaneMember>& cluster, const PlaneFrame& plane, Environment environment,
                      Region surface, bool reverse) {
        if (surface.empty()) return;
        std::vector<const PlaneMember*> claimants;
        for (const PlaneMember& member : cluster) {
            // A carve does nothing to outdoor air, so it never makes an outdoor surface.
            const bool idle = environment == Environment::outdoor && scene_.polyhedra[member.polyhedron].effect == Effect::carve;
            if (member.claims && !idle) claimants.push_back(&member);
        }
        share_out(claimants, plane, environment, std::move(surface), reverse);
    }

    // claimants: the first that covers a point of the surface gets it.
    void share_out(std::span<const PlaneMember* const> claimants, const PlaneFrame& plane, Environment environment,
                   Region surface, bool reverse) {
        // Many faces are dealt with by halves, each with the part of the surface that it covers: most cover none, and each by
        // itself would cut all of it.
        constexpr std::size_t few = 16;
        if (claimants.size() > few) {
            const std::size_t half = claimants.size() / 2;
            Region outlines;
            for (const PlaneMember* member : claimants.first(half))
                outlines.insert(outlines.end(), member->outline.begin(), member->outline.end());
            Region covered = without_slivers(intersect(surface, outlines));
            if (!covered.empty()) {
                surface = subtract(surface, outlines);
                share_out(claimants.first(half), plane, environment, std::move(covered), reverse);
            }
            if (!surface.empty()) share_out(claimants.subspan(half), plane, environment, std::move(surface), reverse);
            return;
        }
        for (const PlaneMember* const claimant : claimants) {
            if (surface.empty()) return;
            const PlaneMember& member = *claimant;
            const Polyhedron& polyhedron = scene_.polyhedra[member.polyhedron];
            Region part = without_slivers(intersect(surface, member.outline));
            if (part.empty()) continue;
            surface = subtract(surface, member.outline);
            const PolyhedronFace& source = solids_[member.polyhedron].faces[member.face];
            const FaceFinish& finish = polyhedron.faces[member.face];
            add_face({.name = polyhedron.id + "/" + std::string(source.role),
                      .frame = source.frame,
                      .normal = {},
                      .environment = environment,
                      .material = finish.material.value_or(polyhedron.material)},
                     plane, std::move(part), reverse);
        }
    }

    void add_face(Face face, const PlaneFrame& plane, Region region, bool reverse) {
        face.plane = reverse ? turned(plane) : plane;
        face.normal = face.plane.normal;
        face.region = reverse ? turned(region) : std::move(region);
        int& uses = name_uses_[face.name];
        if (++uses > 1) face.name += "~" + std::to_string(uses);
        building_.faces.push_back(std::move(face));
    }

    // The glazing a carving polyhedron gives to an opening in a plane: that of its face there, else its own.
    GlazingId glazing_of(std::size_t polyhedron, const std::vector<PlaneMember>& cluster) const {
        const Polyhedron& p = scene_.polyhedra[polyhedron];
        for (const PlaneMember& member : cluster) {
            if (member.polyhedron == polyhedron && member.claims && p.faces[member.face].glazing)
                return *p.faces[member.face].glazing;
        }
        return p.glazing.value_or(GlazingId{});
    }

    // Openings to the outdoors. The last carve over the room side decides on the glazing; openings of the same glazing
    // that hang together are one aperture, of any shape.
    void add_apertures(const std::vector<PlaneMember>& cluster, const PlaneFrame& plane, Region opening,
                       const std::vector<Action>& room_side_actions, bool reverse) {
        opening = without_slivers(opening);
        std::map<GlazingId, Region> by_glazing;
        std::vector<std::pair<std::size_t, Region>> by_carver;
        for (auto action = room_side_actions.rbegin(); action != room_side_actions.rend() && !opening.empty(); ++action) {
            if (action->effect != Effect::carve) continue;
            Region part;
            move_part(opening, {action->outline}, part);
            if (part.empty()) continue;
            Region& same = by_glazing[glazing_of(action->polyhedron, cluster)];
            same = unite(same, part);
            by_carver.emplace_back(action->polyhedron, std::move(part));
        }
        for (const auto& [glazing, region] : by_glazing) {
            for (const Region& part : connected_parts(without_slivers(region))) {
                // Named after the polyhedron that carved most of it.
                std::size_t carver = by_carver.front().first;
                double most = -1.0;
                for (const auto& [p, carved] : by_carver) {
                    const double share = area_m2(intersect(part, carved));
                    if (share > most) most = share, carver = p;
                }
                add_aperture(scene_.polyhedra[carver].id, glazing, plane, part, reverse, false);
            }
        }
    }

    // A face between two rooms that names a glazing holds a pane.
    void add_inner_apertures(const std::vector<PlaneMember>& cluster, const PlaneFrame& plane, Region opening) {
        for (const PlaneMember& member : cluster) {
            const Polyhedron& polyhedron = scene_.polyhedra[member.polyhedron];
            if (!member.claims || !polyhedron.faces[member.face].glazing || opening.empty()) continue;
            const Region pane = without_slivers(intersect(opening, member.outline));
            opening = subtract(opening, member.outline);
            for (const Region& part : connected_parts(pane))
                add_aperture(polyhedron.id, *polyhedron.faces[member.face].glazing, plane, part, false, true);
        }
    }

    void add_aperture(const std::string& name, GlazingId glazing, const PlaneFrame& plane, const Region& region,
                      bool reverse, bool inner) {
        const auto id = make_id<ApertureId>(building_.apertures.size());
        const auto face = make_id<FaceId>(building_.faces.size());
        add_face({.name = name + "/opening", .frame = frame_of(region, plane), .normal = {}, .aperture = id}, plane, region,
                 reverse);
        if (inner) {
            const auto back = make_id<FaceId>(building_.faces.size());
            building_.faces.back().other_side = back;
            add_face({.name = name + "/opening", .frame = building_.faces[index(face)].frame, .normal = {}, .aperture = id,
                      .other_side = face},
                     plane, region, true);
        }
        const Face& front = building_.faces[index(face)];
        int& uses = aperture_name_uses_[name];
        ++uses;
        building_.apertures.push_back({.name = uses > 1 ? name + "~" + std::to_string(uses) : name,
                                       .glazing = glazing,
                                       .inner = inner,
                                       .face = face,
                                       .facets = {},
                                       .normal = front.normal,
                                       .area_m2 = area_m2(front.region)});
    }

    // Polygons join as they are, less what is buried in solid and less the aperture polygons in their plane.
    void add_polygons() {
        for (const SurfacePolygon& polygon : scene_.polygons) {
            const PlaneFrame plane = polygon_plane(polygon.vertices_m);
            Region region = region_of(plane, polygon.vertices_m, polygon.holes_m);
            for (const AperturePolygon& aperture : scene_.apertures) {
                const bool coplanar = std::all_of(aperture.vertices_m.begin(), aperture.vertices_m.end(), [&](const dvec3& v) {
                    return std::abs(glm::dot(v - plane.origin_m, plane.normal)) < coincidence_m;
                });
                if (coplanar) region = subtract(region, region_of(plane, aperture.vertices_m, aperture.holes_m));
            }
            add_polygon_side(polygon, plane, region, false);
            if (polygon.two_sided) add_polygon_side(polygon, plane, region, true);
        }
        for (const AperturePolygon& aperture : scene_.apertures) {
            const PlaneFrame plane = polygon_plane(aperture.vertices_m);
            const Region region = region_of(plane, aperture.vertices_m, aperture.holes_m);
            for (const Region& part : connected_parts(region)) add_aperture(aperture.id, aperture.glazing, plane, part, false, false);
        }
    }

    void add_polygon_side(const SurfacePolygon& polygon, const PlaneFrame& plane, const Region& region, bool reverse) {
        Region visible = region;
        if (!scene_.polyhedra.empty() || polygon.side == Environment::outdoor) {
            const Layers around = layers_at(plane, reverse ? Side::back : Side::front, region);
            visible = subtract(visible, around.solid);
            // Rooms of imported polygons may lie below the ground; nothing outdoors does.
            if (polygon.side == Environment::outdoor) visible = subtract(visible, around.ground);
        }
        visible = without_slivers(visible);
        if (visible.empty()) return;
        cover_faces(plane, visible, reverse);
        const FaceFrame frame = frame_of(region, plane);
        add_face({.name = polygon.id, .frame = frame, .normal = {}, .environment = polygon.side, .material = polygon.material,
                  .sheet = true},
                 plane, std::move(visible), reverse);
    }

    // A polygon that lies on a surface, like a rug on the floor, takes its place.
    void cover_faces(const PlaneFrame& plane, const Region& cover, bool reverse) {
        const dvec3 normal = reverse ? -plane.normal : plane.normal;
        for (Face& face : building_.faces) {
            if (face.aperture || glm::dot(face.normal, normal) < 1.0 - 1e-9) continue;
            Region on_face;
            bool coplanar = true;
            for (const Ring& ring : cover) {
                std::vector<dvec3> corners_m;
                for (const PlanePoint& p : ring) corners_m.push_back(plane.to_world(p));
                for (const dvec3& p : corners_m)
                    coplanar = coplanar && std::abs(glm::dot(p - face.plane.origin_m, face.normal)) < coincidence_m;
                if (!coplanar) break;
                Ring turned_ring;
                for (const dvec3& p : corners_m) turned_ring.push_back(face.plane.to_plane(p));
                if (reverse) ClipperLib::ReversePath(turned_ring);
                on_face.push_back(std::move(turned_ring));
            }
            if (coplanar) face.region = without_slivers(subtract(face.region, on_face));
        }
    }

    static PlaneFrame polygon_plane(const std::vector<dvec3>& vertices_m) {
        // Newell's normal: right for concave polygons too.
        dvec3 normal{};
        for (std::size_t i = 0; i < vertices_m.size(); ++i)
            normal += glm::cross(vertices_m[i] - vertices_m[0], vertices_m[(i + 1) % vertices_m.size()] - vertices_m[0]);
        return make_plane_frame(vertices_m[0], glm::normalize(normal));
    }

    static Region region_of(const PlaneFrame& plane, const std::vector<dvec3>& vertices_m,
                            const std::vector<std::vector<dvec3>>& holes_m) {
        Region region = polygon_region(plane, vertices_m);
        for (const auto& hole : holes_m) region = subtract(region, polygon_region(plane, hole));
        return region;
    }

    // Facets from faces: opaque ones first, then the parts of apertures.
    void order_and_number() {
        for (const bool apertures : {false, true}) {
            for (std::size_t f = 0; f < building_.faces.size(); ++f) {
                const Face& face = building_.faces[f];
                if (face.aperture.has_value() != apertures) continue;
                for (const Ring& ring : convex_parts(face.region)) {
                    Facet facet{.face = make_id<FaceId>(f), .vertices_m = {}, .normal = face.normal, .area_m2 = area_m2(ring),
                                .environment = face.environment, .is_aperture = apertures};
                    for (const PlanePoint& p : ring) facet.vertices_m.push_back(face.plane.to_world(p));
                    if (apertures && building_.apertures[index(*face.aperture)].face == facet.face)
                        building_.apertures[index(*face.aperture)].facets.push_back(make_id<FacetId>(building_.facets.size()));
                    building_.facets.push_back(std::move(facet));
                }
            }
        }
        for (Aperture& aperture : building_.apertures) {
            for (const FacetId id : aperture.facets) {
                const Facet& facet = building_.facets[index(id)];
                dvec3 moment{};
                for (std::size_t i = 1; i + 1 < facet.vertices_m.size(); ++i) {
                    const dvec3 &a = facet.vertices_m[0], &b = facet.vertices_m[i], &c = facet.vertices_m[i + 1];
                    moment += 0.5 * glm::length(glm::cross(b - a, c - a)) * (a + b + c) / 3.0;
                }
                aperture.centroid_m += moment / aperture.area_m2;
            }
        }
        // Divergence theorem over everything that bounds indoor air; normals point into it.
        double volume = 0.0;
        for (const Facet& facet : building_.facets) {
            if (facet.environment == Environment::indoor)
                volume -= facet.area_m2 * glm::dot(facet.normal, facet.vertices_m[0] - origin()) / 3.0;
        }
        building_.indoor_air_volume_m3 = volume;
    }

    // Near the building, so that the terms of the volume do not cancel more than they must.
    dvec3 origin() const { return building_.facets.empty() ? dvec3{} : building_.facets[0].vertices_m[0]; }

    const Scene& scene_;
    std::vector<Solid> solids_;
    Building building_;
    std::map<std::string, int> name_uses_;
    std::map<std::string, int> aperture_name_uses_;
};

}  // namespace

Building assemble(const Scene& scene) { return Assembler(scene).run(); }

namespace {

/// polyhedra: those to look at, the last ones of the scene first.
template <class Polyhedra>
Medium medium_among(const Scene& scene, const Polyhedra& polyhedra, const glm::dvec3& point_m) {
    bool carved = false;
    for (const Polyhedron& p : polyhedra) {
        if ((carved && p.effect == Effect::carve) || !contains(p, point_m)) continue;
        if (p.effect == Effect::fill) return carved ? Medium::indoor_air : Medium::solid;
        carved = true;
    }
    if (point_m.z >= scene.ground.z_m) return Medium::outdoor_air;
    return carved ? Medium::indoor_air : Medium::solid;
}

}  // namespace

Medium medium_at(const Scene& scene, const glm::dvec3& point_m) {
    return medium_among(scene, std::views::reverse(scene.polyhedra), point_m);
}

Medium medium_at(const Scene& scene, std::span<const std::uint32_t> polyhedra, const glm::dvec3& point_m) {
    const auto of_scene = [&](std::uint32_t k) -> const Polyhedron& { return scene.polyhedra[k]; };
    return medium_among(scene, std::views::transform(std::views::reverse(polyhedra), of_scene), point_m);
}

Region indoor_air_at_height(const Scene& scene, double z_m) {
    const PlaneFrame plane{{0, 0, z_m}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Region domain;
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        if (polyhedron.effect != Effect::carve) continue;
        const Section cut = section(make_solid(polyhedron), plane);
        if (!cut.front.empty()) domain = unite(domain, {cut.front});
    }
    const Assembler assembler(scene);
    Region air = assembler.layers_at(plane, Side::front, domain).indoor;
    // Rooms of polygons: over their floors, less what is filled.
    Region floors;
    for (const SurfacePolygon& polygon : scene.polygons) {
        if (polygon.side != Environment::indoor || polygon.vertices_m[0].z >= z_m) continue;
        for (const Facet& facet : assembler.polygon_facets(polygon))
            if (facet.normal.z > 0.5) floors = unite(floors, polygon_region(plane, facet.vertices_m));
    }
    if (!floors.empty()) air = unite(air, subtract(floors, assembler.layers_at(plane, Side::front, floors).solid));
    return without_slivers(air);
}

}  // namespace naturel
