// SPDX-License-Identifier: MIT
#include "energies/sdf_energy.h"

#include <stdexcept>
#include <type_traits>
#include <utility>

#include "energies/reduce_cpu.h"

namespace sdftrack {

namespace {

enum class Pair { kPose, kPoseAndScale, kPoseAndIntrinsics };

Pair pair_of(const SdfEnergyOptions& options) {
  if (options.scale && options.intrinsics)
    throw std::invalid_argument(
        "unknowns: pose, scale and intrinsics together are not compiled; expected at most two");
  return options.scale ? Pair::kPoseAndScale : (options.intrinsics ? Pair::kPoseAndIntrinsics : Pair::kPose);
}

void make(const SdfView& sdf, const State& x, SingleObject<float>* field) {
  *field = {sdf, x.T_obj_cam[0].cast<float>()};
}
void make(const SdfView& sdf, const State& x, ScaledObject<float>* field) {
  *field = {sdf, x.T_obj_cam[0].cast<float>(), static_cast<float>(std::exp(x.log_scale.at(0)))};
}
template <class Inner>
void make(const SdfView& sdf, const State& x, WithIntrinsics<Inner>* field) {
  make(sdf, x, &field->field);
  field->K = x.K.cast<float>();
}

template <int P>
void add_to(const Sums<double, P>& sums, NormalEquations* out) {
  int k = 0;
  for (int a = 0; a < P; ++a) {
    out->gradient[a] += sums.gradient[a];
    for (int b = 0; b <= a; ++b, ++k) {
      out->hessian(a, b) += sums.hessian[k];
      if (a != b) out->hessian(b, a) += sums.hessian[k];
    }
  }
  out->cost += sums.cost;
  out->count += sums.count;
}

struct CostSum {
  double cost = 0;
  void operator+=(const CostSum& o) { cost += o.cost; }
};

template <int P>
struct SandwichSums {
  double A[P][P] = {}, B[P][P] = {}, geometry[P][P] = {}, inliers = 0;
  void operator+=(const SandwichSums& o) {
    for (int a = 0; a < P; ++a)
      for (int b = 0; b < P; ++b)
        A[a][b] += o.A[a][b], B[a][b] += o.B[a][b], geometry[a][b] += o.geometry[a][b];
    inliers += o.inliers;
  }
};

template <int P>
void add_outer(const float (&J)[P], double weight, double (&sum)[P][P]) {
  for (int a = 0; a < P; ++a)
    for (int b = 0; b < P; ++b) sum[a][b] += weight * static_cast<double>(J[a]) * static_cast<double>(J[b]);
}

template <int P>
Eigen::MatrixXd to_matrix(const double (&sum)[P][P]) {
  Eigen::MatrixXd M(P, P);
  for (int a = 0; a < P; ++a)
    for (int b = 0; b < P; ++b) M(a, b) = sum[a][b];
  return M;
}

}  // namespace

template <class Visit>
void SdfEnergy::with_term(const State& x, bool reclassify, const Visit& visit) {
  const auto run = [&]<class Field, class Penalty>(std::type_identity<std::pair<Field, Penalty>>) {
    Term<Field, Penalty> term{{},
                              {options_.scale_m, options_.outlier_floor, options_.curvature},
                              x.K.cast<float>(),
                              pixels_->view(),
                              options_.residual,
                              reclassify,
                              options_.warm_hits ? 1 : 8};
    make(sdf_, x, &term.field);
    visit(term);
  };
  switch (pair_of(options_)) {
#define SDFTRACK_PAIR(name, field, penalty)               \
  case Pair::name:                                        \
    run(std::type_identity<std::pair<field, penalty>>{}); \
    break;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
  }
}

void SdfEnergy::linearize(const State& x, NormalEquations* out) {
  with_term(x, options_.warm_hits, [&](const auto& term) {
    constexpr int P = std::decay_t<decltype(term)>::P;
    add_to(reduce_cpu<Sums<double, P>>(term.pixels.count, options_.threads,
                                       [&](int i, Sums<double, P>* sums) { term.linearize(i, sums); }),
           out);
  });
}

double SdfEnergy::cost(const State& x) {
  double cost = 0;
  with_term(x, false, [&](const auto& term) {
    cost = reduce_cpu<CostSum>(term.pixels.count, options_.threads, [&](int i, CostSum* sum) {
             sum->cost += static_cast<double>(term.cost(i));
           }).cost;
  });
  return cost;
}

void SdfEnergy::accept() {
  if (options_.warm_hits) pixels_->hit_m.swap(pixels_->trial_hit_m);
}

void SdfEnergy::classify(const State& x, int steps) {
  pixels_->hit_m = pixels_->depth_m;
  if (options_.residual != Residual::kRayHit) steps = 1;
  with_term(x, true, [&](auto& term) {
    constexpr int P = std::decay_t<decltype(term)>::P;
    term.newton_steps = 1;  // from the buffer, which starts at the measured depth
    for (int k = 0; k < steps; ++k)
      for (int i = 0; i < term.pixels.count; ++i) {
        FieldRow<float, P> row;
        term.read(i, &row);
      }
  });
}

Sandwich SdfEnergy::sandwich(const State& x) {
  Sandwich out;
  with_term(x, false, [&](const auto& term) {
    constexpr int P = std::decay_t<decltype(term)>::P;
    const auto sums =
        reduce_cpu<SandwichSums<P>>(term.pixels.count, options_.threads, [&](int i, SandwichSums<P>* sum) {
          FieldRow<float, P> row;
          const auto reading = term.read(i, &row);
          const float noise = term.pixels.noise_scale[i];
          const Curve<float> curve = term.penalty(reading.residual_m, noise);
          const double gain2 = static_cast<double>(reading.gain) * reading.gain;
          const double slope2 = static_cast<double>(curve.slope) * curve.slope;
          add_outer(row.J, gain2 * term.penalty.second_derivative(reading.residual_m, noise), sum->A);
          add_outer(row.J, gain2 * slope2, sum->B);
          const float s = options_.scale_m * noise;
          if (curve.curvature * 4 * s * s > 1) {  // half of the weight that a residual of 0 has
            add_outer(row.J, 1.0, sum->geometry);
            sum->inliers += 1;
          }
        });
    out = {to_matrix(sums.A), to_matrix(sums.B), to_matrix(sums.geometry), sums.inliers};
  });
  return out;
}

void SdfEnergy::read(const State& x, PixelReadings* out) {
  const auto n = static_cast<std::size_t>(pixels_->count());
  out->residual_m.resize(n), out->weight.resize(n), out->hit.resize(n);
  with_term(x, false, [&](const auto& term) {
    for (int i = 0; i < term.pixels.count; ++i) {
      FieldRow<float, std::decay_t<decltype(term)>::P> row;
      const auto reading = term.read(i, &row);
      const auto j = static_cast<std::size_t>(i);
      out->residual_m[j] = reading.residual_m;
      out->weight[j] = term.penalty(reading.residual_m, term.pixels.noise_scale[i]).curvature;
      out->hit[j] = term.pixels.gain[i] == 0.0f;
    }
  });
}

}  // namespace sdftrack
