// SPDX-License-Identifier: MIT
// The terms of beside.h on the GPU. One block sums each term, with the formulas of the CPU.
#pragma once

#include "energies/beside.h"
#include "energies/reduce_cuda.cuh"

namespace sdftrack::energies {

// A quadratic model in parts, and the index at which an object's unknowns start in it.
struct ModelOf {
  double *cost, *gradient, *hessian;  // hessian: lower triangle
  int first;

  // own: cost, gradient and lower triangle of six unknowns.
  __device__ void add(double weight, const double* own) const {
    *cost += weight * own[0];
    for (int a = 0; a < 6; ++a) {
      gradient[first + a] += weight * own[1 + a];
      for (int b = 0; b <= a; ++b)
        hessian[optim::lower_at(first + a, first + b)] += weight * own[7 + optim::lower_at(a, b)];
    }
  }
};

__device__ inline void sum_free_space(OutlineTerm<float> term, const Rigidd& T_obj_cam, double* out) {
  term.T_obj_cam = T_obj_cam.template cast<float>();
  term.T_cam_obj = inverse(T_obj_cam).template cast<float>();
  float sums[kSummed<6>] = {};
  for (int k = int(threadIdx.x); k < term.points_obj.count(); k += kBlockThreads)
    add_contribution(term.linearize(k), sums);
  add_over_block(sums, out);
}

// Improves the tone by one round of reweighted least squares.
__device__ inline void improve_tone(const Brightness& given, double* tone) {
  constexpr int N = kTone + kTone * (kTone + 1) / 2;
  SDFTRACK_SHARED(double[N], total);
  double sums[N] = {};
  for (int i = int(threadIdx.x); i < given.count; i += kBlockThreads) {
    const PhotometricHit& hit = given.hits[i];
    double basis[kTone];
    PhotometricTerm::basis(hit, basis);
    const double weight = given.term.weight(PhotometricTerm::residual(tone, basis, hit));
    for (int a = 0; a < kTone; ++a) {
      sums[a] += weight * hit.grey_seen * basis[a];
      for (int b = 0; b <= a; ++b) sums[kTone + optim::lower_at(a, b)] += weight * basis[a] * basis[b];
    }
  }
  add_over_block(sums, total);
  __syncthreads();
  if (threadIdx.x == 0) {
    const double* const prior = given.term.tone_prior;
    for (int a = 0; a < kTone; ++a) tone[a] = total[a] + prior[a] * PhotometricTerm::usual_tone(a);
    optim::solve_by_ldl<kTone>(
        [&](int a, int b) { return total[kTone + optim::lower_at(a, b)] + (a == b ? prior[a] : 0.0); }, tone);
  }
  __syncthreads();
}

// Eliminates all but the first `kept` of N unknowns from a model, by minimising over the others.
template <int N>
__device__ void eliminate_last(int kept, double* gradient, double* hessian) {
  for (int k = N - 1; k >= kept; --k)
    for (int a = 0; a < k; ++a) {
      const double share = hessian[optim::lower_at(k, a)] / hessian[optim::lower_at(k, k)];
      gradient[a] -= share * gradient[k];
      for (int b = 0; b <= a; ++b) hessian[optim::lower_at(a, b)] -= share * hessian[optim::lower_at(k, b)];
    }
}

// As PhotometricEnergy::linearize; `follow`: the pose differs from that of the hits.
__device__ inline void sum_brightness(Brightness* given, const Rigidd& T_obj_cam, bool follow, double* out) {
  SDFTRACK_SHARED(double[kTone], tone);
  SDFTRACK_SHARED(double[kSummed<kToned>], total);
  const int first = int(threadIdx.x);
  for (int i = first; follow && i < given->count; i += kBlockThreads) {
    PhotometricHit hit = given->hits[i];
    if (!given->term.find(T_obj_cam, kFollowSteps, &hit)) hit.fall_silent();
    given->hits[i] = hit;  // only this thread uses hit i, here and below
  }
  if (first < kTone) tone[first] = given->tone[first];
  __syncthreads();
  for (int round = 0; round < kToneRounds; ++round) improve_tone(*given, tone);
  double sums[kSummed<kToned>] = {};
  for (int i = first; i < given->count; i += kBlockThreads) {
    const PhotometricHit& hit = given->hits[i];
    double basis[kTone];
    Contribution<double, kToned> own;
    PhotometricTerm::basis(hit, basis);
    PhotometricTerm::row(tone, basis, hit, own.J);
    const double r = PhotometricTerm::residual(tone, basis, hit);
    own.cost = given->term.loss(r), own.curvature = given->term.weight(r), own.slope = own.curvature * r;
    add_contribution(own, sums);
  }
  add_over_block(sums, total);
  __syncthreads();
  if (first < kTone) given->tone[first] = tone[first];
  if (first != 0) return;
  double *const gradient = total + 1, *const hessian = total + 1 + kToned;
  for (int k = 0; k < kTone; ++k) {
    const double prior = given->term.tone_prior[k], off = tone[k] - PhotometricTerm::usual_tone(k);
    total[0] += 0.5 * prior * off * off;
    gradient[6 + k] += prior * off;
    hessian[optim::lower_at(6 + k, 6 + k)] += prior;
  }
  eliminate_last<kToned>(6, gradient, hessian);
  for (int k = 0; k < 7; ++k) out[k] = total[k];
  for (int k = 0; k < 21; ++k) out[7 + k] = hessian[k];
}

// The best offset common to all lines.
__device__ inline double common_offset(const OutlineLinesTerm& given, const Rigidd& T_cam_obj) {
  SDFTRACK_SHARED(double[3], total);
  if (!(given.hold > 0)) return 0;
  double b = 0;
  for (int k = 0; k < kOffsetSteps; ++k) {
    CommonOffset own{};
    for (int i = int(threadIdx.x); i < given.count; i += kBlockThreads) {
      double off_px;
      PixelJacobian unused;
      if (!given.find(given.lines[i], T_cam_obj, &off_px, &unused)) continue;
      const double per_sd = given.per_sd(given.lines[i]);
      own.add(off_px - b, per_sd * per_sd);
    }
    const double sums[3] = {own.slope, own.steep, own.curved};
    __syncthreads();  // all threads have read the last sums
    add_over_block(sums, total);
    __syncthreads();
    const CommonOffset at = given.begin_offset(b);
    const CommonOffset all{at.slope + total[0], at.steep + total[1], at.curved + total[2]};
    b -= all.step();
    if (all.settled()) break;
  }
  return b;
}

// As OutlineEnergy::linearize.
__device__ inline void sum_lines(const OutlineLinesTerm& given, const Rigidd& T_obj_cam, double* out) {
  constexpr int kWeightAt = kSummed<6>, kRowAt = kWeightAt + 1,
                N = kRowAt + 6;  // Hessian block of pose and offset
  SDFTRACK_SHARED(double[N], total);
  const Rigidd T_cam_obj = inverse(T_obj_cam);
  const double common_px = common_offset(given, T_cam_obj);
  double sums[N] = {};
  for (int i = int(threadIdx.x); i < given.count; i += kBlockThreads) {
    const OutlineLine& line = given.lines[i];
    double off_px;
    Contribution<double, 6> own;
    PixelJacobian of_pixel;
    if (!given.find(line, T_cam_obj, &off_px, &of_pixel)) continue;
    const double per_sd = given.per_sd(line), r = (off_px - common_px) * per_sd;
    const double weight = 1 / (1 + 0.5 * r * r);
    OutlineLinesTerm::row(line, T_obj_cam, of_pixel, per_sd, own.J);
    own.cost = std::log1p(0.5 * r * r), own.slope = weight * r, own.curvature = weight;
    add_contribution(own, sums);
    sums[kWeightAt] += weight * per_sd * per_sd;
    for (int a = 0; a < 6; ++a) sums[kRowAt + a] += weight * per_sd * own.J[a];
  }
  __syncthreads();
  add_over_block(sums, total);
  __syncthreads();
  if (threadIdx.x != 0) return;
  const double all = given.hold + total[kWeightAt], per_all = given.hold > 0 ? 1 / all : 0;
  total[0] += 0.5 * given.hold * common_px * common_px;
  for (int k = 0; k < 7; ++k) out[k] = total[k];
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b <= a; ++b) {
      const int k = 7 + optim::lower_at(a, b);
      out[k] = total[k] - per_all * total[kRowAt + a] * total[kRowAt + b];
    }
}

// Adds all terms of one object's Beside. Called by all threads of the block; thread 0 adds.
__device__ inline void add_beside(Beside* given, const Rigidd& T_obj_cam, bool begins, const ModelOf& model) {
  SDFTRACK_SHARED(double[kSummed<6>], own);
  const bool adds = threadIdx.x == 0;
  if (given->outline.points_obj.n > 0) {
    sum_free_space(given->outline, T_obj_cam, own);
    __syncthreads();
    if (adds) model.add(given->outline_weight, own);
    __syncthreads();
  }
  if (given->brightness.count > 0) {
    sum_brightness(&given->brightness, T_obj_cam, !begins, own);
    if (adds) model.add(given->brightness_weight, own);
    __syncthreads();
  }
  if (given->lines.count > 0) {
    sum_lines(given->lines, T_obj_cam, own);
    if (adds) model.add(given->lines_weight, own);
    __syncthreads();
  }
  if (!adds || !given->prior.given) return;
  double of_prior[kSummed<6>] = {};
  given->prior.add(T_obj_cam, &of_prior[0], of_prior + 1, of_prior + 7);
  model.add(1, of_prior);
}

}  // namespace sdftrack::energies
