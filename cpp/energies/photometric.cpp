// SPDX-License-Identifier: MIT
#include "energies/photometric.h"

#include <cmath>

#include "optim/dense.h"

namespace sdftrack::energies {

namespace {

using Tone = PhotometricEnergy::Tone;

constexpr int kSettleSteps = 4;
constexpr double kNearVoxels = 3;  // a measurement farther from the surface shows something else
constexpr int kFirstRounds = 6;

Tone basis(const PhotometricHit& hit) {
  Tone out;
  PhotometricTerm::basis(hit, out.data());
  return out;
}

bool same_vector(Vec3d a, Vec3d b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
bool same_pose(const Rigidd& a, const Rigidd& b) {
  return same_vector(a.t, b.t) && same_vector(a.R.r0, b.R.r0) && same_vector(a.R.r1, b.R.r1) &&
         same_vector(a.R.r2, b.R.r2);
}

}  // namespace

PhotometricTerm PhotometricEnergy::term_of(const SdfView& sdf, const ColorView& colors,
                                           const PhotometricOptions& options) {
  PhotometricTerm term{sdf, colors, 1 / (options.sigma * options.sigma), {}};
  const double sd[kTone] = {options.gain_sigma, options.shading_sigma, options.shading_sigma,
                            options.shading_sigma, options.offset_sigma};
  for (int k = 0; k < kTone; ++k) term.tone_prior[k] = 1 / (sd[k] * sd[k]);
  return term;
}

Brightness PhotometricEnergy::on_device() const {
  Brightness out{term_, hits_->data(), used(), {}};
  Eigen::Map<Tone>(out.tone) = tone_;
  return out;
}

int PhotometricEnergy::settle(const optim::State& x) {
  const Rigidd& T = x.T_obj_cam[0];
  const double reach = kNearVoxels * double(term_.sdf.voxel_m);
  hits_->clear();
  for (std::size_t k = 0; k < pixels_->depth_m.size(); ++k) {
    const auto depth = double(pixels_->depth_m[k]);
    PhotometricHit hit;
    hit.ray_cam = ray(x.K, double(pixels_->u_px[k]), double(pixels_->v_px[k]));
    hit.depth_m = depth, hit.grey_seen = double(pixels_->grey[k]);
    if (!term_.find(T, kSettleSteps, &hit) || !(std::abs(hit.depth_m - depth) < reach)) continue;
    double unused;
    Vec3d normal;
    sample(term_.sdf, T * (hit.depth_m * hit.ray_cam), &unused, &normal);
    hit.normal_cam = (1 / norm(normal)) * transpose_times(T.R, normal);
    hits_->push_back(hit);
  }
  followed_ = T;
  // A shape without colours costs nothing.
  tone_ = hits_->empty() ? Tone::Unit(0) : toned(Tone::Unit(0), kFirstRounds);
  return used();
}

void PhotometricEnergy::follow(const Rigidd& T_obj_cam) {
  if (same_pose(T_obj_cam, followed_)) return;  // an accepted trial is linearised at the pose of its cost
  followed_ = T_obj_cam;
  for (PhotometricHit& hit : *hits_)
    if (!term_.find(T_obj_cam, kFollowSteps, &hit)) hit.fall_silent();
}

Tone PhotometricEnergy::prior_weight() const { return Eigen::Map<const Tone>(term_.tone_prior); }

// By reweighted least squares, with a prior about a frame that shows the brightness unchanged.
Tone PhotometricEnergy::toned(Tone tone, int rounds) const {
  const Tone prior = prior_weight();
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix<double, kTone, kTone> H = prior.asDiagonal();
    Tone b = prior.cwiseProduct(Tone::Unit(0));
    for (const PhotometricHit& hit : *hits_) {
      const Tone J = basis(hit);
      const double w = term_.weight(PhotometricTerm::residual(tone.data(), J.data(), hit));
      H.noalias() += (w * J) * J.transpose();
      b += w * hit.grey_seen * J;
    }
    tone = optim::solve_symmetric<5, 1>(H, b);
  }
  return tone;
}

double PhotometricEnergy::cost_of(const Tone& tone) const {
  const Tone off = tone - Tone::Unit(0);
  double sum = 0.5 * off.dot(prior_weight().cwiseProduct(off));
  for (const PhotometricHit& hit : *hits_)
    sum += term_.loss(PhotometricTerm::residual(tone.data(), basis(hit).data(), hit));
  return sum;
}

double PhotometricEnergy::cost(const optim::State& x) {
  follow(x.T_obj_cam[0]);
  return cost_of(toned(tone_, kToneRounds));
}

// The tone is eliminated, because it follows the pose.
void PhotometricEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  follow(x.T_obj_cam[0]);
  tone_ = toned(tone_, kToneRounds);
  using Row = Eigen::Matrix<double, kToned, 1>;
  Eigen::Matrix<double, kToned, kToned> H = Eigen::Matrix<double, kToned, kToned>::Zero();
  Row g = Row::Zero();
  H.diagonal().tail<5>() = prior_weight();
  g.tail<5>() = prior_weight().cwiseProduct(tone_ - Tone::Unit(0));
  for (const PhotometricHit& hit : *hits_) {
    const Tone B = basis(hit);
    const double r = PhotometricTerm::residual(tone_.data(), B.data(), hit), w = term_.weight(r);
    Row J;
    PhotometricTerm::row(tone_.data(), B.data(), hit, J.data());
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
