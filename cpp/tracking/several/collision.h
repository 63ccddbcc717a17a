// SPDX-License-Identifier: MIT
// The penalty for objects that penetrate each other: surface points of each in the fields of the others.
#pragma once

#include <vector>

#include "energies/contact_term.h"
#include "frame/shape.h"
#include "optim/energy.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

struct CollisionOptions {
  Collision kind = Collision::kContact;
  double tolerance_m = 3e-5;  // t
  // Of the printed form; both are those of the data term.
  double scale_m = 0.002;  // s of the Heaviside function
  double sharpness = 40;   // of the union, per smallest voxel
};

// docs/math/several_objects.md, section 3.
class CollisionEnergy final : public optim::Energy {
 public:
  struct Bounds {
    Vec3f low, high;
    bool holds(const Vec3f& p) const {
      return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z && p.z <= high.z;
    }
  };

  explicit CollisionEnergy(const CollisionOptions& options) : options_(options) {}

  // Sets the objects, their pixel counts, and the points that may come to lie in another object: those within
  // reach_m of it at x, in the printed form those that may come to cost anything. To be called again when a
  // pose has moved farther than reach_m, or s or the sharpness of the printed form has grown.
  void prepare(const std::vector<const frame::Shape*>& shapes, const std::vector<int>& pixels,
               const optim::State& x, double reach_m, int stride = 1);
  void set_tolerance(double tolerance_m) { options_.tolerance_m = tolerance_m; }
  void set_printed(double scale_m, double sharpness) {
    options_.scale_m = scale_m, options_.sharpness = sharpness;
  }
  bool empty() const { return points_.empty(); }
  bool runs_on_device() const { return options_.kind != Collision::kPrinted; }
  // The contacts for a device, on the host; at most Contacts::kObjects objects.
  energies::Contacts on_device() const;

  optim::Unknowns unknowns() const override { return {int(shapes_.size()), false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;

 private:
  void pose_pairs(const optim::State& x);
  template <class Visit>
  void each_contact(const Visit& visit) const;
  double union_at(const energies::ContactPoint& point, std::vector<energies::Contact>* members) const;
  double weight_of(std::size_t object) const;
  double add_contact(optim::NormalEquations* out) const;
  double add_printed(optim::NormalEquations* out) const;

  CollisionOptions options_;
  std::vector<const frame::Shape*> shapes_;
  std::vector<double> pixels_;
  std::vector<energies::ContactPair> pairs_;
  std::vector<Rigidd> T_other_object_;          // for each pair
  std::vector<Bounds> bounds_;                  // of the pair's other object, in the object's frame
  std::vector<energies::ContactPoint> points_;  // that may lie in some other object,
  std::vector<int> near_;                       // and the pairs in which they may
  double sharpness_per_m_ = 0;                  // a of the printed form's union
  int stride_ = 1;
};

}  // namespace sdftrack::tracking
