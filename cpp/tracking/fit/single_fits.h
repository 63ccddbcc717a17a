// SPDX-License-Identifier: MIT
// Many objects of one depth image, each fitted from its start by depth alone; on a GPU all at once.
#pragma once

#include <memory>
#include <vector>

#include "energies/cuda_work.h"
#include "frame/selection.h"
#include "optim/lm.h"
#include "tracking/options/options.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

struct SingleFitOptions {
  double scale_m = 0.002;  // s of the logistic density
  TrackerOptions tracker;  // residual, curvature, outlier_floor, noise, padding, max_pixels, correlation area
  optim::LmRules rules;    // by default those of a tracker's last stage
  int rounds = 2;          // each determines anew which rays meet the model at its start

  SingleFitOptions();
};

// Poses in the shape's centred frame.
struct SingleFit {
  Rigidd T_cam_obj;
  Matrix6d covariance;  // camera axes, about the caller's object origin
  double cost = 0;      // sum over the pixels
  int pixels = 0, hits = 0;
  optim::Stop stop = optim::Stop::kNoData;
  std::vector<optim::LmStep> steps;  // of the last round
};

class SingleFits {
 public:
  // device: negative: the CPU.
  explicit SingleFits(int device);

  // Fits shapes[k] from T_cam_obj[k]. The shapes' volumes are sent to a GPU once.
  std::vector<SingleFit> run(const frame::DepthFrame& frame, const Camera& camera,
                             const std::vector<const frame::Shape*>& shapes,
                             const std::vector<Rigidd>& T_cam_obj, const SingleFitOptions& options,
                             int threads);

 private:
  struct Work {  // of one object, kept from call to call
    frame::PixelSelection selection;
    energies::PixelSet pixels;
    optim::LmWork lm;
    optim::LmResult found;
  };
  SingleFit fit_here(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                     const Rigidd& T_cam_obj, const SingleFitOptions& options, Work* work) const;
  std::vector<SingleFit> fit_there(const frame::DepthFrame& frame, const Camera& camera,
                                   const std::vector<const frame::Shape*>& shapes,
                                   const std::vector<Rigidd>& T_cam_obj, const SingleFitOptions& options);

  std::unique_ptr<energies::CudaWork> device_;  // nullptr: the CPU
  std::vector<Work> work_;
};

}  // namespace sdftrack::tracking
