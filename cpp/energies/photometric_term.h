// SPDX-License-Identifier: MIT
// The brightness residual of one pixel, as plain numbers for the CPU and for kernels (photometric.h).
#pragma once

#include <cmath>

#include "base/rigid.h"
#include "energies/color_field.h"

namespace sdftrack::energies {

constexpr int kTone = 5;           // how a frame shows the surface's brightness: gain, shading (3), offset
constexpr int kToned = 6 + kTone;  // unknowns of the pose and of the tone
constexpr int kFollowSteps = 2, kToneRounds = 2;  // for a hit and for the tone, per evaluation
constexpr double kMinSlant = 0.25;                // least cosine between ray and surface normal

// A pixel that shows the surface: where its ray meets it, and what is seen there.
struct PhotometricHit {
  Vec3d ray_cam, normal_cam;  // the normal at the pose where the pixels were chosen
  double depth_m;             // of the hit
  double grey_seen, grey;     // brightness of the pixel, of the surface
  double J[6];                // d grey / d increment

  // A pixel whose ray leaves the known colours keeps its brightness and gets a zero Jacobian: if it cost
  // something, the border of the known colours would hold the pose.
  HD void fall_silent() {
    for (double& one : J) one = 0;
  }
};

struct PhotometricTerm {
  SdfView sdf{};
  ColorView colors{};
  double inv_sigma2 = 0;
  double tone_prior[kTone] = {};  // inverse variances, about a frame that shows the brightness unchanged

  // Searches from hit->depth_m. False, and the hit unchanged, where the ray leaves the known colours.
  HD bool find(const Rigidd& T_obj_cam, int steps, PhotometricHit* hit) const {
    const Vec3d along = T_obj_cam.R * hit->ray_cam;
    double depth_m = hit->depth_m, phi = 0, slope = 0, grey;
    Vec3d normal{0, 0, 0}, rise;
    for (int step = 0; step < steps; ++step) {
      sample(sdf, T_obj_cam.t + depth_m * along, &phi, &normal);
      slope = dot(normal, along);
      if (!(slope < -kMinSlant * norm(along) * norm(normal))) return false;
      depth_m -= phi / slope;
    }
    if (!(abs(phi) < double(sdf.voxel_m))) return false;
    const Vec3d p = T_obj_cam.t + depth_m * along;
    if (!sample_brightness(sdf, colors, p, &grey, &rise)) return false;
    // The hit slides along its ray so that it stays on the surface.
    const Vec3d G = rise - (dot(rise, along) / slope) * normal, turn = cross(p, G);
    hit->depth_m = depth_m, hit->grey = grey;
    hit->J[0] = G.x, hit->J[1] = G.y, hit->J[2] = G.z;
    hit->J[3] = turn.x, hit->J[4] = turn.y, hit->J[5] = turn.z;
    return true;
  }

  // The residual is linear in the tone; these are the factors of its parts.
  HD static void basis(const PhotometricHit& hit, double* out) {
    out[0] = hit.grey;
    out[1] = hit.grey * hit.normal_cam.x, out[2] = hit.grey * hit.normal_cam.y;
    out[3] = hit.grey * hit.normal_cam.z, out[4] = 1;
  }
  HD static double residual(const double* tone, const double* basis, const PhotometricHit& hit) {
    double sum = 0;
    for (int k = 0; k < kTone; ++k) sum += tone[k] * basis[k];
    return sum - hit.grey_seen;
  }
  // psi(r) / r of log(1 + r^2 / (2 sigma^2)).
  HD double weight(double r) const { return inv_sigma2 / (1 + 0.5 * r * r * inv_sigma2); }
  HD double loss(double r) const { return std::log1p(0.5 * r * r * inv_sigma2); }
  // d residual / d (pose, tone).
  HD static void row(const double* tone, const double* basis, const PhotometricHit& hit, double* out) {
    const double light = tone[0] + dot(Vec3d{tone[1], tone[2], tone[3]}, hit.normal_cam);
    for (int k = 0; k < 6; ++k) out[k] = light * hit.J[k];
    for (int k = 0; k < kTone; ++k) out[6 + k] = basis[k];
  }
  HD static double usual_tone(int k) { return k == 0 ? 1 : 0; }
};

// An energy as it is sent to a device, with the hits and the tone of its last evaluation.
struct Brightness {
  PhotometricTerm term{};
  PhotometricHit* hits = nullptr;
  int count = 0;  // 0: this term is left out
  double tone[kTone] = {};
};

}  // namespace sdftrack::energies
