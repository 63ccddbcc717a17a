// SPDX-License-Identifier: MIT
// What the object's outline in the colour image says of a pose (docs/math/outline.md).
#pragma once

#include <vector>

#include "energies/color_projection.h"
#include "optim/energy.h"

namespace sdftrack::energies {

// A point of the surface that is on the outline, and where along the image normal the colours put the
// outline.
struct OutlineLine {
  Vec3d p_obj;
  Vec2d centre_px, normal;  // of the line: p_obj at the pose it was made for; outwards, unit length
  double offset_px, sd_px;  // of the true outline from centre_px along normal
};

// Distance of a line's point from where the colours put the outline, and its derivative by the increment;
// both over the line's stated sd.
struct OutlineResidual {
  double off;
  Eigen::Matrix<double, 6, 1> J;
};

struct OutlineLines {
  std::vector<OutlineLine> lines;  // in their order along the outline
  ColorProjection view;
};

// E = sum_i log(1 + r_i^2 / 2), r_i = (n_i . (u(T_cam_obj X_i) - c_i) - mu_i) / (noise sigma_i): the lines
// are made at one pose and stay while the pose moves, so that costs may be compared. The outline's point
// slides on a round surface while it turns; that changes r by a term of second order.
class OutlineEnergy final : public optim::Energy {
 public:
  // noise: by how much the offsets are off more than their distributions say.
  OutlineEnergy(const OutlineLines* lines, double noise) : lines_(lines), inv_noise_(1 / noise) {}

  optim::Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;

  // Of all lines, in their order.
  void residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const;

 private:
  template <class Visit>
  void each(const Rigidd& T_obj_cam, const Visit& visit) const;
  template <class Visit>
  void each_row(const Rigidd& T_obj_cam, const Visit& visit) const;

  const OutlineLines* lines_;
  double inv_noise_;
};

}  // namespace sdftrack::energies
