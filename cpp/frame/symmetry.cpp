// SPDX-License-Identifier: MIT
#include "frame/symmetry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sdftrack::frame {

namespace {

constexpr double kBetter = 1e-12;  // of a trace: of equally near poses the first is taken

double trace(const Mat3d& A) { return A.r0.x + A.r1.y + A.r2.z; }

Rigidd turn_about(const SymmetryAxis& about, double angle_rad) {
  const Mat3d R = rotation_exp(angle_rad * about.axis);
  return {R, about.point - R * about.point};
}

// The angle that makes the trace of R times the turn the largest: trace = a + b cos + c sin.
double best_angle(const Mat3d& R, Vec3d axis) {
  return std::atan2(trace(R * hat(axis)), trace(R) - dot(axis, R * axis));
}

}  // namespace

std::vector<Rigidd> Symmetry::motions(int steps) const {
  std::vector<Rigidd> out{Rigidd{}};
  out.insert(out.end(), discrete.begin(), discrete.end());
  for (std::size_t k = 0; k < std::min<std::size_t>(axes.size(), 2); ++k) {
    std::vector<Rigidd> turned;
    for (const Rigidd& S : out)
      for (int i = 0; i < steps; ++i)
        turned.push_back(S * turn_about(axes[k], 2 * std::numbers::pi * i / steps));
    out = std::move(turned);
  }
  return out;
}

Rigidd Symmetry::canonical(const Rigidd& T, const Mat3d& R_near) const {
  if (axes.size() > 1) {
    const Vec3d centre = axes.front().point;
    return {R_near, T * centre - R_near * centre};
  }
  Rigidd best = T;
  double best_trace = -std::numeric_limits<double>::infinity();
  const auto consider = [&](Rigidd moved) {
    for (const SymmetryAxis& about : axes)
      moved = moved * turn_about(about, best_angle(transpose(R_near) * moved.R, about.axis));
    const double near = trace(transpose(R_near) * moved.R);
    if (near > best_trace + kBetter) best = moved, best_trace = near;
  };
  consider(T);
  for (const Rigidd& S : discrete) consider(T * S);
  return best;
}

void Symmetry::enlarge(double factor) {
  for (Rigidd& S : discrete) S.t = factor * S.t;
  for (SymmetryAxis& about : axes) about.point = factor * about.point;
}

}  // namespace sdftrack::frame
