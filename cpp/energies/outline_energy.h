// SPDX-License-Identifier: MIT
// What the object's outline in the colour image says of a pose (docs/math/outline.md).
#pragma once

#include <vector>

#include "energies/outline_lines_term.h"
#include "optim/energy.h"

namespace sdftrack::energies {

// Distance of a line's point from where the colours put the outline, and its derivative by the increment;
// both over the line's stated sd.
struct OutlineResidual {
  double off;
  Eigen::Matrix<double, 6, 1> J;
};

struct OutlineLines {
  std::vector<OutlineLine> lines;  // in their order along the outline
  ColorProjection view;
  std::vector<Vec2d> scratch;  // of the energy: residual in pixels, squared inverse sd
};

// How well a line's offset may be believed.
struct OutlineErrors {
  double noise = 1;         // by how much the offsets are off more than their distributions say
  double common_sd_px = 0;  // of an offset that all lines share, outwards; 0: there is none
  double shared_lines = 1;  // lines that count as one, as the energy's weight has it
};

// E = min_b sum_i log(1 + r_i^2 / 2) + L b^2 / (2 s^2),
// r_i = (n_i . (u(T_cam_obj X_i) - c_i) - mu_i - b) / (noise sigma_i): the lines are made at one pose and
// stay while the pose moves, so that costs may be compared. The outline's point slides on a round surface
// while it turns; that changes r by a term of second order. b is what blur, exposure and rounded edges move
// all of an outline by (s = common_sd_px, L = shared_lines); the gradient is that with the best b held, the
// Hessian has b eliminated.
class OutlineEnergy final : public optim::Energy {
 public:
  OutlineEnergy(OutlineLines* lines, const OutlineErrors& errors)
      : lines_(lines),
        term_{lines->view, 1 / errors.noise,
              errors.common_sd_px > 0 ? errors.shared_lines / (errors.common_sd_px * errors.common_sd_px) : 0,
              nullptr, 0} {}

  optim::Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;

  // Of all lines, in their order; without b.
  void residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const;
  // For a device, on the host.
  OutlineLinesTerm on_device() const;

 private:
  template <class Visit>
  void each(const Rigidd& T_obj_cam, const Visit& visit) const;
  template <class Visit>
  void each_row(const Rigidd& T_obj_cam, double common_px, const Visit& visit) const;

  double common_offset(const Rigidd& T_obj_cam) const;

  OutlineLines* lines_;
  OutlineLinesTerm term_;  // without its lines
};

}  // namespace sdftrack::energies
