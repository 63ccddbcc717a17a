// SPDX-License-Identifier: MIT
// The mapping from points of the depth camera to colour pixels, with derivatives, in two forms. Projective:
// lambda x' = P (Z x) + q (thesis Eq. 3.25), held as M = [P K | q] on points in metres, 12 parameters up to
// scale. Rigid: x' = pi(T_color_depth p) with a known colour camera, 6 unknowns (v, w): T <- exp(v, w) T.
// docs/math/color_to_depth.md, eq. 1, 11 and 12.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::calibration {

using ProjectiveMatrix = Eigen::Matrix<double, 3, 4>;
constexpr int kMaxMapUnknowns = 12;

class DepthToColor {
 public:
  struct Pixel {
    Vec2d px;  // NaN for a point that is not in front of the colour camera
    Eigen::Matrix<double, 2, kMaxMapUnknowns> by_map;  // the first `unknowns` columns
    Eigen::Matrix<double, 2, 3> by_point;
  };

  // Scaled so that |M[2, :3]| = 1: lambda is then the depth (m) in the colour camera.
  explicit DepthToColor(const ProjectiveMatrix& M);
  DepthToColor(const Rigidd& T_color_depth, const Camera& color)
      : T_color_depth_(T_color_depth), color_(color) {}

  bool is_projective() const { return !color_; }
  int unknowns() const { return color_ ? 6 : kMaxMapUnknowns; }
  const ProjectiveMatrix& M() const { return M_; }
  const Rigidd& T_color_depth() const { return T_color_depth_; }

  Pixel at(Vec3d p_cam) const;
  Vec2d pixel(Vec3d p_cam) const { return at(p_cam).px; }
  DepthToColor moved(const Eigen::VectorXd& step) const;
  // The scale of each unknown, for damping.
  Eigen::VectorXd scales() const;
  // The direction of the projective unknowns that no pair can fix, in units of `scales`.
  Eigen::VectorXd free_direction() const;

  // P row by row, then q, of Eq. 3.25 for a depth camera, and their derivatives by the unknowns, at fixed
  // scale. For a rigid map they give ideal pixels of the colour camera, without distortion.
  struct Pq {
    Eigen::Matrix<double, 12, 1> values;
    Eigen::MatrixXd by_map;
  };
  Pq Pq_of(const Intrinsics<double>& depth) const;

 private:
  ProjectiveMatrix M_ = ProjectiveMatrix::Zero();
  Rigidd T_color_depth_;
  std::optional<Camera> color_;
};

// K' with K'[2, 2] = 1, which may have a skew, and T_color_depth of M = K' [R' | t] (up to scale).
struct CameraAndPlace {
  Eigen::Matrix3d K;
  Rigidd T_color_depth;
};
// Empty if M mirrors points.
std::optional<CameraAndPlace> decompose(const ProjectiveMatrix& M);

}  // namespace sdftrack::calibration
