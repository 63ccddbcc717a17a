// SPDX-License-Identifier: MIT
// The search for the pose of one object, optionally with its size, or for the poses of a few objects: a
// System of lm_rules.h made of plain numbers, for kernels.
#pragma once

#include "base/rigid.h"
#include "optim/lm_rules.h"
#include "optim/prior_terms.h"

namespace sdftrack::optim {

// The quadratic model of an energy of P unknowns. Hessian: its lower triangle, row by row.
template <int P>
struct Quadratic {
  double cost = 0, count = 0;
  double gradient[P] = {};
  double hessian[P * (P + 1) / 2] = {};
};
HD constexpr int lower_at(int a, int b) { return a * (a + 1) / 2 + b; }  // b <= a

// Number of poses among P unknowns: six each; a seventh is the size of a single object.
template <int P>
constexpr int kPoses = P < 12 ? 1 : P / 6;

template <int P>
struct PosePoint {
  Rigidd T_obj_cam[kPoses<P>];
  double log_scale = 0;
};

// A Gaussian prior on the pose: PosePrior (prior.h) in plain numbers.
struct PriorTerm {
  bool given = false;
  Rigidd T_prior_inverse;
  double information[6][6] = {};

  // Adds the cost and, if requested, its derivatives with respect to the first six unknowns.
  HD void add(const Rigidd& T_obj_cam, double* cost, double* gradient, double* hessian) const {
    if (!given) return;
    PriorRow row;
    prior_row(T_obj_cam * T_prior_inverse, &row);
    double pull[6], weighted[6][6];  // I e, I J
    for (int a = 0; a < 6; ++a) {
      pull[a] = 0;
      for (int k = 0; k < 6; ++k) pull[a] += information[a][k] * row.e[k];
      for (int b = 0; b < 6; ++b) {
        weighted[a][b] = 0;
        for (int k = 0; k < 6; ++k) weighted[a][b] += information[a][k] * row.J[k][b];
      }
      *cost += 0.5 * row.e[a] * pull[a];
    }
    for (int a = 0; a < 6; ++a)
      for (int k = 0; k < 6; ++k) {
        gradient[a] += row.J[k][a] * pull[k];
        for (int b = 0; b <= a; ++b) hessian[lower_at(a, b)] += row.J[k][a] * weighted[k][b];
      }
  }
};

// Solves A x = y by L D L^T, in place of y; entry(a, b), b <= a, is an entry of A. False: x is not finite.
template <int P, class Entry>
HD bool solve_by_ldl(const Entry& entry, double* x) {
  double L[P][P], D[P];
  for (int a = 0; a < P; ++a) {
    for (int b = 0; b <= a; ++b) {
      double sum = entry(a, b);
      for (int k = 0; k < b; ++k) sum -= L[a][k] * D[k] * L[b][k];
      if (a == b)
        D[a] = sum;
      else
        L[a][b] = sum / D[b];
    }
  }
  for (int a = 0; a < P; ++a)
    for (int k = 0; k < a; ++k) x[a] -= L[a][k] * x[k];
  bool finite = true;
  for (int a = P; a-- > 0;) {
    x[a] /= D[a];
    for (int k = a + 1; k < P; ++k) x[a] -= L[k][a] * x[k];
    finite = finite && abs(x[a]) <= 1.7976931348623157e308;  // not NaN, not infinite
  }
  return finite;
}

// The damped step of a quadratic model; false: it is not finite.
template <int P>
HD bool find_damped_step(const Quadratic<P>& model, double damping, double* step) {
  double most = model.hessian[0];
  for (int a = 1; a < P; ++a) {
    const double d = model.hessian[lower_at(a, a)];
    most = most < d ? d : most;
  }
  const double floor = damping_floor(most);
  for (int a = 0; a < P; ++a) step[a] = -model.gradient[a];
  return solve_by_ldl<P>(
      [&](int a, int b) {
        const double value = model.hessian[lower_at(a, b)];
        return a == b ? damped(value, damping, floor) : value;
      },
      step);
}

// The state between two evaluations. As a Record of lm_rules.h it stores its steps where `kept` points.
template <int P>
struct PoseSearch {
  PosePoint<P> at, to;  // the current state, and the place of the next evaluation
  Quadratic<P> here;
  double step[P] = {};
  LmTrial trial;
  bool searching = true;
  double cost = 0, count = 0, damping = 0;
  Stop stop = Stop::kMaxSteps;
  int tried = 0;
  LmStep* kept = nullptr;

  HD void clear_steps() { tried = 0; }
  HD void add(const LmStep& one) { kept[tried++] = one; }
  HD int trials() const { return tried; }

  // Takes the evaluation at `to` and goes on to the next one, or ends. begins: it is the first.
  HD void looked(const Quadratic<P>& found, const LmRules& rules, bool begins);
};

template <int P>
struct PoseSystem {
  PoseSearch<P>& search;
  const Quadratic<P>& found;
  const LmRules& rules;

  HD double cost() const { return search.here.cost; }
  HD double count() const { return search.here.count; }
  HD bool has_data() const {
    bool some = false;
    for (int a = 0; a < P; ++a) some = some || search.here.hessian[lower_at(a, a)] > 0;
    return some;
  }
  HD bool find_step(double damping) { return find_damped_step<P>(search.here, damping, search.step); }
  HD Promise promised() const {
    double all = 0, most = 0;
    for (int object = 0; object < kPoses<P>; ++object) {
      const double own = promised(6 * object, object + 1 < kPoses<P> ? 6 * object + 6 : P);
      all += own, most = most < own ? own : most;
    }
    return {all, rules.block > 0 ? most : all};
  }
  // The gain due to the unknowns first .. last - 1.
  HD double promised(int first, int last) const {
    double linear = 0, bent = 0;
    for (int a = first; a < last; ++a) {
      double curved = 0;
      for (int b = 0; b < P; ++b)
        curved += search.here.hessian[b <= a ? lower_at(a, b) : lower_at(b, a)] * search.step[b];
      linear += search.here.gradient[a] * search.step[a], bent += search.step[a] * curved;
    }
    return -(linear + 0.5 * bent);
  }
  HD bool step_is_small() const {
    bool small = true;
    for (int a = 0; a < P; ++a) {
      const int k = P < 12 ? a : a % 6;
      const double limit = k < 3 ? rules.step_m : (k < 6 ? rules.step_rad : rules.step_relative);
      small = small && abs(search.step[a]) <= limit;
    }
    return small;
  }
  HD void move() {
    for (int k = 0; k < kPoses<P>; ++k) {
      const double* const d = search.step + 6 * k;
      search.to.T_obj_cam[k] =
          increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * search.at.T_obj_cam[k];
    }
    search.to.log_scale = search.at.log_scale + (P == 7 ? search.step[P - 1] : 0.0);
  }
  HD void accept(bool looked) {
    if (!looked) move();
    search.at = search.to;
    if (looked) search.here = found;
  }
};

template <int P>
HD void PoseSearch<P>::looked(const Quadratic<P>& found, const LmRules& rules, bool begins) {
  PoseSystem<P> system{*this, found, rules};
  if (begins) {
    here = found;
    searching = lm_begin(system, rules, this);
  } else {
    searching = lm_judge(system, rules, trial, found.cost, this);
  }
  searching = searching && lm_go_on(system, rules, this, &trial);
  if (searching) system.move();
}

}  // namespace sdftrack::optim
