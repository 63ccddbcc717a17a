// SPDX-License-Identifier: MIT
// How much later the colour images are taken than the depth images, estimated from an object's motion.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

// The poses of one frame by depth alone and by the outline in the colour image alone, in camera axes about
// the object's centre: the displacement from the depth's pose to the outline's (m, rad) and its covariance.
struct PosesApart {
  Vector6d way = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [apart, sd] = self;
    archive(apart, sd);
  }
};

constexpr double kLag_frames = 0.5;  // sd of the lag of a depth camera without a stated one

// Over a sequence the two poses differ by  way = bias + delay velocity + noise,  with a constant bias (the
// sensor's error stays the same): seven unknowns by weighted least squares. The delay can be told once the
// velocity has changed. A frame that deviates much counts less (Cauchy).
class ColorDelay {
 public:
  void forget() { *this = {}; }
  // To be called for every sure frame in turn. velocity: since the frame before, in camera axes, per second;
  // that at the frame itself is known with the next one. apart: in frames whose outline was evaluated.
  void observe(const std::optional<PosesApart>& apart, const Vector6d& velocity);
  void pass() { waiting_.reset(); }  // a frame that is not sure

  struct Estimate {
    double delay_s = 0, sd_s = 0;
    int frames = 0;  // 0: nothing is known
  };
  Estimate estimate() const;
  // Mean square of the lag of the depth images behind the colour images, in frames of frame_s each (0:
  // unknown): by the estimate and a prior of sd kLag_frames. Temporal filters make depth late.
  double lag2_frames(double frame_s) const;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [A, b, excess, frames, waiting, before] = self;
    archive(A, b, excess, frames, waiting, before);
  }

 private:
  using Vector7d = Eigen::Matrix<double, 7, 1>;
  using Matrix7d = Eigen::Matrix<double, 7, 7>;
  // velocity: at the frame.
  void add(const PosesApart& apart, const Vector6d& velocity);
  Vector7d solution() const;
  Matrix7d information() const;

  Matrix7d A_ = Matrix7d::Zero();
  Vector7d b_ = Vector7d::Zero();
  double excess_ = 0;  // sum of weighted squared residuals
  int frames_ = 0;
  std::optional<PosesApart> waiting_;
  Vector6d before_ = Vector6d::Zero();
};

}  // namespace sdftrack::tracking
