// SPDX-License-Identifier: MIT
// One voxel of the evolution of a level set (docs/math/reconstruction.md, section 4).
#pragma once

#include "base/fast_math.h"
#include "base/lane.h"

namespace sdftrack::levelset {

// The neighbours of a voxel along one axis, as offsets into the volume. At a face of the volume the slope is
// taken to the only neighbour, and the energy counts half of the voxel. The mirrored neighbour and the
// weights of the flux follow from these two choices.
struct Neighbours {
  int before, after;                    // the voxel itself in place of a neighbour beyond the face
  float per;                            // factor from the difference of the two to a slope per voxel
  int mirrored_before, mirrored_after;  // the inner neighbour in place of one beyond the face
  float flux_before, flux_after;        // factors from the flux of `before`, `after` to its divergence
};

// The neighbours of voxel i of n along an axis with the given stride.
HD Neighbours neighbours(int i, int n, int stride) {
  const bool first = i == 0, last = i == n - 1;
  const int before = first ? 0 : -stride, after = last ? 0 : stride;
  if (first) return {before, after, 1, after, after, 1, 1};
  if (last) return {before, after, 1, before, before, -1, -1};
  return {before, after, 0.5f, before, after, -0.5f, 0.5f};
}

// Heaviside (4.38), positive outside: 1 / (1 + e^-x).
template <class T>
HD T heaviside(T x) {
  const T e = exp_negative(T(-1) * abs(x)), far = T(1) / (T(1) + e);
  return select(x < T(0), T(1) - far, far);
}

// Slope of the potential of |grad phi| over |grad phi|, minus 1, the value of a harmonic function.
template <class T>
HD T excess_diffusivity(T square, bool printed) {
  const T s = sqrt(select(square > T(1e-4f), square, T(1e-4f)));  // below, the direction is noise
  const T beyond = T(-1) / s;
  if (printed) return beyond;
  // sin(2 pi s) / (2 pi s) - 1 for s < 1, by the minimax polynomial in s^2, error 2e-6.
  const T y = select(square < T(1), square, T(1));
  const T within =
      y * (T(-6.5797348f) +
           y * (T(12.9877491f) +
                y * (T(-12.2060146f) +
                     y * (T(6.68101311f) +
                          y * (T(-2.36473298f) + y * (T(0.550262272f) + y * T(-0.0685430318f)))))));
  return select(square < T(1), within, beyond);
}

// Slope of phi along an axis, per voxel.
template <class T>
HD T slope_along(const Neighbours& at, const float* phi, int n) {
  return T(at.per) * (load<T>(phi + at.after, n) - load<T>(phi + at.before, n));
}

template <class T>
struct EvolveTerm {
  float inv_sigma_h, mu, dt;  // mu: 1 / sigma_phi^2; lengths in voxels
  bool printed;

  // The share of the slopes along x, y and z that flows in addition to the Laplacian; phi: at the voxel.
  HD T excess(const Neighbours* at, const float* phi, int n, T* slope) const {
    T square(0);
    for (int k = 0; k < 3; ++k) {
      slope[k] = slope_along<T>(at[k], phi, n);
      square += slope[k] * slope[k];
    }
    return excess_diffusivity(square, printed);
  }

  // The flux along x, y and z.
  HD void flux(const Neighbours* at, const float* phi, int n, T* out) const {
    const T flows = excess(at, phi, n, out);
    for (int k = 0; k < 3; ++k) out[k] = flows * out[k];
  }

  // The voxel's value after a step. flux: along x, y and z, at the voxel.
  HD T step(const Neighbours* at, const float* phi, const float* log_ratio, const float* const* flux,
            int n) const {
    const T own = load<T>(phi, n), x = T(inv_sigma_h) * own;
    T smooth(0);
    for (int k = 0; k < 3; ++k) {
      smooth += load<T>(phi + at[k].mirrored_after, n) + load<T>(phi + at[k].mirrored_before, n) -
                T(2) * own + T(at[k].flux_after) * load<T>(flux[k] + at[k].after, n) +
                T(at[k].flux_before) * load<T>(flux[k] + at[k].before, n);
    }
    const T data = T(inv_sigma_h) * (heaviside(x - load<T>(log_ratio, n)) - heaviside(x));
    return own + T(dt) * (data + T(mu) * smooth);
  }
};

}  // namespace sdftrack::levelset
