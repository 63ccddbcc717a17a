// SPDX-License-Identifier: MIT
// What the brightness of the pixels says of a pose: the colours of the surface hold the turns and shifts that
// its shape leaves free (docs/math/photometric.md).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/photometric_term.h"
#include "optim/energy.h"

namespace sdftrack::energies {

// Pixels with a reading and a brightness (0..1).
struct GreyPixels {
  std::vector<float> u_px, v_px, depth_m, grey;

  int count() const { return static_cast<int>(depth_m.size()); }
  void clear() { u_px.clear(), v_px.clear(), depth_m.clear(), grey.clear(); }
  void push(float u, float v, float depth, float g) {
    u_px.push_back(u), v_px.push_back(v), depth_m.push_back(depth), grey.push_back(g);
  }
};

struct PhotometricOptions {
  double sigma = 0.03;         // sd of a brightness, of its full range
  double gain_sigma = 0.2;     // of the frame's gain about 1,
  double shading_sigma = 0.2;  // of how that changes with the surface's normal,
  double offset_sigma = 0.2;   // and of its offset about 0
};

// E = sum_i log(1 + r_i^2 / (2 sigma^2)), r_i = (gain + shading . n_i) g(hit_i) + offset - grey_i, with the
// gain, shading and offset of the frame that make it least: light that falls from somewhere else, or another
// exposure, moves no pose. The hits stay on the surface while the object moves.
class PhotometricEnergy final : public optim::Energy {
 public:
  // How the frame shows the surface's brightness: gain, shading (3), offset.
  using Tone = Eigen::Matrix<double, kTone, 1>;

  PhotometricEnergy(const SdfView& sdf, const ColorView& colors, const GreyPixels* pixels,
                    const PhotometricOptions& options, std::vector<PhotometricHit>* hits)
      : term_(term_of(sdf, colors, options)), pixels_(pixels), hits_(hits) {}

  // Which pixels show the surface at x: decided once, so that costs may be compared. Returns how many.
  int settle(const optim::State& x);
  int used() const { return static_cast<int>(hits_->size()); }

  optim::Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;
  const Tone& tone() const { return tone_; }
  // For a device, on the host: as it is now.
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
  std::vector<PhotometricHit>* hits_;  // working memory, kept by whoever makes many energies
  Tone tone_ = Tone::Unit(0);
  Rigidd followed_{};  // where the hits are
};

}  // namespace sdftrack::energies
