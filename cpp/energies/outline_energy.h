// SPDX-License-Identifier: MIT
// Energy of a pose from the object's outline in the colour image (docs/math/outline.md).
#pragma once

#include <vector>

#include "energies/outline_lines_term.h"
#include "optim/energy.h"

namespace sdftrack::energies {

// Distance of a line's point from the outline that the colours indicate, and its derivative by the increment,
// both divided by the line's stated sd.
struct OutlineResidual {
  double off;
  Eigen::Matrix<double, 6, 1> J;
};

struct OutlineLines {
  std::vector<OutlineLine> lines;  // in their order along the outline
  ColorProjection view;
  std::vector<Vec2d> scratch;  // working memory of the energy: residual in pixels, squared inverse sd
};

// How reliable the offset of a line is.
struct OutlineErrors {
  double noise = 1;         // factor by which the offsets' errors exceed their stated sd
  double common_sd_px = 0;  // of an offset that all lines share, outwards; 0: no such offset
  double shared_lines = 1;  // lines that count as one, as in the energy's weight
};

// E = min_b sum_i log(1 + r_i^2 / 2) + L b^2 / (2 s^2),
// r_i = (n_i . (u(T_cam_obj X_i) - c_i) - mu_i - b) / (noise sigma_i): the lines are made at one pose and
// stay fixed while the pose moves, so that costs may be compared. The outline's point slides on a round
// surface that turns; this changes r only by a second-order term. b is the common shift of the outline by
// blur, exposure and rounded edges (s = common_sd_px, L = shared_lines). The gradient is taken at the best b;
// the Hessian has b eliminated.
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

  // The residuals of all lines, in their order, without b.
  void residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const;
  // The term to send to a device, still in host memory.
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
