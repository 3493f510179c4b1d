// Pinhole camera. Pixel (0, 0) is the top left one; its centre lies at (0.5, 0.5).
#pragma once

#include "registry.h"

#include <cmath>
#include <stdexcept>

namespace lobe {

struct Ray {
    Vec3 origin;
    Vec3 direction;  // unit
};

// The rays of one image, as an affine map of the pixel position.
struct View {
    Vec3 eye, corner, per_x, per_y;

    Ray ray(double x, double y) const { return {eye, (corner + per_x * x + per_y * y).normalized()}; }
};

struct Camera {
    Vec3 eye;
    Vec3 right, up, forward;  // orthonormal
    double fov_y_degrees;     // full angle of view, from the bottom edge to the top edge

    // Throws std::invalid_argument where eye and target coincide, up is along the view, or the angle is not within
    // 0..180.
    Camera(const Vec3& eye, const Vec3& target, const Vec3& up_hint, double fov_y_degrees)
        : eye(eye), forward((target - eye).normalized()), fov_y_degrees(fov_y_degrees) {
        if (forward == Vec3(0)) throw std::invalid_argument("camera: eye and target must differ");
        right = forward.cross(up_hint).normalized();
        if (right == Vec3(0)) throw std::invalid_argument("camera: up must not be null or parallel to target - eye");
        if (!(fov_y_degrees > 0 && fov_y_degrees < 180))
            throw std::invalid_argument("camera: fov_y_degrees must lie between 0 and 180, got " +
                                        std::to_string(fov_y_degrees));
        up = right.cross(forward);
    }

    View view(int width, int height) const {
        const double half_height = std::tan(fov_y_degrees * 3.14159265358979323846 / 360);
        const double pixel = 2 * half_height / height;  // square pixels, on the plane at distance 1
        const Vec3 corner = forward - right * (pixel * width / 2) + up * half_height;
        return {eye, corner, right * pixel, -up * pixel};
    }
};

}  // namespace lobe
