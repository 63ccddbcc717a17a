// SPDX-License-Identifier: MIT
// The evidence of one frame on one voxel: inside or outside (docs/math/reconstruction.md, section 1).
#pragma once

#include "base/camera.h"
#include "base/fast_math.h"
#include "base/vec.h"
#include "levelset/eikonal_terms.h"

namespace sdftrack::levelset {

struct EvidenceForm {
  bool printed = false;      // thesis Eqs. 4.29 to 4.31: infinite at the surface, here limited to +-10
  float sigma_d_m = 0.003f;  // decay length of the evidence behind and in front of a measurement
};

constexpr float kMaxSmooth = 0.9f;         // limit of |q|; a log ratio of 2.9
constexpr float kMaxPrinted = 0.9999092f;  // limit of |q|; a log ratio of 10
constexpr float kReachPerSigma = 2.0f;     // no evidence farther behind the surface; in front, only carving
constexpr float kPrintedReach = 16;        // of the printed form, which has no end: 1e-7 is left here

// log(L_in / L_out) of a voxel d metres behind a measurement (in front: negative) with noise `noise_m`.
template <class T>
HD T log_ratio(T d_m, T noise_m, const EvidenceForm& form) {
  using S = ScalarOf<T>;
  const T away = T(S(1) / S(form.sigma_d_m)) * abs(d_m);
  const T fading = exp_negative(T(-1) * select(away < T(40), away, T(40)));
  const T sure = form.printed ? select(d_m > T(0), T(1), select(d_m < T(0), T(-1), T(0)))
                              : fast_erf(d_m / (T(S(1.4142135623730951)) * noise_m));
  const T most = T(S(form.printed ? kMaxPrinted : kMaxSmooth)), q = fading * sure;
  const T kept = select(q > most, most, select(q < T(-1) * most, T(-1) * most, q));
  return log_positive((T(1) + kept) / (T(1) - kept));
}

// A pixel of a frame prepared for fusion (evidence_image.h).
struct EvidencePixel {
  float depth_m;  // at the pixel's centre
  float slant;    // distance from the surface over difference in depth; kCarves: evidence only on empty space
                  // in front; 0: no evidence
  float du_m, dv_m;  // slope of the depth per pixel
};
constexpr float kCarves = -1.0f;
constexpr float kCarvesFaintly = -2.0f;  // next to an outline: carves only where no surface is known
constexpr float kFaint = 0.01f;          // share of the usual weight
constexpr float kFaintMean = -0.02f;     // mean log ratio; more would pull the nearby surface inwards
constexpr float kUnknownWeight = 0.02f;  // limit for a voxel with evidence only from faint carving

struct SensorNoise {
  float noise_m, noise_per_m;  // sd of a measurement at depth Z: noise_m + noise_per_m Z^2
  float min_m;                 // least sd of the distance from the surface, which a voxel can resolve
  float usual_m;               // the noise at which a measurement, seen head on, has weight 1
};

// The evidence of one frame on a voxel.
template <class T>
struct Evidence {
  T log_ratio, weight;
  T distance_m;  // behind the surface; a large number where no surface is measured
};

constexpr float kNoSurface_m = 1e6f;
constexpr float kCarvedRatio = -1.0f;  // of one frame that sees past the voxel
// The weight at which the mean equals that of a voxel well in front of a surface.
constexpr float kCarvedWeight = 1.0f / 2.94443897f;
// Above this weight and below this mean a voxel needs no more carving.
constexpr float kEmptyWeight = 4 * kCarvedWeight;
constexpr float kEmptyMean = 0.9f * kCarvedRatio / kCarvedWeight;

template <class T>
struct EvidenceTerm {
  const float* pixels;  // EvidencePixel, height * width
  int x0, y0, width, height;
  Intrinsics<float> K;
  EvidenceForm form;
  SensorNoise noise;
  float carve_from_m;  // in front of the surface
  float min_slant;

  template <class U>
  HD EvidenceTerm<U> cast() const {
    return {pixels, x0, y0, width, height, K, form, noise, carve_from_m, min_slant};
  }

  HD Evidence<T> at(Vec3<T> p_cam) const {
    const T z = select(p_cam.z > T(0.01f), p_cam.z, T(0.01f)), inv_z = T(1) / z;
    const T u = T(K.fx) * p_cam.x * inv_z + T(K.cx - float(x0)),
            v = T(K.fy) * p_cam.y * inv_z + T(K.cy - float(y0));
    const T right = T(float(width) - 0.51f), low = T(float(height) - 0.51f);
    const auto seen = (p_cam.z > T(0.01f)) & (u > T(-0.49f)) & (v > T(-0.49f)) & (u < right) & (v < low);
    const T uc = select(seen, u, T(0)), vc = select(seen, v, T(0));
    const IntOf<T> ui = truncate(uc + T(0.5f)), vi = truncate(vc + T(0.5f)), i = (vi * width + ui) * 4;
    const T slant = select(seen, gather<T>(pixels + 1, i), T(0));
    if (form.printed) return along_ray(p_cam, real<T>(ui), real<T>(vi), gather<T>(pixels, i), slant);
    const T depth = gather<T>(pixels, i) + gather<T>(pixels + 2, i) * (uc - real<T>(ui)) +
                    gather<T>(pixels + 3, i) * (vc - real<T>(vi));
    return judge(z - depth, depth, slant);
  }

 private:
  // (4.29) to (4.31): the voxel's range along the ray of the nearest pixel minus the measured range. All
  // measurements count alike, whatever their slope and noise; the space in front is not carved.
  HD Evidence<T> along_ray(Vec3<T> p_cam, T ui, T vi, T depth, T slant) const {
    const T x = (ui - T(K.cx - float(x0))) * T(1 / K.fx), y = (vi - T(K.cy - float(y0))) * T(1 / K.fy);
    const T length = sqrt(x * x + y * y + T(1));
    const T behind_m = (p_cam.x * x + p_cam.y * y + p_cam.z) / length - depth * length;
    const auto says = (slant > T(0)) & (abs(behind_m) < T(kPrintedReach * form.sigma_d_m));
    return {select(says, log_ratio(behind_m, T(1), form), T(0)), select(says, T(1), T(0)),
            select(says, behind_m, T(kNoSurface_m))};
  }

  HD Evidence<T> judge(T behind_m, T depth, T slant) const {
    const auto surface = slant > T(0);
    const auto readable = surface | (slant < T(0));  // int for floats, not bool
    const T d = behind_m * select(surface, slant, T(1));
    const T sensor = T(noise.noise_m) + T(noise.noise_per_m) * depth * depth;
    const T blur = select(sensor > T(noise.min_m), sensor, T(noise.min_m));
    const T quality = T(noise.usual_m) / blur;
    const auto near = surface & (slant > T(min_slant)) & (d < T(kReachPerSigma * form.sigma_d_m));
    const T weight = select(near, slant * quality * quality, T(0));
    const auto close = near & (d > T(-kReachPerSigma * form.sigma_d_m));
    const T ratio = any(close) ? select(close, weight * log_ratio(d, blur, form), T(0)) : T(0);
    const T from = select(T(3) * blur > T(carve_from_m), T(3) * blur, T(carve_from_m));
    const auto carved = readable & (d < T(-1) * from);
    // Just in front of the surface a measurement's log ratio can be stronger than that of carving.
    const auto stronger = close & (ratio < T(kCarvedRatio));
    const auto faint = slant < T(0.5f * (kCarves + kCarvesFaintly));
    const T past_weight = select(faint, T(kFaint * kCarvedWeight), T(kCarvedWeight)),
            past_ratio = select(faint, T(kFaintMean * kFaint * kCarvedWeight), T(kCarvedRatio));
    const T carved_ratio = select(stronger, ratio, past_ratio),
            carved_weight = select(stronger, weight, past_weight);
    return {select(carved, carved_ratio, ratio), select(carved, carved_weight, weight),
            select(near, d, T(kNoSurface_m))};
  }
};

// A voxel after a frame.
template <class T>
struct FusedVoxel {
  T log_ratio, weight;
  MaskOf<T> turned;  // changed between inside and outside, or is known for the first time
  MaskOf<T> inside;
  MaskOf<T> unsure;  // not outside with the highest certainty
};

// own and before: the voxel's log ratio and weight so far.
template <class T>
HD FusedVoxel<T> fused(const Evidence<T>& evidence, T own, T before, T limit, bool printed) {
  // Where there is other evidence, faint carving would erode rims that are seldom seen.
  const auto idle = (evidence.weight < T(2 * kFaint * kCarvedWeight)) & (before > T(kUnknownWeight));
  const T more = select(idle, T(0), evidence.weight), sum = before + more;
  const auto first = (before == T(0)) & (more > T(0));
  // The prior counts until the first evidence; in the printed form it remains as a factor (4.35).
  const T known = printed ? own : select(first, T(0), own);
  const T kept = any(sum > limit) ? select(sum > limit, limit / sum, T(1)) : T(1);
  FusedVoxel<T> out;
  out.log_ratio = kept * (known + select(idle, T(0), evidence.log_ratio)), out.weight = kept * sum;
  out.inside = out.log_ratio > T(0);
  const T was = select(own > T(0), T(1), T(0)), is = select(out.inside, T(1), T(0));
  out.turned = (was != is) | first;
  out.unsure = (out.weight < T(kEmptyWeight)) | (out.log_ratio >= T(kEmptyMean) * out.weight);
  return out;
}

}  // namespace sdftrack::levelset
