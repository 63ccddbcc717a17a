// SPDX-License-Identifier: MIT
// Whether the object has the size of its model: what depth and the outline in the colour image say of it.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "energies/outline_energy.h"
#include "energies/pixel_set.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

// Of one frame, beside the pose.
struct SizeLook {
  double log_scale = 0;              // of the object over the model
  double own_var = 0;                // by errors of this frame
  double shared_var = 0;             // by errors that last while the view does
  Vector6d pull = Vector6d::Zero();  // increment of T_obj_cam that follows a log scale of 1
  double unexplained = 1;            // spread of the residuals at that size over theirs at the model's
};

// The pose, the log scale about the centre and the smooth modes of an error of sd systematic_m (systematic.h)
// fitted to the residuals of an even subset of the pixels, as their hits lie. noise_m: of a reading among its
// neighbours. None where too few pixels show the surface.
std::optional<SizeLook> size_by_depth(const energies::PixelSet& pixels, float color_prior,
                                      const frame::Shape& shape, const Camera& camera,
                                      const Rigidd& T_obj_cam, double noise_m, double systematic_m);

// The same by the outline, at a distance that depth has to 1 %, with an offset that all lines share. rows: of
// the lines, at T_obj_cam; to_depth: from there to the pose by depth alone; noise: by which their sds are
// multiplied; shared_lines: that share one error.
std::optional<SizeLook> size_by_outline(const energies::OutlineLines& lines,
                                        const std::vector<energies::OutlineResidual>& rows, double noise,
                                        const Rigidd& T_obj_cam, const Vector6d& to_depth,
                                        double shared_lines);

// Means over frames. Errors of one view do not average: another view is one that is turned by 20 degrees.
class SizeWitness {
 public:
  void observe(const SizeLook& look, const Mat3d& R_cam_obj);
  bool known() const { return frames_ > 0; }
  double log_scale() const { return mean_; }
  double sd() const;
  const Vector6d& pull() const { return pull_; }
  double unexplained() const { return unexplained_; }
  // The model has been enlarged by this log scale.
  void rescaled(double log_scale);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [frames, views, mean, own, shared, scatter, view, pull, left] = self;
    archive(frames, views, mean, own, shared, scatter, view, pull, left);
  }

 private:
  int frames_ = 0, views_ = 0;
  double mean_ = 0, own_var_ = 0, shared_var_ = 0, scatter_ = 0;
  std::optional<Rigidd> view_;  // the last other one: a turn
  Vector6d pull_ = Vector6d::Zero();
  double unexplained_ = 1;
};

struct SizeTest {
  SizeWitness depth, outline;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [by_depth, by_outline] = self;
    archive(by_depth, by_outline);
  }

  // One sentence where depth surely shows another size and the outline does not contradict it; else empty.
  std::string other_size() const;
  // Whether the outline is that of an object of the model's size.
  bool outline_agrees() const;
  // What a size that differs, surely or not, makes of the pose: to be added to its covariance in camera axes.
  Matrix6d covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const;

  // Of a model whose scale is free, by both witnesses; the sd is infinite where neither has seen it.
  struct LogScale {
    double mean = 0, sd = std::numeric_limits<double>::infinity();
  };
  LogScale free_scale() const;
  // The log scale by which to enlarge the model; 0 where it is smaller than what is known of it.
  double log_scale_to_add() const;
  void rescaled(double log_scale);
  bool determines_scale() const;
  bool outline_out_of_reach() const;
  // What is not known of it makes of the pose.
  Matrix6d free_covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const;
};

}  // namespace sdftrack::tracking
