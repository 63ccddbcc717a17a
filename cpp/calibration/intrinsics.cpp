// SPDX-License-Identifier: MIT
#include "calibration/intrinsics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "base/normal.h"
#include "base/parallel.h"
#include "frame/selection.h"
#include "optim/dense.h"

namespace sdftrack::calibration {

namespace {

// Only ratios between depths matter here; the noise is taken as constant.
constexpr frame::DepthNoiseLaw kSensorNoise{0.001, 0};
constexpr int kMaxTwinDraws = 1000;
constexpr int kBalanceRounds = 8;
constexpr double kBalanced = 0.005;  // gain in log-likelihood left to the last step: 0.1 sd
constexpr double kMinHits = 0.8;     // of the most hits of any lens, for a lens to count as better
constexpr double kOpenShift = 1e-3;
constexpr double kKnown = 1e-6;  // of a direction's information, relative to one unknown alone

std::vector<LensFrame*> all_of(std::vector<LensFrame>* frames) {
  std::vector<LensFrame*> out;
  for (LensFrame& frame : *frames) out.push_back(&frame);
  return out;
}

// Information of an observation of a pose as "anywhere in the object's box, with any rotation".
optim::Vector6d weak_information(const frame::Shape& shape) {
  constexpr double kPi = 3.14159265358979323846;
  optim::Vector6d weak;
  weak.head<3>().setConstant(1 / (shape.diameter_m * shape.diameter_m));
  weak.tail<3>().setConstant(1 / (kPi * kPi));
  return weak;
}

// The number of directions in which a shift of the object, with the best rotation, hardly changes the
// measurements (information below a thousandth of the average), as of a pole or plate whose ends are out of
// view.
int open_shifts(const Eigen::Matrix<double, 6, 6>& pose) {
  const Eigen::Matrix3d cross = pose.topRightCorner<3, 3>(), turn = pose.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d shift =
      pose.topLeftCorner<3, 3>() - cross * optim::solve_symmetric<3, 3>(turn, cross.transpose());
  const Eigen::Vector3d values = optim::eigenpairs<3>(shift).values;
  const double usual = pose.topLeftCorner<3, 3>().trace() / 3;
  return int((values.array() < kOpenShift * usual).count());
}

// Newton's step without the directions that the frames leave open, each unknown scaled by its information.
optim::SharedVector step_within_the_known(const optim::SharedMatrix& information,
                                          const optim::SharedVector& pull) {
  const optim::SharedVector unit = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const optim::SharedMatrix scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const optim::Eigenpairs<Eigen::Dynamic> pairs = optim::eigenpairs<Eigen::Dynamic>(scaled);
  optim::SharedVector along = pairs.vectors.transpose() * unit.asDiagonal() * pull;
  for (int j = 0; j < along.size(); ++j)
    along[j] = pairs.values[j] > kKnown ? along[j] / pairs.values[j] : 0.0;
  return -(unit.asDiagonal() * (pairs.vectors * along));
}

}  // namespace

IntrinsicsProblem::IntrinsicsProblem(frame::Shape shape, const Lens& lens,
                                     const std::vector<LensUnknown>& free, const IntrinsicsOptions& options)
    : shape_(std::move(shape)), lens_(lens), options_(options) {
  free_.unknowns = free;
  free_.distorted = lens.camera.distorted();
  for (const LensUnknown which : free)
    free_.distorted |= which == LensUnknown::kK1 || which == LensUnknown::kK2;
}

int IntrinsicsProblem::add(const frame::DepthFrame& depth, const Rigidd& T_cam_obj) {
  const Rigidd centred{T_cam_obj.R, T_cam_obj * shape_.centre_obj};
  frame::PixelSelection selection;
  selection.choose(depth, lens_.camera, shape_, centred, kSensorNoise, options_.padding_m, nullptr);
  energies::PixelSet pixels;
  selection.pack(options_.max_pixels, &pixels);
  LensFrame frame;
  frame.T_obj_cam = inverse(centred);
  const int width = lens_.camera.width;
  for (std::size_t i = 0; i < pixels.at.size(); ++i) {
    // The frame's depth may have been corrected by the current lens.
    const double reading = (double(pixels.depth_m[i]) - lens_.depth_offset_m) / lens_.depth_scale;
    frame.pixels.push(pixels.at[i] % width, pixels.at[i] / width, reading);
  }
  frames_.push_back(std::move(frame));
  return pixels.count();
}

void IntrinsicsProblem::drop(const std::vector<int>& dropped) {
  std::vector<LensFrame> kept;
  for (int m = 0; m < frame_count(); ++m)
    if (std::find(dropped.begin(), dropped.end(), m) == dropped.end()) kept.push_back(std::move(frames_[m]));
  frames_ = std::move(kept);
}

Rigidd IntrinsicsProblem::T_cam_obj(int frame) const {
  const Rigidd centred = inverse(frames_.at(std::size_t(frame)).T_obj_cam);
  return {centred.R, centred * (-shape_.centre_obj)};
}

optim::LmRecord IntrinsicsProblem::solve(double scale_m, const LensPrior* prior, bool quick) {
  for (LensFrame& frame : frames_) frame.noise_m = 0;
  LensSolver solver(shape_.sdf, free_, options_, all_of(&frames_), &lens_, prior);
  solver.solve(scale_m, options_.stride(quick ? options_.coarse_pixels : options_.fine_pixels));
  if (!quick && !prior) balance(&solver);
  return solver.record();
}

optim::LmRecord IntrinsicsProblem::polish() {
  LensSolver solver(shape_.sdf, free_, options_, all_of(&frames_), &lens_, nullptr);
  solver.fine(options_.stride(options_.fine_pixels));
  balance(&solver);
  return solver.record();
}

// Newton's method on the gradients of all frames, each at its own optimum. Where rays begin or cease to meet
// the model, the cost jumps, which would stop a search for a lower cost; the gradients do not change.
void IntrinsicsProblem::balance(LensSolver* solver) {
  const int n = free_.count();
  Lens best = lens_;
  double least = std::numeric_limits<double>::infinity();
  long max_hits = 0;
  for (int round = 0; round < kBalanceRounds; ++round) {
    solver->poses();
    optim::SharedMatrix information = optim::SharedMatrix::Zero(n, n);
    optim::SharedVector pull = optim::SharedVector::Zero(n);
    long hits = 0;
    const std::vector<FrameEstimate> estimates = examine();
    for (const FrameEstimate& frame : estimates)
      information += frame.information, pull += frame.gradient, hits += frame.hits;
    max_hits = std::max(max_hits, hits);
    const optim::SharedVector step = step_within_the_known(information, pull);
    const double gain = -0.5 * step.dot(pull);
    // A lens under which the rays miss has no gradient: that is not an optimum.
    if (!(gain >= 0 && gain < least) || hits < kMinHits * max_hits) {
      lens_ = best;
      solver->poses();
      return;
    }
    best = lens_, least = gain;
    if (gain < kBalanced) return;
    for (int j = 0; j < n; ++j) {
      const LensUnknown which = free_.unknowns[j];
      lens_.set(which, lens_.get(which) + step[j]);
    }
    for (std::size_t m = 0; m < frames_.size(); ++m) {  // so that the frames start close to their optimum
      const optim::Vector6d d = -estimates[m].follow * step;
      Rigidd* const T = &frames_[m].T_obj_cam;
      *T = increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * *T;
    }
  }
}

FrameEstimate IntrinsicsProblem::estimate_of(LensFrame* frame, Lens lens) const {
  const LensSolver solver(shape_.sdf, free_, options_, {frame}, &lens, nullptr);
  const LensEnergy energy = solver.fine_energy();
  const energies::DepthLogistic<double> penalty = energy.penalty_of(*frame);
  const FrameSpread spread = frame->spread(energy.view(), penalty);
  const Eigen::MatrixXd& bread = spread.bread;
  const int n = free_.count();
  Eigen::Matrix<double, 6, 6> pose = bread.topLeftCorner<6, 6>();
  pose.diagonal() += weak_information(shape_);
  const Eigen::MatrixXd follow =
      optim::solve_symmetric<6, Eigen::Dynamic>(pose, bread.topRightCorner(6, n));  // the pose's response
  optim::ArrowBlock block;
  frame->linearize(energy.view(), penalty, false, &block);
  Eigen::MatrixXd along(6 + n, n);
  along << -follow, Eigen::MatrixXd::Identity(n, n);
  FrameEstimate out;
  out.follow = follow;
  out.value.resize(n);
  for (int j = 0; j < n; ++j) out.value[j] = lens.get(free_.unknowns[j]);
  out.information = bread.bottomRightCorner(n, n) - bread.bottomLeftCorner(n, 6) * follow;
  out.gradient = block.shared_gradient - follow.transpose() * block.pose_gradient;
  out.scatter = along.transpose() * spread.meat * along;
  out.noise_m = frame->noise_m;
  out.hits = int(block.count);
  out.open_shifts = open_shifts(pose);
  return out;
}

std::vector<FrameEstimate> IntrinsicsProblem::examine() {
  std::vector<FrameEstimate> out(frames_.size());
  parallel_for(frames_.size(), options_.threads,
               [&](std::size_t m) { out[m] = estimate_of(&frames_[m], lens_); });
  return out;
}

std::vector<FrameEstimate> IntrinsicsProblem::solve_each() {
  std::vector<FrameEstimate> out(frames_.size());
  IntrinsicsOptions alone = options_;
  alone.threads = 1;  // per frame; the frames run in parallel
  parallel_for(frames_.size(), options_.threads, [&](std::size_t m) {
    LensFrame frame = frames_[m];
    Lens lens = lens_;
    LensSolver(shape_.sdf, free_, alone, {&frame}, &lens, nullptr).fine();
    out[m] = estimate_of(&frame, lens);
  });
  return out;
}

std::vector<LensFrame::Reading> IntrinsicsProblem::readings(int frame) {
  return frames_.at(std::size_t(frame)).readings({shape_.sdf, lens_, free_});
}

std::vector<int> IntrinsicsProblem::coverage(int columns, int rows) const {
  std::vector<int> cells(std::size_t(columns) * rows);
  for (const LensFrame& frame : frames_)
    for (std::size_t i = 0; i < frame.pixels.used.size(); ++i) {
      if (!frame.pixels.used[i]) continue;
      const auto x = std::size_t(frame.pixels.u_px[i] * columns / lens_.camera.width);
      const auto y = std::size_t(frame.pixels.v_px[i] * rows / lens_.camera.height);
      ++cells[y * std::size_t(columns) + x];
    }
  return cells;
}

optim::SharedVector IntrinsicsProblem::bias(std::uint64_t seed, int pairs) {
  if (pairs < 1 || pairs > kMaxTwinDraws)
    throw std::invalid_argument("pairs: expected 1 to 1000, got " + std::to_string(pairs));
  const int n = free_.count();
  optim::SharedVector sum = optim::SharedVector::Zero(n);
  for (int pair = 0; pair < pairs; ++pair)
    for (const double sign : {1.0, -1.0}) {
      std::mt19937_64 random(seed + static_cast<std::uint64_t>(pair));
      Normal normal;
      std::vector<LensFrame> twins = frames_;
      for (LensFrame& twin : twins) {
        if (options_.residual == energies::Residual::kPoint)
          twin.classify({shape_.sdf, lens_, free_}, OutlineUse::kWithin);
        for (std::size_t i = 0; i < twin.pixels.reading_m.size(); ++i) {
          const double reading = (twin.pixels.hit_m[i] - lens_.depth_offset_m) / lens_.depth_scale;
          const double error = sign * twin.noise_m * normal(random);
          if (twin.pixels.used[i]) twin.pixels.reading_m[i] = reading + error;
        }
      }
      Lens lens = lens_;
      LensSolver(shape_.sdf, free_, options_, all_of(&twins), &lens, nullptr)
          .fine(options_.stride(options_.twin_pixels));
      for (int j = 0; j < n; ++j) {
        const LensUnknown which = free_.unknowns[j];
        sum[j] += lens.get(which) - lens_.get(which);
      }
    }
  return sum / (2.0 * pairs);
}

}  // namespace sdftrack::calibration
