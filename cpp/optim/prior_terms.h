// SPDX-License-Identifier: MIT
// A Gaussian prior's error and its derivative: for the host and for kernels.
#pragma once

#include "base/rigid.h"

namespace sdftrack::optim {

// e = (v, w) of the increment D that takes the prior pose to another; J = d e / d (small increment on D's
// left): it moves t by w x t, and the MRP r by ((1 - |r|^2) w + 2 w x r + 2 (r . w) r) / 4.
struct PriorRow {
  double e[6];
  double J[6][6];
};

HD void prior_error(const Rigidd& D, double* e) {
  const Vec3d r = mrp_from_rotation(D.R);
  e[0] = D.t.x, e[1] = D.t.y, e[2] = D.t.z, e[3] = 4 * r.x, e[4] = 4 * r.y, e[5] = 4 * r.z;
}

HD void prior_row(const Rigidd& D, PriorRow* out) {
  prior_error(D, out->e);
  const Vec3d t = D.t, m = mrp_from_rotation(D.R);
  const double r[3] = {m.x, m.y, m.z}, one_less = 1 - (m.x * m.x + m.y * m.y + m.z * m.z);
  const double t_hat[3][3] = {{0, -t.z, t.y}, {t.z, 0, -t.x}, {-t.y, t.x, 0}},
               r_hat[3][3] = {{0, -m.z, m.y}, {m.z, 0, -m.x}, {-m.y, m.x, 0}};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double same = a == b ? 1.0 : 0.0;
      out->J[a][b] = same, out->J[a][3 + b] = -t_hat[a][b], out->J[3 + a][b] = 0;
      out->J[3 + a][3 + b] = (one_less * same - 2 * r_hat[a][b]) + 2 * r[a] * r[b];
    }
}

}  // namespace sdftrack::optim
