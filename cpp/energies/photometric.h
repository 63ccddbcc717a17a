// SPDX-License-Identifier: MIT
// Energy of a pose from the brightness of the pixels: the colours of the surface determine the rotations and
// shifts that its shape leaves free (docs/math/photometric.md).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/photometric_term.h"
#include "optim/energy.h"

namespace sdftrack::energies {

// Pixels with a measured depth and a brightness (0..1).
struct GreyPixels {
  std::vector<float> u_px, v_px, depth_m, grey;

  int count() const { return int(depth_m.size()); }
  void clear() { u_px.clear(), v_px.clear(), depth_m.clear(), grey.clear(); }
  void push(float u, float v, float depth, float g) {
    u_px.push_back(u), v_px.push_back(v), depth_m.push_back(depth), grey.push_back(g);
  }
};

struct PhotometricOptions {
  double sigma = 0.03;         // sd of a brightness, as a share of its full range
  double gain_sigma = 0.2;     // of the frame's gain about 1,
  double shading_sigma = 0.2;  // of the gain's change with the surface normal,
  double offset_sigma = 0.2;   // and of its offset about 0
};

// E = sum_i log(1 + r_i^2 / (2 sigma^2)), r_i = (gain + shading . n_i) g(hit_i) + offset - grey_i, with the
// gain, shading and offset of the frame that minimise it: a change of light or exposure does not move the
// pose. The hits stay on the surface while the object moves.
class PhotometricEnergy final : public optim::Energy {
 public:
  // How the frame shows the surface's brightness: gain, shading (3), offset.
  using Tone = Eigen::Matrix<double, kTone, 1>;

  PhotometricEnergy(const SdfView& sdf, const ColorView& colors, const GreyPixels* pixels,
                    const PhotometricOptions& options, std::vector<PhotometricHit>* hits)
      : term_(term_of(sdf, colors, options)), pixels_(pixels), hits_(hits) {}

  // Decides once which pixels show the surface at x, so that costs may be compared. Returns their number.
  int settle(const optim::State& x);
  int used() const { return int(hits_->size()); }

  optim::Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;
  const Tone& tone() const { return tone_; }
  // The term in its present state, to send to a device; still in host memory.
  Brightness on_device() const;

 private:
  static PhotometricTerm term_of(const SdfView& sdf, const ColorView& colors,
                                 const PhotometricOptions& options);
  void follow(const Rigidd& T_obj_cam);
  Tone prior_weight() const;
  Tone toned(Tone tone, int rounds) const;
  double cost_of(const Tone& tone) const;

  PhotometricTerm term_;
  const GreyPixels* pixels_;
  std::vector<PhotometricHit>* hits_;  // working memory, kept by a caller that makes many energies
  Tone tone_ = Tone::Unit(0);
  Rigidd followed_{};  // the pose of the hits
};

}  // namespace sdftrack::energies
