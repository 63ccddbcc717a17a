// SPDX-License-Identifier: MIT
#include "calibration/lens_frame.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "energies/field.h"

namespace sdftrack::calibration {

namespace {

constexpr int kUnknowns = 6 + kLensUnknowns;
constexpr int kNewtonSteps = 8;   // at most, until a hit is exact: then the cost depends only on the state
constexpr double kMargin_px = 2;  // to the outline
constexpr double kStep_m = 0.02;  // between neighbours: more is an outline within the object

// Copies sums over all unknowns, lower triangle row by row, to the blocks.
void unpack(const double* gradient, const double* hessian, int size, optim::ArrowBlock* out) {
  for (int a = 0; a < size; ++a) {
    if (a < 6)
      out->pose_gradient[a] = gradient[a];
    else
      out->shared_gradient[a - 6] = gradient[a];
    for (int b = 0; b <= a; ++b, ++hessian) {
      if (a < 6)
        out->pose(a, b) = out->pose(b, a) = *hessian;
      else if (b < 6)
        out->cross(b, a - 6) = *hessian;
      else
        out->shared(a - 6, b - 6) = out->shared(b - 6, a - 6) = *hessian;
    }
  }
}

// Tested in units in which every unknown has curvature 1.
bool positive_definite(const Eigen::MatrixXd& H) {
  if (!(H.diagonal().minCoeff() > 0)) return false;
  const Eigen::VectorXd per_unit = H.diagonal().cwiseSqrt().cwiseInverse();
  return (per_unit.asDiagonal() * H * per_unit.asDiagonal()).eval().llt().info() == Eigen::Success;
}

}  // namespace

void LensPixels::push(double u, double v, double reading) {
  u_px.push_back(u), v_px.push_back(v), reading_m.push_back(reading);
  hit_m.push_back(reading), trial_hit_m.push_back(reading), gain.push_back(1), used.push_back(1);
}

LensFrame::Loop LensFrame::loop_over(const LensView& view, const Rigidd& T) {
  return {{view.sdf, T}, {1, 0}, view.lens.camera.K, {}, energies::Residual::kRayHit, false, kNewtonSteps};
}

// Calls visit(measurement, hit, J) for every pixel that counts: the residual, whether its ray meets the
// model, and d residual / d unknowns over the measurement's gain.
template <class Visit>
void LensFrame::each_row(const LensView& view, bool trial, const Visit& visit) {
  const Loop loop = loop_over(view, trial ? trial_T_obj_cam : T_obj_cam);
  std::vector<double>& hits = trial ? pixels.trial_hit_m : pixels.hit_m;  // a trial's hits may be discarded
  const std::vector<LensUnknown>& unknowns = view.free.unknowns;
  for (std::size_t at = 0; at < pixels.used.size(); at += std::size_t(view.stride)) {
    if (!pixels.used[at]) continue;
    const LensRay look = look_through(view.lens, view.free.distorted, pixels.u_px[at], pixels.v_px[at]);
    const double depth_m = view.lens.depth_m(pixels.reading_m[at]);
    const bool hit = pixels.gain[at] == 0;
    double z = hit ? pixels.hit_m[at] : depth_m;
    energies::FieldRow<double, 6> row;
    double per_slope = loop.find_hit<true>(look.ray, depth_m, hit, &z, &row);
    const auto lost = [&] {
      return !(std::abs(row.phi_m) < energies::kHitTolerance_m) || z == depth_m - energies::kHitLead_m;
    };
    if (hit && lost()) {  // again, from the measurement
      z = depth_m - energies::kHitLead_m;
      per_slope = loop.find_hit<true>(look.ray, depth_m, true, &z, &row);
      if (lost()) z = depth_m - energies::kHitReach_m;  // an outlier, until its ray meets the model again
    }
    if (hit) hits[at] = z;
    // In units of the noisy measurement: a lens that shrinks all depths gains nothing.
    const double gain = hit ? -per_slope : pixels.gain[at], per_scale = 1 / view.lens.depth_scale;
    const Loop::Reading reading{per_scale * (hit ? z - depth_m : gain * row.phi_m), per_scale * gain};
    double J[kUnknowns];
    std::copy_n(row.J, 6, J);
    for (std::size_t j = 0; j < unknowns.size(); ++j) {
      const auto k = std::size_t(unknowns[j]);
      J[6 + j] = z * (row.grad_cam.x * look.dx[k] + row.grad_cam.y * look.dy[k]);
      // The measured depth changes: residual = hit - depth, or phi at the depth.
      const double slope = hit ? -1 / gain : dot(row.grad_cam, look.ray);
      if (unknowns[j] == LensUnknown::kDepthScale)
        J[6 + j] = slope * pixels.reading_m[at] - reading.residual_m / gain;
      if (unknowns[j] == LensUnknown::kDepthOffset) J[6 + j] = slope;
    }
    visit(reading, hit, J);
  }
}

// Whether the rays next to a pixel's meet the model near its hit. Otherwise the pixel is on the outline,
// where a sensor mixes depths and a small change of the state makes rays miss.
bool LensFrame::neighbours_meet(const LensView& view, const Loop& loop, std::size_t at) const {
  for (const Vec2d step : {Vec2d{-kMargin_px, 0}, {kMargin_px, 0}, {0, -kMargin_px}, {0, kMargin_px}}) {
    const Vec3d ray =
        look_through(view.lens, view.free.distorted, pixels.u_px[at] + step.x, pixels.v_px[at] + step.y).ray;
    double z = pixels.hit_m[at];
    energies::FieldRow<double, 6> row;
    loop.find_hit<false>(ray, z, true, &z, &row);
    if (!(std::abs(row.phi_m) < energies::kHitTolerance_m) || std::abs(z - pixels.hit_m[at]) > kStep_m)
      return false;
  }
  return true;
}

void LensFrame::classify(const LensView& view, OutlineUse outline) {
  double depth_m = 0, gain = 0, hit_m = 0;
  const double per_noise = 1;
  Loop loop = loop_over(view, T_obj_cam);
  loop.pixels = {1, nullptr, nullptr, &depth_m, &per_noise, &hit_m, &gain};
  loop.reclassify = true;
  for (std::size_t at = 0; at < pixels.used.size(); at += std::size_t(view.stride)) {
    depth_m = view.lens.depth_m(pixels.reading_m[at]);
    if (outline == OutlineUse::kPoints) {
      pixels.gain[at] = 1, pixels.used[at] = 1;
      continue;
    }
    energies::FieldRow<double, 6> row;
    loop.read_along(look_through(view.lens, view.free.distorted, pixels.u_px[at], pixels.v_px[at]).ray, 0, 1,
                    &row);
    pixels.gain[at] = gain, pixels.hit_m[at] = hit_m;
    pixels.used[at] = outline == OutlineUse::kAll || (gain == 0 && neighbours_meet(view, loop, at));
  }
}

void LensFrame::accept() {
  T_obj_cam = trial_T_obj_cam;
  std::swap(pixels.hit_m, pixels.trial_hit_m);
}

void LensFrame::linearize(const LensView& view, const energies::DepthLogistic<double>& penalty, bool trial,
                          optim::ArrowBlock* out) {
  const int size = 6 + view.free.count();
  double gradient[kUnknowns] = {}, hessian[kUnknowns * (kUnknowns + 1) / 2] = {};
  out->reset(view.free.count());
  each_row(view, trial, [&](const Loop::Reading& reading, bool, const double* J) {
    const energies::Curve<double> c = penalty(reading.residual_m, 1.0);
    out->cost += c.cost, out->count += 1;
    const double slope = c.slope * reading.gain, curvature = c.curvature * reading.gain * reading.gain;
    for (int a = 0, k = 0; a < size; ++a) {
      gradient[a] += slope * J[a];
      const double weighted = curvature * J[a];
      for (int b = 0; b <= a; ++b) hessian[k++] += weighted * J[b];
    }
  });
  unpack(gradient, hessian, size, out);
}

std::vector<LensFrame::Reading> LensFrame::readings(const LensView& view) {
  std::vector<Reading> out;
  out.reserve(pixels.used.size());
  each_row(view, false, [&](const Loop::Reading& reading, bool hit, const double*) {
    out.push_back({reading.residual_m, hit});
  });
  return out;
}

FrameSpread LensFrame::spread(const LensView& view, const energies::DepthLogistic<double>& penalty) {
  const int size = 6 + view.free.count();
  FrameSpread out;
  out.meat.setZero(size, size), out.bread.setZero(size, size);
  Eigen::MatrixXd weighted = Eigen::MatrixXd::Zero(size, size);
  double bends = 0, weights = 0;
  each_row(view, false, [&](const Loop::Reading& reading, bool, const double* J) {
    const energies::Curve<double> c = penalty(reading.residual_m, 1.0);
    const double psi = c.slope * reading.gain, per_gain = reading.gain * reading.gain;
    const double bend = penalty.second_derivative(reading.residual_m, 1.0);
    bends += bend, weights += c.curvature;
    for (int a = 0; a < size; ++a) {
      for (int b = 0; b < size; ++b) {
        out.meat(a, b) += psi * psi * J[a] * J[b];
        out.bread(a, b) += bend * per_gain * J[a] * J[b];
        weighted(a, b) += c.curvature * per_gain * J[a] * J[b];
      }
    }
  });
  // Outliers have negative second derivatives. If they dominate, the scaled weights replace these.
  if (!positive_definite(out.bread) && weights > 0) out.bread = std::max(bends, 0.0) / weights * weighted;
  return out;
}

}  // namespace sdftrack::calibration
