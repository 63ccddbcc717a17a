// SPDX-License-Identifier: MIT
// One voxel of the evolution of a level set (docs/math/reconstruction.md, section 4).
#pragma once

#include "base/fast_math.h"
#include "base/lane.h"

namespace sdftrack::levelset {

// The neighbours of a voxel along one axis, as offsets into the volume. At a face of the volume the slope is
// that to the one neighbour there is, and the energy counts half of the voxel: what follows from these two
// are the mirrored neighbour and the weights of the flux.
struct Neighbours {
  int before, after;                    // the voxel itself in place of one beyond the face
  float per;                            // from the difference between the two to a slope per voxel
  int mirrored_before, mirrored_after;  // the neighbour within in place of one beyond the face
  float flux_before, flux_after;        // what takes the flux of the first two to its divergence
};

// Of voxel i of n along an axis whose voxels lie `stride` apart.
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

// Slope of the potential of |grad phi| over |grad phi|, less that of a harmonic function, which is 1.
template <class T>
HD T excess_diffusivity(T square, bool printed) {
  const T s = sqrt(select(square > T(1e-4f), square, T(1e-4f)));  // the direction of less is noise
  const T beyond = T(-1) / s;
  if (printed) return beyond;
  // sin(2 pi s) / (2 pi s) - 1 for s < 1, by the polynomial in s^2 of least greatest error, 2e-6.
  const T y = select(square < T(1), square, T(1));
  const T within =
      y * (T(-6.5797348f) +
           y * (T(12.9877491f) +
                y * (T(-12.2060146f) +
                     y * (T(6.68101311f) +
                          y * (T(-2.36473298f) + y * (T(0.550262272f) + y * T(-0.0685430318f)))))));
  return select(square < T(1), within, beyond);
}

// Of phi along an axis, per voxel.
template <class T>
HD T slope_along(const Neighbours& at, const float* phi, int n) {
  return T(at.per) * (load<T>(phi + at.after, n) - load<T>(phi + at.before, n));
}

template <class T>
struct EvolveTerm {
  float inv_sigma_h, mu, dt;  // mu: 1 / sigma_phi^2; lengths in voxels
  bool printed;

  // What of the slopes along x, y and z flows beside the Laplacian; phi: at the voxel.
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

  // The voxel a step later. flux: along x, y and z, at the voxel.
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
