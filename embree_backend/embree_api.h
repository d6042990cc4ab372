#pragma once
// Embree 3.13 and 4 behind one face: the only file that includes rtcore.h.
#if NATUREL_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <array>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace naturel::embree_api {

/// 8 rays fill the registers of AVX and AVX2, 16 those of AVX-512. Without these, a packet of 16 is copied into two of 8 and back,
/// which costs a tenth of the time of a ray; with them, packets of 8 leave a sixth of the speed unused.
inline constexpr unsigned packet_size = 8, wide_packet_size = 16;
inline constexpr std::uint32_t no_hit = RTC_INVALID_GEOMETRY_ID;

struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct ReleaseGeometry {
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, ReleaseGeometry>;

/// Throws when Embree has an error to report.
inline void check(RTCDevice device, const char* what) {
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw std::runtime_error(std::string("Embree cannot ") + what + " (error " + std::to_string(error) +
                                 ")");
}

/// Without "threads=": it would lower the limit of TBB for the whole process.
inline Device make_device() {
    Device device(rtcNewDevice(nullptr));
    if (!device) check(nullptr, "start");
    return device;
}

using Triangle = std::array<std::uint32_t, 3>;

/// Robust: rays do not slip between triangles that share two vertices.
/// choosy: for trace_accepted(), which takes longer to trace.
inline Scene make_scene(RTCDevice device, std::span<const glm::vec3> vertices,
                        std::span<const Triangle> triangles, bool choosy = false) {
    Scene scene(rtcNewScene(device));
#if NATUREL_EMBREE_MAJOR >= 4
    constexpr RTCSceneFlags filters = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
    constexpr RTCSceneFlags filters = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif
    rtcSetSceneFlags(scene.get(), choosy ? static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | filters) : RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
    if (!triangles.empty()) {
        const Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
        void* const points = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                                     RTC_FORMAT_FLOAT3, sizeof(glm::vec3), vertices.size());
        void* const corners = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0,
                                                      RTC_FORMAT_UINT3, sizeof(Triangle), triangles.size());
        check(device, "store the facets");
        std::memcpy(points, vertices.data(), vertices.size_bytes());
        std::memcpy(corners, triangles.data(), triangles.size_bytes());
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometry(scene.get(), geometry.get());
    }
    rtcCommitScene(scene.get());
    check(device, "build its tree of facets");
    return scene;
}

/// Whether Embree has registers for wide packets here.
inline bool has_wide_packets(RTCDevice device) {
    return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
}

/// Neighbouring rays and what they meet.
template <unsigned rays_of_packet>
struct alignas(64) PacketOf {
    static constexpr unsigned size = rays_of_packet;
    alignas(64) std::array<int, size> valid;  ///< -1: to be traced, 0: not
    alignas(64) std::conditional_t<size == wide_packet_size, RTCRayHit16, RTCRayHit8> rays;

    PacketOf() {
        for (unsigned k = 0; k < size; ++k) {
            rays.ray.tnear[k] = rays.ray.time[k] = 0.0f;
            rays.ray.mask[k] = ~0u;
            rays.ray.flags[k] = 0;
            rays.hit.primID[k] = no_hit;
        }
    }

    void set_origin(unsigned k, const glm::vec3& p) {
        rays.ray.org_x[k] = p.x, rays.ray.org_y[k] = p.y, rays.ray.org_z[k] = p.z;
    }
    void set_direction(unsigned k, const glm::vec3& d) {
        rays.ray.dir_x[k] = d.x, rays.ray.dir_y[k] = d.y, rays.ray.dir_z[k] = d.z;
    }
    glm::dvec3 origin(unsigned k) const { return {rays.ray.org_x[k], rays.ray.org_y[k], rays.ray.org_z[k]}; }
    glm::dvec3 direction(unsigned k) const {
        return {rays.ray.dir_x[k], rays.ray.dir_y[k], rays.ray.dir_z[k]};
    }

    /// Number of the triangle that ray k met; no_hit when there is none.
    std::uint32_t triangle(unsigned k) const {
        return rays.hit.geomID[k] == no_hit ? no_hit : rays.hit.primID[k];
    }
    /// rtcOccluded marks a ray that meets anything.
    bool blocked(unsigned k) const { return rays.ray.tfar[k] < 0.0f; }

    /// After start(size) and a trace, once more: Embree changes nothing else.
    void start_again() {
        for (unsigned k = 0; k < size; ++k) rays.ray.tfar[k] = std::numeric_limits<float>::infinity();
        for (unsigned k = 0; k < size; ++k) rays.hit.geomID[k] = no_hit;
    }

    /// The first `count` rays are to be traced, to infinity.
    void start(unsigned count) {
        for (unsigned k = 0; k < size; ++k) {
            valid[k] = k < count ? -1 : 0;
            rays.ray.tfar[k] = std::numeric_limits<float>::infinity();
            rays.hit.geomID[k] = no_hit;
            rays.hit.instID[0][k] = no_hit;
        }
    }
};
using Packet = PacketOf<packet_size>;
using WidePacket = PacketOf<wide_packet_size>;

/// how: RTCIntersectArguments of Embree 4, RTCIntersectContext of Embree 3.
template <unsigned size, class How>
void intersect(RTCScene scene, PacketOf<size>& packet, How* how) {
    static_assert(size == packet_size || size == wide_packet_size);
#if NATUREL_EMBREE_MAJOR >= 4
    if constexpr (size == wide_packet_size)
        rtcIntersect16(packet.valid.data(), scene, &packet.rays, how);
    else
        rtcIntersect8(packet.valid.data(), scene, &packet.rays, how);
#else
    if constexpr (size == wide_packet_size)
        rtcIntersect16(packet.valid.data(), scene, how, &packet.rays);
    else
        rtcIntersect8(packet.valid.data(), scene, how, &packet.rays);
#endif
}

/// Traces the rays of a packet that has been started.
template <unsigned size>
void trace_started(RTCScene scene, PacketOf<size>& packet) {
#if NATUREL_EMBREE_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    intersect(scene, packet, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    intersect(scene, packet, &context);
#endif
}

/// Traces the first `count` rays of a packet from their origins to infinity.
template <unsigned size>
void trace(RTCScene scene, PacketOf<size>& packet, unsigned count = size) {
    packet.start(count);
    trace_started(scene, packet);
}

/// trace_started() that passes through what accept(triangle, direction) refuses. scene: choosy.
template <unsigned size, class Accept>
void trace_accepted(RTCScene scene, PacketOf<size>& packet, const Accept& accept) {
#if NATUREL_EMBREE_MAJOR >= 4
    using Base = RTCRayQueryContext;
#else
    using Base = RTCIntersectContext;
#endif
    struct Context {
        Base base;
        const Accept* accept;
    };
    const RTCFilterFunctionN filter = [](const RTCFilterFunctionNArguments* arguments) {
        const Accept& accepts = *reinterpret_cast<const Context*>(arguments->context)->accept;
        for (unsigned k = 0; k < arguments->N; ++k) {
            const glm::dvec3 direction(RTCRayN_dir_x(arguments->ray, arguments->N, k), RTCRayN_dir_y(arguments->ray, arguments->N, k),
                                       RTCRayN_dir_z(arguments->ray, arguments->N, k));
            if (arguments->valid[k] != 0 && !accepts(RTCHitN_primID(arguments->hit, arguments->N, k), direction))
                arguments->valid[k] = 0;
        }
    };
    Context context{.base = {}, .accept = &accept};
#if NATUREL_EMBREE_MAJOR >= 4
    rtcInitRayQueryContext(&context.base);
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = static_cast<RTCRayQueryFlags>(RTC_RAY_QUERY_FLAG_COHERENT | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
    arguments.context = &context.base;
    arguments.filter = filter;
    intersect(scene, packet, &arguments);
#else
    rtcInitIntersectContext(&context.base);
    context.base.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    context.base.filter = filter;
    intersect(scene, packet, &context.base);
#endif
}

/// trace() where only blocked() is asked.
template <unsigned size>
void trace_occlusion(RTCScene scene, PacketOf<size>& packet, unsigned count = size) {
    packet.start(count);
#if NATUREL_EMBREE_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    if constexpr (size == wide_packet_size)
        rtcOccluded16(packet.valid.data(), scene, &packet.rays.ray, &arguments);
    else
        rtcOccluded8(packet.valid.data(), scene, &packet.rays.ray, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if constexpr (size == wide_packet_size)
        rtcOccluded16(packet.valid.data(), scene, &context, &packet.rays.ray);
    else
        rtcOccluded8(packet.valid.data(), scene, &context, &packet.rays.ray);
#endif
}

/// Calls visit(number) for every triangle whose box comes within radius_m of a point.
template <class Visit>
void near_triangles(RTCScene scene, const glm::vec3& point, float radius_m, Visit visit) {
    RTCPointQuery query;
    query.x = point.x, query.y = point.y, query.z = point.z;
    query.time = 0.0f;
    query.radius = radius_m;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    const auto call = [](RTCPointQueryFunctionArguments* arguments) {
        (*static_cast<Visit*>(arguments->userPtr))(arguments->primID);
        return false;  // the radius stays
    };
    rtcPointQuery(scene, &query, &context, call, &visit);
}

}  // namespace naturel::embree_api
