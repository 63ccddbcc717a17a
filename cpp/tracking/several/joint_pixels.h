// SPDX-License-Identifier: MIT
// The pixels of a group of objects, sorted by the objects that may have made them.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "tracking/fit/fit_view.h"

namespace sdftrack::tracking {

// Whether the boxes of two objects may come this near to each other; by default, near enough to share pixels.
constexpr double kJointMargin_m = 0.04;
bool may_touch(const frame::Shape& a, const Rigidd& T_cam_a, const frame::Shape& b, const Rigidd& T_cam_b,
               double margin_m = kJointMargin_m);

// Pixels that the same few objects of a group may have made.
struct SharedPixels {
  std::array<int, energies::kMaxJoined> of;  // ascending
  int objects = 0;
  energies::PixelSet pixels;
};

class JointPixels {
 public:
  // Sets the objects' poses, T_obj_cam in x, and determines which of them may share pixels.
  void clear(std::size_t objects);
  // Takes, from the pixels `from` around object m, at most `most` that are nearest to m; the others come with
  // the objects that they are nearest to. A pixel farther than reach_m from all is left out. A pixel is
  // shared by the objects that are no more than margin_m farther from it than m. `from` keeps what was taken.
  // noise_ratio: the group's reference noise over that of `from`.
  void take(int m, const std::vector<FitTarget>& targets, const optim::State& x, double reach_m,
            double margin_m, int most, float noise_ratio, energies::PixelSet* from);
  // Assigns an even share of another set's pixels.
  void assign_share(const JointPixels& other, double share);

  std::vector<std::unique_ptr<SharedPixels>>::iterator begin() { return parts_.begin(); }
  std::vector<std::unique_ptr<SharedPixels>>::iterator end() {
    return parts_.begin() + std::ptrdiff_t(used_);
  }
  const std::vector<int>& counts() const { return counts_; }  // per object, of the pixels nearest to it
  int count() const;

 private:
  void measure_distances(int m, const std::vector<FitTarget>& targets, const optim::State& x, double margin_m,
                         energies::PixelSet* from);
  SharedPixels& part_of(const std::array<int, energies::kMaxJoined>& of, int objects);

  std::vector<std::unique_ptr<SharedPixels>> parts_;  // the first used_ are in use
  std::size_t used_ = 0, last_ = 0;
  std::vector<int> counts_;
  std::vector<int> near_, kept_;  // objects that may share pixels with m, m among them
  optim::State one_;
  std::size_t own_ = 0;                    // position of m in near_
  std::vector<std::vector<float>> phi_m_;  // of near_[k] at every pixel
};

}  // namespace sdftrack::tracking
