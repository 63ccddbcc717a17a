// SPDX-License-Identifier: MIT
#include "tracking/several/collision.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdftrack::tracking {

namespace {

using Bounds = CollisionEnergy::Bounds;

constexpr double kMinPixels = 40;   // least weight of a hardly visible object: it gives way
constexpr double kMinShare = 1e-6;  // of the printed form's points outside: keeps its logarithm finite
// At 16 s from the surface 1 - H_out is 5e-7, and an object that is 16 / a farther than another changes their
// union by 1e-7 / a.
constexpr double kPrintedReach = 16;

// Whether a point is within reach_m of the box of an object.
bool near_box(const frame::Shape& shape, Vec3d p_obj, double reach_m) {
  const Vec3d& h = shape.half_box_m;
  return std::abs(p_obj.x) <= h.x + reach_m && std::abs(p_obj.y) <= h.y + reach_m &&
         std::abs(p_obj.z) <= h.z + reach_m;
}

// Bounds of the padded box of an object, in the frame of another.
Bounds bounds_of(const frame::Shape& shape, const Rigidd& T_to_other, double padding_m) {
  const Vec3d h = shape.half_box_m + Vec3d{padding_m, padding_m, padding_m};
  const auto reach = [&](Vec3d row) {
    return std::abs(row.x) * h.x + std::abs(row.y) * h.y + std::abs(row.z) * h.z;
  };
  const Vec3d extent{reach(T_to_other.R.r0), reach(T_to_other.R.r1), reach(T_to_other.R.r2)};
  return {(T_to_other.t - extent).cast<float>(), (T_to_other.t + extent).cast<float>()};
}

double field_at(const frame::Shape& shape, Vec3d p_obj) {
  double phi;
  Vec3d unused;
  sample(shape.sdf, p_obj, &phi, &unused);
  return phi;
}

// Adds weight r^T r of a row over two objects' unknowns.
void add_row(const double* own, const double* other, int a, int b, double weight,
             optim::NormalEquations* out) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      out->hessian(a + i, a + j) += weight * own[i] * own[j];
      out->hessian(b + i, b + j) += weight * other[i] * other[j];
      out->hessian(a + i, b + j) += weight * own[i] * other[j];
      out->hessian(b + i, a + j) += weight * other[i] * own[j];
    }
}

}  // namespace

void CollisionEnergy::prepare(const std::vector<const frame::Shape*>& shapes, const std::vector<int>& pixels,
                              const optim::State& x, double reach_m, int stride) {
  shapes_ = shapes;
  pixels_.assign(pixels.begin(), pixels.end());
  pairs_.clear(), T_other_object_.clear(), bounds_.clear();
  points_.clear(), near_.clear();
  stride_ = stride;
  if (options_.kind == Collision::kNone) return;
  if (options_.kind == Collision::kPrinted) {
    float voxel_m = std::numeric_limits<float>::max();
    for (const frame::Shape* shape : shapes) voxel_m = std::min(voxel_m, shape->sdf.voxel_m);
    sharpness_per_m_ = options_.sharpness / double(voxel_m);
    reach_m += kPrintedReach * (options_.scale_m + 1 / sharpness_per_m_);
  }
  const int count = int(shapes.size());
  for (int m = 0; m < count; ++m) {
    const frame::Shape& shape = *shapes[m];
    const Rigidd T_cam_obj = inverse(x.T_obj_cam[m]);
    const int first = int(pairs_.size());
    const int last = options_.kind == Collision::kPrinted ? m : count;
    for (int j = 0; j < last; ++j) {
      if (j == m) continue;
      const frame::Shape& other = *shapes[j];
      const Rigidd T = x.T_obj_cam[j] * T_cam_obj;
      if (norm(T.t) < 0.5 * (shape.diameter_m + other.diameter_m) + reach_m)
        pairs_.push_back({m, j}), T_other_object_.push_back(T),
            bounds_.push_back(bounds_of(other, inverse(T), reach_m));
    }
    for (int k = 0; k < int(shape.contact.size()); k += stride) {
      const Vec3f& C = shape.contact[k];
      energies::ContactPoint point{C, int(near_.size()), 0};
      for (int p = first; p < int(pairs_.size()); ++p) {
        const auto i = std::size_t(p);
        if (!bounds_[i].holds(C)) continue;
        const frame::Shape& other = *shapes[pairs_[i].other];
        const Vec3d at = T_other_object_[i] * C.cast<double>();
        if (near_box(other, at, reach_m) && field_at(other, at) < reach_m) near_.push_back(p), ++point.count;
      }
      if (point.count > 0) points_.push_back(point);
    }
  }
}

void CollisionEnergy::pose_pairs(const optim::State& x) {
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    T_other_object_[p] = x.T_obj_cam[pairs_[p].other] * inverse(x.T_obj_cam[pairs_[p].object]);
}

// Calls visit(point, contact) for every point and the nearest of the other objects that it may lie in.
template <class Visit>
void CollisionEnergy::each_contact(const Visit& visit) const {
  for (const energies::ContactPoint& point : points_)
    visit(point, energies::nearest_contact(point, near_.data(), pairs_.data(), T_other_object_.data(),
                                           [&](int object) { return shapes_[object]->sdf; }));
}

double CollisionEnergy::weight_of(std::size_t object) const {
  const double points = double(shapes_[object]->contact.size()) / stride_;
  return std::max(kMinPixels, pixels_[object]) / points / (options_.tolerance_m * options_.tolerance_m);
}

energies::Contacts CollisionEnergy::on_device() const {
  energies::Contacts out;
  out.points = points_.data(), out.point_count = int(points_.size());
  out.near_pairs = near_.data(), out.near_count = int(near_.size());
  out.pair_count = int(pairs_.size());
  std::copy(pairs_.begin(), pairs_.end(), out.pairs);
  for (std::size_t m = 0; m < shapes_.size(); ++m) out.weight[m] = weight_of(m);
  return out;
}

double CollisionEnergy::add_contact(optim::NormalEquations* out) const {
  double cost = 0;
  each_contact([&](const energies::ContactPoint& point, const energies::Contact& c) {
    if (!(c.phi_m < 0)) return;
    const energies::ContactPair& pair = pairs_[c.pair];
    const double weight = weight_of(std::size_t(pair.object));
    cost += 0.5 * weight * c.phi_m * c.phi_m;
    if (!out) return;
    double own[6], other[6];
    energies::contact_rows(T_other_object_[c.pair], point.p_obj, c.grad_other, own, other);
    const int a = 6 * pair.object, b = 6 * pair.other;
    for (int i = 0; i < 6; ++i) {
      out->gradient[a + i] += weight * c.phi_m * own[i];
      out->gradient[b + i] += weight * c.phi_m * other[i];
    }
    add_row(own, other, a, b, weight, out);
  });
  return cost;
}

// The soft minimum of the fields of the objects in which a point may lie (thesis Eq. 5.14), and each of them.
double CollisionEnergy::union_at(const energies::ContactPoint& point,
                                 std::vector<energies::Contact>* members) const {
  members->clear();
  double least_m = std::numeric_limits<double>::infinity(), sum = 0;
  for (int k = 0; k < point.count; ++k) {
    energies::Contact c;
    c.pair = near_[point.first + k];
    sample(shapes_[pairs_[c.pair].other]->sdf, T_other_object_[c.pair] * point.p_obj.cast<double>(), &c.phi_m,
           &c.grad_other);
    least_m = std::min(least_m, c.phi_m);
    members->push_back(c);
  }
  for (const energies::Contact& c : *members) sum += std::exp(sharpness_per_m_ * (least_m - c.phi_m));
  return least_m - std::log(sum) / sharpness_per_m_;
}

double CollisionEnergy::add_printed(optim::NormalEquations* out) const {
  std::vector<double> inside(shapes_.size(), 0);  // sum of 1 - H_out
  std::vector<Eigen::VectorXd> slopes;            // of `inside`
  if (out) slopes.assign(shapes_.size(), Eigen::VectorXd::Zero(out->gradient.size()));
  std::vector<energies::Contact> members;
  for (const energies::ContactPoint& point : points_) {
    const auto m = std::size_t(pairs_[near_[point.first]].object);
    const double phi_m = union_at(point, &members),
                 t = std::tanh(std::max(0.0, phi_m) / (2 * options_.scale_m));
    const double sech2 = 1 - t * t;
    inside[m] += sech2;
    if (!out || !(phi_m > 0)) continue;
    for (const energies::Contact& c : members) {
      const energies::ContactPair& pair = pairs_[c.pair];
      double own[6], other[6];
      energies::contact_rows(T_other_object_[c.pair], point.p_obj, c.grad_other, own, other);
      const double membership = std::exp(sharpness_per_m_ * (phi_m - c.phi_m));  // thesis Eq. 5.21
      const double slope = -sech2 * t / options_.scale_m * membership;
      for (int i = 0; i < 6; ++i) {
        slopes[m][6 * pair.object + i] += slope * own[i];
        slopes[m][6 * pair.other + i] += slope * other[i];
      }
    }
  }
  double cost = 0;
  for (std::size_t m = 0; m < shapes_.size(); ++m) {
    const double points = std::ceil(double(shapes_[m]->contact.size()) / stride_);
    const double share = std::max(kMinShare, 1 - inside[m] / points);
    cost -= std::log(share);
    if (!out) continue;
    const Eigen::VectorXd gradient = slopes[m] / (points * share);
    out->gradient += gradient;
    out->hessian += gradient * gradient.transpose();
  }
  return cost;
}

void CollisionEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  pose_pairs(x);
  out->cost += options_.kind == Collision::kPrinted ? add_printed(out) : add_contact(out);
}

double CollisionEnergy::cost(const optim::State& x) {
  pose_pairs(x);
  return options_.kind == Collision::kPrinted ? add_printed(nullptr) : add_contact(nullptr);
}

}  // namespace sdftrack::tracking
