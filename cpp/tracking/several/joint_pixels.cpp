// SPDX-License-Identifier: MIT
#include "tracking/several/joint_pixels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

// Distance from a point to an object's box.
double distance_to_box(const frame::Shape& shape, const Rigidd& T_cam_obj, Vec3d p_cam) {
  const Vec3d p = inverse(T_cam_obj) * p_cam, &h = shape.half_box_m;
  return norm(Vec3d{std::max(0.0, std::abs(p.x) - h.x), std::max(0.0, std::abs(p.y) - h.y),
                    std::max(0.0, std::abs(p.z) - h.z)});
}

// The nearest few objects that may have made a pixel, in ascending order if added so.
struct Sharers {
  std::array<int, energies::kMaxJoined> of{};
  std::array<float, energies::kMaxJoined> phi_m{};
  int count = 0;

  void add(int object, float phi) {
    if (count == energies::kMaxJoined) {
      const auto farthest = std::max_element(phi_m.begin(), phi_m.end()) - phi_m.begin();
      if (phi >= phi_m[farthest]) return;
      for (auto k = std::size_t(farthest); k + 1 < energies::kMaxJoined; ++k)
        of[k] = of[k + 1], phi_m[k] = phi_m[k + 1];
      --count;
    }
    of[count] = object, phi_m[count++] = phi;
  }
};

}  // namespace

// Uses the box of each and the ball around the other's box: never wrongly false.
bool may_touch(const frame::Shape& a, const Rigidd& T_cam_a, const frame::Shape& b, const Rigidd& T_cam_b,
               double margin_m) {
  return distance_to_box(a, T_cam_a, T_cam_b.t) < 0.5 * b.diameter_m + margin_m &&
         distance_to_box(b, T_cam_b, T_cam_a.t) < 0.5 * a.diameter_m + margin_m;
}

void JointPixels::clear(std::size_t objects) {
  used_ = 0;
  counts_.assign(objects, 0);
}

int JointPixels::count() const { return std::accumulate(counts_.begin(), counts_.end(), 0); }

SharedPixels& JointPixels::part_of(const std::array<int, energies::kMaxJoined>& of, int objects) {
  // Neighbouring pixels are mostly shared by the same objects: the last part is tried first.
  const auto is_it = [&](std::size_t k) {
    return parts_[k]->objects == objects &&
           std::equal(of.begin(), of.begin() + objects, parts_[k]->of.begin());
  };
  if (last_ < used_ && is_it(last_)) return *parts_[last_];
  for (last_ = 0; last_ < used_; ++last_)
    if (is_it(last_)) return *parts_[last_];
  if (used_ == parts_.size()) parts_.push_back(std::make_unique<SharedPixels>());
  SharedPixels& part = *parts_[used_++];
  part.of = of, part.objects = objects;
  part.pixels.clear();
  return part;
}

void JointPixels::measure_distances(int m, const std::vector<FitTarget>& targets, const optim::State& x,
                                    double margin_m, energies::PixelSet* from) {
  const frame::Shape& own = targets[m].shape;
  const Rigidd T_cam_own = inverse(x.T_obj_cam[m]);
  near_.clear();
  for (int k = 0; k < int(targets.size()); ++k) {
    const frame::Shape& other = targets[k].shape;
    if (k == m) own_ = near_.size();
    if (k == m || may_touch(own, T_cam_own, other, inverse(x.T_obj_cam[k]), margin_m)) near_.push_back(k);
  }
  if (phi_m_.size() < near_.size()) phi_m_.resize(near_.size());
  one_.T_obj_cam.resize(1), one_.K = x.K;
  for (std::size_t k = 0; k < near_.size(); ++k) {
    const auto object = std::size_t(near_[k]);
    one_.T_obj_cam[0] = x.T_obj_cam[object];
    const float* const phi = energies::SdfEnergy(targets[object].shape.sdf, from, {}).distances(one_);
    phi_m_[k].assign(phi, phi + from->count());
  }
}

void JointPixels::take(int m, const std::vector<FitTarget>& targets, const optim::State& x, double reach_m,
                       double margin_m, int most, float noise_ratio, energies::PixelSet* from) {
  one_.T_obj_cam.assign(1, x.T_obj_cam[m]), one_.K = x.K;
  if (reach_m < kJointMargin_m)  // most are out of reach, which spares evaluating the others for them
    energies::SdfEnergy(targets[m].shape.sdf, from, {}).keep_near(one_, reach_m);
  // A pixel within reach of m is near another object if their boxes are within the sum of both distances.
  measure_distances(m, targets, x, std::min(kJointMargin_m, reach_m + margin_m), from);
  kept_.clear();
  for (int i = 0; i < from->count(); ++i) {
    const auto at = std::size_t(i);
    const float own = phi_m_[own_][at];
    if (!(std::abs(own) < float(reach_m))) continue;
    bool nearest = true;
    for (std::size_t k = 0; nearest && k < near_.size(); ++k)
      nearest = phi_m_[k][at] > own || (phi_m_[k][at] == own && near_[k] >= m);
    if (nearest) kept_.push_back(i);
  }
  const int requested = std::min(most, int(kept_.size()));
  const double stride = requested > 0 ? double(kept_.size()) / requested : 1;
  for (int i = 0; i < requested; ++i) {
    const int taken = kept_[i * stride];
    const auto at = std::size_t(taken);
    const float limit = phi_m_[own_][at] + float(margin_m);
    Sharers sharers;
    for (std::size_t k = 0; k < near_.size(); ++k)
      if (phi_m_[k][at] <= limit) sharers.add(near_[k], phi_m_[k][at]);
    energies::PixelSet& to = part_of(sharers.of, sharers.count).pixels;
    to.resize(to.count() + 1);
    to.copy(*from, taken, to.count() - 1);
    to.per_noise.back() *= noise_ratio;
    if (i != taken) from->copy(*from, taken, i);
  }
  from->resize(requested);
  counts_[m] += requested;
}

void JointPixels::assign_share(const JointPixels& other, double share) {
  clear(other.counts_.size());
  for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] = to_int(std::round(share * other.counts_[k]));
  for (std::size_t k = 0; k < other.used_; ++k) {
    const SharedPixels& from = *other.parts_[k];
    const int requested = to_int(std::round(share * from.pixels.count()));
    if (requested == 0) continue;
    if (used_ == parts_.size()) parts_.push_back(std::make_unique<SharedPixels>());
    SharedPixels& to = *parts_[used_++];
    to.of = from.of, to.objects = from.objects;
    to.pixels.assign_subset(from.pixels, requested);
  }
}

}  // namespace sdftrack::tracking
