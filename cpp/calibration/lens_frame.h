// SPDX-License-Identifier: MIT
// One frame of a calibration: readings near the object, and what they say of its pose and of the lens.
#pragma once

#include <vector>

#include "calibration/lens.h"
#include "energies/penalty.h"
#include "energies/term.h"

namespace sdftrack::calibration {

// The unknowns of a lens that are free, and what the rays need to know.
struct FreeLens {
  std::vector<LensUnknown> unknowns;  // in the order of the enumeration
  bool distorted = false;             // of the camera, or among the unknowns

  int count() const { return static_cast<int>(unknowns.size()); }
};

// Structure of arrays, as PixelsView has it; u and v are those of the image, distortion and all.
struct LensPixels {
  std::vector<double> u_px, v_px, reading_m, gain;
  std::vector<double> hit_m, trial_hit_m;  // where the ray meets the model at the state, and at the trial
  std::vector<unsigned char> used;

  int count() const { return static_cast<int>(reading_m.size()); }
  void push(double u, double v, double reading);
};

// What all frames have in common while a state is looked at.
struct LensView {
  SdfView sdf;
  const Lens& lens;
  const FreeLens& free;
  int stride = 1;  // of the pixels: coarse stages look at some of them
};

enum class OutlineUse {
  kAll,     // pixels whose rays miss the model count too, by phi at the measured point
  kWithin,  // only those that meet it, and whose neighbours do: no ray comes or goes while the state moves a
            // little
  kPoints,  // all pixels, each by phi at the measured point: the source's residual (thesis Eq. 3.11)
};

// How a sum over a frame's readings scatters: the two halves of the sandwich covariance.
struct FrameSpread {
  Eigen::MatrixXd meat;   // sum of psi^2 J J^T
  Eigen::MatrixXd bread;  // sum of psi' J J^T, or its mean by the weights where that is not positive definite
};

class LensFrame {
 public:
  LensPixels pixels;
  Rigidd T_obj_cam, trial_T_obj_cam;  // centred
  double noise_m = 0;                 // sd of the readings of this frame; 0: not known yet

  // Decides anew which pixels count and which rays meet the model; costs may be compared until the next call.
  void classify(const LensView& view, OutlineUse outline);
  // At T_obj_cam, or at trial_T_obj_cam.
  void linearize(const LensView& view, const energies::DepthLogistic<double>& penalty, bool trial,
                 optim::ArrowBlock* out);
  void accept();  // the trial becomes the state

  struct Reading {
    double residual_m;
    bool hit;
  };
  // Of every pixel that counts: residual (model minus measured, in metres of the reading), and whether its
  // ray meets the model.
  std::vector<Reading> readings(const LensView& view);

  // At the state in hand, all unknowns (pose, then lens).
  FrameSpread spread(const LensView& view, const energies::DepthLogistic<double>& penalty);

 private:
  using Loop = energies::Term<energies::SingleObject<double>, energies::DepthLogistic<double>>;
  static Loop loop_over(const LensView& view, const Rigidd& T);
  template <class Visit>
  void each_row(const LensView& view, bool trial, const Visit& visit);
  bool neighbours_meet(const LensView& view, const Loop& loop, std::size_t at) const;
};

}  // namespace sdftrack::calibration
