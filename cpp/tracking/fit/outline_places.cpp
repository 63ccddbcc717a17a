// SPDX-License-Identifier: MIT
#include "tracking/fit/outline_places.h"

#include <cmath>

#include "base/portable_math.h"

namespace sdftrack::tracking {

namespace {

constexpr double kAside_px = 4;         // of the places on both sides that are checked for an occluder
constexpr double kOnNeighbor_m = 0.01;  // a measurement this near to a neighbour belongs to it

}  // namespace

OutlinePlaces::OutlinePlaces(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                             const Rigidd& T_cam_obj, const OutlineSearch& search,
                             const energies::ColorProjection& view)
    : frame_(frame),
      camera_(camera),
      shape_(shape),
      T_cam_obj_(T_cam_obj),
      T_obj_cam_(inverse(T_cam_obj)),
      view_(view),
      in_front_m_(search.in_front_m),
      beside_(search.beside) {}

bool OutlinePlaces::find(const ContourPoint& point, Vec2d* centre_px, Vec2d* normal) const {
  const Vec3d p = T_cam_obj_ * point.p_obj, n = T_cam_obj_.R * point.n_obj;
  energies::PixelJacobian J;
  if (!view_.place(p, centre_px, &J)) return false;
  const Vec3d along = cross(n, p);  // of the outline, in space
  const Vec2d tangent{dot(J.u, along), dot(J.v, along)}, out{dot(J.u, n), dot(J.v, n)};
  const double length = hypotenuse(tangent.x, tangent.y);
  if (!(length > 0)) return false;
  const double sign = out.x * tangent.y - out.y * tangent.x >= 0 ? 1 / length : -1 / length;
  *normal = {sign * tangent.y, -sign * tangent.x};
  return !is_hidden(p, n);
}

bool OutlinePlaces::is_hidden(Vec3d p, Vec3d n) const {
  if (!frame_.depth_m.data) return false;
  const double by = kAside_px * p.z / camera_.K.fx;
  for (const double k : {-1.0, 0.0, 1.0}) {
    const Vec3d at = p + (k * by) * n;
    if (!(at.z > 0)) return true;
    const double z = frame::reading_at(frame_, camera_, at);
    if (z == 0) continue;
    const Vec2d ideal = project(camera_.K, at);
    const Vec3d seen = z * ray(camera_.K, ideal.x, ideal.y);
    if (beside_ && on_one_of(*beside_, seen, kOnNeighbor_m)) return true;
    if (z > p.z - in_front_m_) continue;
    float phi;
    Vec3f unused;
    sample(shape_.sdf, (T_obj_cam_ * seen).cast<float>(), &phi, &unused);
    if (double(phi) > in_front_m_) return true;
  }
  return false;
}

// Where A p + q = 0: the colour camera's centre.
Vec3d centre_of(const energies::ColorProjection& view) {
  const Mat3d& A = view.A;
  const Vec3d x = cross(A.r1, A.r2), y = cross(A.r2, A.r0), z = cross(A.r0, A.r1);
  const double per = -1 / dot(A.r0, x);
  return per * (view.q.x * x + view.q.y * y + view.q.z * z);
}

}  // namespace sdftrack::tracking
