// The one place that knows which Embree it is: the calls of version 3 take a context, those of version 4 do not.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <memory>
#include <type_traits>

namespace lobe::embree {

using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, decltype(&rtcReleaseDevice)>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, decltype(&rtcReleaseScene)>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, decltype(&rtcReleaseGeometry)>;

#if RTC_VERSION_MAJOR >= 4

inline void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray); }
inline void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
inline void occluded(RTCScene scene, const int* valid, RTCRay16& rays) { rtcOccluded16(valid, scene, &rays); }

#else

inline void intersect(RTCScene scene, RTCRayHit& ray) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray);
}

inline void occluded(RTCScene scene, RTCRay& ray) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &ray);
}

inline void occluded(RTCScene scene, const int* valid, RTCRay16& rays) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(valid, scene, &context, &rays);
}

#endif

}  // namespace lobe::embree
