// SPDX-License-Identifier: MIT
#include "energies/photometric.h"

#include <cmath>

#include "optim/dense.h"

namespace sdftrack::energies {

namespace {

using Tone = PhotometricEnergy::Tone;

constexpr int kSettleSteps = 4, kFollowSteps = 2;
constexpr double kMinSlant = 0.25;  // of a ray's direction on the surface normal
constexpr double kNearVoxels = 3;   // a reading farther from the surface shows something else
constexpr int kFirstRounds = 6, kRounds = 2;

// The residual is linear in the tone: what each of its parts is multiplied by.
Tone basis(const PhotometricHit& hit) {
  const Vec3d lit = hit.grey * hit.normal_cam;
  return (Tone() << hit.grey, lit.x, lit.y, lit.z, 1).finished();
}

double residual(const Tone& tone, const PhotometricHit& hit) { return tone.dot(basis(hit)) - hit.grey_seen; }

bool same_vector(Vec3d a, Vec3d b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
bool same_pose(const Rigidd& a, const Rigidd& b) {
  return same_vector(a.t, b.t) && same_vector(a.R.r0, b.R.r0) && same_vector(a.R.r1, b.R.r1) &&
         same_vector(a.R.r2, b.R.r2);
}

// psi(r) / r of log(1 + r^2 / (2 sigma^2)).
double weight(double r, double inv_sigma2) { return inv_sigma2 / (1 + 0.5 * r * r * inv_sigma2); }

}  // namespace

// From hit->depth_m on; false, and the hit as it was, where the ray leaves the surface or its known colours.
bool PhotometricEnergy::find(const Rigidd& T_obj_cam, int steps, PhotometricHit* hit) const {
  const Vec3d along = T_obj_cam.R * hit->ray_cam;
  double depth_m = hit->depth_m, phi = 0, slope = 0, grey;
  Vec3d normal{0, 0, 0}, rise;
  for (int step = 0; step < steps; ++step) {
    sample(sdf_, T_obj_cam.t + depth_m * along, &phi, &normal);
    slope = dot(normal, along);
    if (!(slope < -kMinSlant * norm(along) * norm(normal))) return false;
    depth_m -= phi / slope;
  }
  if (!(std::abs(phi) < static_cast<double>(sdf_.voxel_m))) return false;
  const Vec3d p = T_obj_cam.t + depth_m * along;
  if (!sample_brightness(sdf_, colors_, p, &grey, &rise)) return false;
  // The hit slides along its ray so that it stays on the surface.
  const Vec3d G = rise - (dot(rise, along) / slope) * normal, turn = cross(p, G);
  hit->depth_m = depth_m, hit->grey = grey;
  hit->J << G.x, G.y, G.z, turn.x, turn.y, turn.z;
  return true;
}

int PhotometricEnergy::settle(const optim::State& x) {
  const Rigidd& T = x.T_obj_cam[0];
  const double reach = kNearVoxels * static_cast<double>(sdf_.voxel_m);
  hits_->clear();
  for (std::size_t k = 0; k < pixels_->depth_m.size(); ++k) {
    const auto depth = static_cast<double>(pixels_->depth_m[k]);
    PhotometricHit hit;
    hit.ray_cam = ray(x.K, static_cast<double>(pixels_->u_px[k]), static_cast<double>(pixels_->v_px[k]));
    hit.depth_m = depth, hit.grey_seen = static_cast<double>(pixels_->grey[k]);
    if (!find(T, kSettleSteps, &hit) || !(std::abs(hit.depth_m - depth) < reach)) continue;
    double unused;
    Vec3d normal;
    sample(sdf_, T * (hit.depth_m * hit.ray_cam), &unused, &normal);
    hit.normal_cam = (1 / norm(normal)) * transpose_times(T.R, normal);
    hits_->push_back(hit);
  }
  followed_ = T;
  // A shape without colours pays nothing.
  tone_ = hits_->empty() ? Tone::Unit(0) : toned(Tone::Unit(0), kFirstRounds);
  return used();
}

// A pixel whose ray leaves what is known goes on with the brightness that it had, and says no more: were it
// to cost something, the border of what is known would hold the pose.
void PhotometricEnergy::follow(const Rigidd& T_obj_cam) {
  if (same_pose(T_obj_cam, followed_)) return;  // an accepted trial is linearised where its cost was taken
  followed_ = T_obj_cam;
  for (PhotometricHit& hit : *hits_)
    if (!find(T_obj_cam, kFollowSteps, &hit)) hit.J.setZero();
}

Tone PhotometricEnergy::prior_weight() const {
  Tone sd;
  sd << options_.gain_sigma, Eigen::Vector3d::Constant(options_.shading_sigma), options_.offset_sigma;
  return sd.cwiseAbs2().cwiseInverse();
}

// By reweighted least squares, with a prior about a frame that shows the brightness as it is.
Tone PhotometricEnergy::toned(Tone tone, int rounds) const {
  const double inv = 1 / (options_.sigma * options_.sigma);
  const Tone prior = prior_weight();
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix<double, 5, 5> H = prior.asDiagonal();
    Tone b = prior.cwiseProduct(Tone::Unit(0));
    for (const PhotometricHit& hit : *hits_) {
      const Tone J = basis(hit);
      const double w = weight(residual(tone, hit), inv);
      H.noalias() += (w * J) * J.transpose();
      b += w * hit.grey_seen * J;
    }
    tone = optim::solve_symmetric<5, 1>(H, b);
  }
  return tone;
}

double PhotometricEnergy::cost_of(const Tone& tone) const {
  const double inv = 1 / (options_.sigma * options_.sigma);
  const Tone off = tone - Tone::Unit(0);
  double sum = 0.5 * off.dot(prior_weight().cwiseProduct(off));
  for (const PhotometricHit& hit : *hits_) {
    const double r = residual(tone, hit);
    sum += std::log1p(0.5 * r * r * inv);
  }
  return sum;
}

double PhotometricEnergy::cost(const optim::State& x) {
  follow(x.T_obj_cam[0]);
  return cost_of(toned(tone_, kRounds));
}

// With the tone eliminated: it follows the pose.
void PhotometricEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  const double inv = 1 / (options_.sigma * options_.sigma);
  follow(x.T_obj_cam[0]);
  tone_ = toned(tone_, kRounds);
  using Row = Eigen::Matrix<double, 11, 1>;
  Eigen::Matrix<double, 11, 11> H = Eigen::Matrix<double, 11, 11>::Zero();
  Row g = Row::Zero();
  H.diagonal().tail<5>() = prior_weight();
  g.tail<5>() = prior_weight().cwiseProduct(tone_ - Tone::Unit(0));
  for (const PhotometricHit& hit : *hits_) {
    const double r = residual(tone_, hit), w = weight(r, inv);
    const double light = tone_[0] + dot(Vec3d{tone_[1], tone_[2], tone_[3]}, hit.normal_cam);
    const Row J = (Row() << light * hit.J, basis(hit)).finished();
    H.noalias() += (w * J) * J.transpose();
    g += w * r * J;
  }
  const Eigen::Matrix<double, 6, 5> by_tone =
      optim::solve_symmetric<5, 6>(H.bottomRightCorner<5, 5>(), H.bottomLeftCorner<5, 6>()).transpose();
  out->hessian += H.topLeftCorner<6, 6>() - by_tone * H.bottomLeftCorner<5, 6>();
  out->gradient += g.head<6>() - by_tone * g.tail<5>();
  out->cost += cost_of(tone_);
}

}  // namespace sdftrack::energies
