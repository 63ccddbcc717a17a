// SPDX-License-Identifier: MIT
// Intrinsics from an object of known shape moved before the camera (thesis, section 3.6): one energy over all
// frames, or one per frame and their information-weighted mean. docs/math/intrinsics.md derives it.
#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens_solver.h"
#include "frame/region.h"

namespace sdftrack::calibration {

// The estimate of the free unknowns from one frame.
struct FrameEstimate {
  optim::SharedVector value;
  optim::SharedMatrix information;  // inverse of the marginal covariance, poses eliminated
  optim::SharedVector gradient;     // of the cost reduced to the lens, at the current state
  Eigen::MatrixXd follow;           // (6, n): a step d of the lens moves the pose's optimum by -follow d
  optim::SharedMatrix scatter;      // variance of that gradient from the measurements' noise
  double noise_m = 0;
  int hits = 0;
  int open_shifts = 0;  // directions in which no measurement holds the object
};

class IntrinsicsProblem {
 public:
  // The volume behind the shape's view belongs to the caller.
  IntrinsicsProblem(frame::Shape shape, const Lens& lens, const std::vector<LensUnknown>& free,
                    const IntrinsicsOptions& options);

  // Keeps the measurements near the object at T_cam_obj (of the caller's object frame); returns their number.
  int add(const frame::DepthFrame& frame, const Rigidd& T_cam_obj);
  int frame_count() const { return int(frames_.size()); }
  void drop(const std::vector<int>& frames);

  const Lens& lens() const { return lens_; }
  void set_lens(const Lens& lens) { lens_ = lens; }
  Rigidd T_cam_obj(int frame) const;
  const FreeLens& free() const { return free_; }

  // Fits all frames together, from scale_m down to the noise. prior: nullptr for none. quick: on some pixels.
  optim::LmRecord solve(double scale_m, const LensPrior* prior, bool quick);
  // Only the last stage, from the current state.
  optim::LmRecord polish();
  // The estimate of each frame at the current state.
  std::vector<FrameEstimate> examine();
  // As examine(), with each frame moved to its own optimum first (thesis Eq. 3.23); the state is not changed.
  std::vector<FrameEstimate> solve_each();
  // The residuals of a frame's pixels that count at the current state; whether their rays meet the model.
  std::vector<LensFrame::Reading> readings(int frame);
  const LensPixels& pixels(int frame) const { return frames_.at(std::size_t(frame)).pixels; }
  // The number of counting measurements in each cell of the image, row by row.
  std::vector<int> coverage(int columns, int rows) const;
  // The mean error of the estimate if the current state is the truth: solved for measurements simulated from
  // it with the noise of each frame, and with that noise negated, so that first-order errors cancel.
  optim::SharedVector bias(std::uint64_t seed, int pairs);

 private:
  FrameEstimate estimate_of(LensFrame* frame, Lens lens) const;
  void balance(LensSolver* solver);

  frame::Shape shape_;
  Lens lens_;
  FreeLens free_;
  IntrinsicsOptions options_;
  std::vector<LensFrame> frames_;
};

}  // namespace sdftrack::calibration
