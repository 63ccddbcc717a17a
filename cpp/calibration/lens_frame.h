// SPDX-License-Identifier: MIT
// One frame of a calibration: measurements near the object, and their contribution to its pose and the lens.
#pragma once

#include <vector>

#include "calibration/lens.h"
#include "energies/penalty.h"
#include "energies/term.h"

namespace sdftrack::calibration {

// The free unknowns of a lens, and whether rays need distortion.
struct FreeLens {
  std::vector<LensUnknown> unknowns;  // in the order of the enumeration
  bool distorted = false;             // distortion of the camera, or among the unknowns

  int count() const { return int(unknowns.size()); }
};

// Structure of arrays, as PixelsView has it; u and v are those of the image, with distortion.
struct LensPixels {
  std::vector<double> u_px, v_px, reading_m, gain;
  std::vector<double> hit_m, trial_hit_m;  // where the ray meets the model at the state and at the trial
  std::vector<unsigned char> used;

  int count() const { return int(reading_m.size()); }
  void push(double u, double v, double reading);
};

// The data that all frames share while a state is evaluated.
struct LensView {
  SdfView sdf;
  const Lens& lens;
  const FreeLens& free;
  int stride = 1;  // of the pixels: coarse stages use some of them
};

enum class OutlineUse {
  kAll,     // pixels whose rays miss the model count too, by phi at the measured point
  kWithin,  // only pixels whose rays and whose neighbours' rays meet it: small changes keep the set
  kPoints,  // all pixels, by phi at the measured point: the thesis' residual (Eq. 3.11)
};

// The scatter of a sum over a frame's measurements: both parts of the sandwich covariance.
struct FrameSpread {
  Eigen::MatrixXd meat;   // sum of psi^2 J J^T
  Eigen::MatrixXd bread;  // sum of psi' J J^T, or from the weights if that is not positive definite
};

class LensFrame {
 public:
  LensPixels pixels;
  Rigidd T_obj_cam, trial_T_obj_cam;  // centred
  double noise_m = 0;                 // sd of this frame's measurements; 0: not known yet

  // Decides again which pixels count and which rays meet the model; costs are comparable until the next call.
  void classify(const LensView& view, OutlineUse outline);
  // Linearises at T_obj_cam, or at trial_T_obj_cam.
  void linearize(const LensView& view, const energies::DepthLogistic<double>& penalty, bool trial,
                 optim::ArrowBlock* out);
  void accept();  // the trial becomes the state

  struct Reading {
    double residual_m;
    bool hit;
  };
  // For every pixel that counts: the residual (model minus measured, in metres of the measurement), and
  // whether its ray meets the model.
  std::vector<Reading> readings(const LensView& view);

  // The spread at the current state, over all unknowns (pose, then lens).
  FrameSpread spread(const LensView& view, const energies::DepthLogistic<double>& penalty);

 private:
  using Loop = energies::Term<energies::SingleObject<double>, energies::DepthLogistic<double>>;
  static Loop loop_over(const LensView& view, const Rigidd& T);
  template <class Visit>
  void each_row(const LensView& view, bool trial, const Visit& visit);
  bool neighbours_meet(const LensView& view, const Loop& loop, std::size_t at) const;
};

}  // namespace sdftrack::calibration
