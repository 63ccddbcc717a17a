// SPDX-License-Identifier: MIT
// Intrinsics from an object of known shape moved before the camera (thesis, section 3.6): one energy over all
// frames, or one per frame and their information-weighted mean. docs/math/intrinsics.md derives it.
#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens_solver.h"
#include "frame/region.h"

namespace sdftrack::calibration {

// What one frame says of the free unknowns.
struct FrameEstimate {
  optim::SharedVector value;
  optim::SharedMatrix information;  // inverse of the marginal covariance; the pose has followed
  optim::SharedVector gradient;     // of the cost reduced to the lens, at the state in hand
  Eigen::MatrixXd follow;           // (6, n): a step d of the lens moves the pose's optimum by -follow d
  optim::SharedMatrix scatter;      // variance of that gradient by the readings' own noise
  double noise_m = 0;
  int hits = 0;
  int open_shifts = 0;  // directions along which nothing in the readings holds the object
};

class IntrinsicsProblem {
 public:
  // The volume behind the shape's view belongs to the caller.
  IntrinsicsProblem(frame::Shape shape, const Lens& lens, const std::vector<LensUnknown>& free,
                    const IntrinsicsOptions& options);

  // Keeps the readings near the object at T_cam_obj (of the caller's object frame); returns how many they
  // are.
  int add(const frame::DepthFrame& frame, const Rigidd& T_cam_obj);
  int frame_count() const { return static_cast<int>(frames_.size()); }
  void drop(const std::vector<int>& frames);

  const Lens& lens() const { return lens_; }
  void set_lens(const Lens& lens) { lens_ = lens; }
  Rigidd T_cam_obj(int frame) const;
  const FreeLens& free() const { return free_; }

  // All frames together, from scale_m on down to the noise. prior: nullptr for none. quick: on some of the
  // pixels.
  optim::LmRecord solve(double scale_m, const LensPrior* prior, bool quick);
  // The last stage alone, from the state in hand on.
  optim::LmRecord polish();
  // What each frame says at the state in hand.
  std::vector<FrameEstimate> examine();
  // The same, with each frame moved to its own optimum first (thesis Eq. 3.23); the state stays as it is.
  std::vector<FrameEstimate> solve_each();
  // Residuals of the readings of a frame that count, and the readings, at the state in hand.
  std::vector<LensFrame::Reading> readings(int frame);
  const LensPixels& pixels(int frame) const { return frames_.at(static_cast<std::size_t>(frame)).pixels; }
  // How many of the readings that count fall into each cell of the image, row by row.
  std::vector<int> coverage(int columns, int rows) const;
  // By how much the estimate is off, on average, when the truth is the state in hand: solved anew for
  // readings made up from it with the noise of each frame, and with that noise negated, so that what is of
  // first order cancels.
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
