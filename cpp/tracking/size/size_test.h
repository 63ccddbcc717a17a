// SPDX-License-Identifier: MIT
// Tests whether the object has the size of its model, by depth and the outline over many frames.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "tracking/size/size_look.h"

namespace sdftrack::tracking {

// Counts the views of an object: a new view is turned by 20 degrees.
class ViewCount {
 public:
  void observe(const Mat3d& R_cam_obj);
  int count() const { return count_; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [count, last] = self;
    archive(count, last);
  }

 private:
  int count_ = 0;
  std::optional<Rigidd> last_;  // the last new view: a turn
};

// Means over frames. Errors of a single view do not average out.
class SizeWitness {
 public:
  void observe(const SizeLook& look, const Mat3d& R_cam_obj);
  bool known() const { return frames_ > 0; }
  double log_scale() const { return mean_; }
  double sd() const;
  const Vector6d& pull() const { return pull_; }
  double unexplained() const { return unexplained_; }
  // Reports that the model has been enlarged by this log scale.
  void rescaled(double log_scale);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [frames, views, mean, own, shared, scatter, pull, left] = self;
    archive(frames, views, mean, own, shared, scatter, pull, left);
  }

 private:
  int frames_ = 0;
  ViewCount views_;
  double mean_ = 0, own_var_ = 0, shared_var_ = 0, scatter_ = 0;
  Vector6d pull_ = Vector6d::Zero();
  double unexplained_ = 1;
};

// The same for the strain.
class StrainWitness {
 public:
  void observe(const StrainLook& look, const Mat3d& R_cam_obj);
  bool known() const { return frames_ > 0; }
  bool of_one_frame() const { return frames_ == 1; }
  // Over all frames; both covariances are those of the mean.
  StrainLook mean() const;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [frames, views, mean, scatter] = self;
    archive(frames, views, mean.strain, mean.own_cov, mean.shared_cov, mean.unexplained, scatter);
  }

 private:
  int frames_ = 0;
  ViewCount views_;
  StrainLook mean_;
  StrainCovariance scatter_ = StrainCovariance::Zero();
};

// Means over frames of the strain by the outline.
class OutlineFormWitness {
 public:
  void observe(const StrainInformation& look);
  // The share of a strain that the outline shows: 1 is all of it. No result where this is not known.
  std::optional<double> share_of(const Strain& strain) const;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [frames, mean] = self;
    archive(frames, mean.information, mean.pull);
  }

 private:
  int frames_ = 0;
  StrainInformation mean_;
};

struct SizeTest {
  SizeWitness depth, outline;
  StrainWitness form;  // by depth
  OutlineFormWitness form_outline;
  bool outline_has_agreed = false;  // in one of the frames so far

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [by_depth, by_outline, strain, strain_by_outline, agreed] = self;
    archive(by_depth, by_outline, strain, strain_by_outline, agreed);
  }

  // One sentence where depth surely shows another size and the outline does not contradict it; else empty.
  std::string other_size() const;
  // The same for another form.
  std::string other_form() const;
  // Whether the outline agrees with an object of the model's size; once it has, it takes more to contradict.
  bool outline_agrees() const;
  // Effect of a different size, sure or not, on the pose: to be added to its covariance in camera axes.
  Matrix6d covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const;

  // The scale of a model whose scale is free, from depth and outline; sd infinite: neither has measured it.
  struct LogScale {
    double mean = 0, sd = std::numeric_limits<double>::infinity();
  };
  LogScale free_scale() const;
  // The log scale by which to enlarge the model; 0 where it is small compared with its uncertainty.
  double log_scale_to_add() const;
  void rescaled(double log_scale);
  bool determines_scale() const;
  bool outline_out_of_reach() const;
  // Effect of the uncertainty of a free scale on the pose.
  Matrix6d free_covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const;
};

}  // namespace sdftrack::tracking
