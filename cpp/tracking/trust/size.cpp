// SPDX-License-Identifier: MIT
#include "tracking/trust/size.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/to_int.h"
#include "optim/camera_increment.h"
#include "optim/dense.h"
#include "tracking/trust/systematic.h"

namespace sdftrack::tracking {

namespace {

constexpr int kSizePixels = 300, kMinPixels = 60;  // pixels
constexpr int kBlocks = 6;                         // along x and y: within one, errors may be shared
constexpr double kBlocksReach = 2;                 // of the blocks from the middle of the pixels, in their sd
constexpr double kMedianOfNormal = 0.6745;
constexpr double kFirstSize = 6, kSize = 2.5;  // of the residuals that count in full, over the noise
constexpr int kRounds = 3;
constexpr int kNewtonSteps = 2;
constexpr double kGrain = 0.04;  // voxels
constexpr double kSays = 0.015;  // sd of one frame beyond which it says nothing
constexpr float kFar_m = 0.03;   // a residual beyond this is of something else
constexpr std::size_t kMinLines = 30;
constexpr double kMinSystematic_m = 1.5e-4;  // of volumes and sensors that are called free of errors
constexpr double kDistanceShare = 0.01;      // sd of the distance at which an outline is judged, over itself
constexpr double kCommon_px = 0.5;           // sd of the offset that all lines share
constexpr int kMaxFrames = 30;               // the mean follows the last ones
constexpr double kNewView_rad = 0.35;
constexpr double kLeastSize = 0.002;  // log scale: volumes of meshes are off by as much
constexpr double kBand = 0.01;        // of the scale: as much as meshes are off
constexpr double kSure_sd = 4.5;      // as everywhere where one says that two things can be told apart
constexpr double kAgree_sd = 3, kLikely_sd = 1.5;
constexpr double kInterval_sd = 1.96, kInterval = 0.003;  // of the volume itself
constexpr double kOutlineReaches = 0.1;  // log scale: lines are searched so near to the model's silhouette
constexpr double kExplained = 0.5;       // of the residuals' spread, left by a size that is the cause of them
constexpr double kTellingSd = 0.032;     // an outline that says less is no witness
constexpr double kRescaleFrom = 0.002, kRescaleSd = 0.5;  // a smaller log scale is left; of its own sd
constexpr double kCurved = 0.03;   // an estimate at a log scale farther away is of another problem
constexpr double kKnownSd = 0.05;  // of a free scale
constexpr double kShares[kBiasModes] = {kOffsetShare,    kLinearShare,    kLinearShare,
                                        kQuadraticShare, kQuadraticShare, kQuadraticShare};

// Least squares of pose, log scale and others.
template <int N>
struct Normals {
  Eigen::Matrix<double, N, N> H = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> g = Eigen::Matrix<double, N, 1>::Zero();

  void add(const Eigen::Matrix<double, N, 1>& row, double error, double weight) {
    H.noalias() += (weight * row) * row.transpose();
    g += (weight * error) * row;
  }
};

// The pose's answer to the log scale, unknown 6, has all others eliminated.
template <int N>
SizeLook look_of(const Eigen::Matrix<double, N, 1>& x, const Eigen::Matrix<double, N, N>& C, double own_var,
                 double shared_var) {
  return {x[6], own_var, shared_var, C.col(6).template head<6>() / C(6, 6)};
}

constexpr int kUnknowns = 7 + kBiasModes;
using Row = Eigen::Matrix<double, kUnknowns, 1>;
using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;
constexpr int kMaxPixels = 2 * kSizePixels;

// A pixel that shows the surface, beside its row and its error.
struct Reading {
  double share;
  int block;
};

// The readings of a subset, and the fit to them.
class DepthFit {
 public:
  DepthFit(const energies::PixelSet& pixels, float color_prior, const frame::Shape& shape,
           const Camera& camera, const Rigidd& T_obj_cam);
  // Reads again at the pose and the log scale that have been found.
  void linearize_there();
  bool enough() const { return count_ >= kMinPixels; }
  // Readings weigh less from this size of their residual on.
  void weigh(double size_m);
  void solve(double systematic_m, const frame::Shape& shape);
  double spread_m() const;  // of the residuals, by their median
  SizeLook look() const;

 private:
  double grain_var() const;
  double residual(int i) const { return error_m_[i] - rows_.col(i).dot(x_); }

  void read(bool move);

  const energies::PixelSet& pixels_;
  float color_prior_;
  const SdfView& sdf_;
  Intrinsics<float> K_;
  Rigidd T_obj_cam_;
  double log_scale_ = 0;  // at which the readings are
  // One column for each pixel.
  Eigen::Matrix<double, kUnknowns, kMaxPixels> rows_, pulls_;  // pulls: times their weights
  Eigen::Matrix<double, kMaxPixels, 1> error_m_;
  std::array<Reading, kMaxPixels> all_;
  std::array<double, kMaxPixels> weight_;
  int count_ = 0;
  Square readings_ = Square::Zero(), priors_ = Square::Zero(), C_ = Square::Zero();
  double weights_ = 0;
  Row x_ = Row::Zero();
};

DepthFit::DepthFit(const energies::PixelSet& pixels, float color_prior, const frame::Shape& shape,
                   const Camera& camera, const Rigidd& T_obj_cam)
    : pixels_(pixels),
      color_prior_(color_prior),
      sdf_(shape.sdf),
      K_(camera.K.cast<float>()),
      T_obj_cam_(T_obj_cam) {
  read(false);
}

void DepthFit::linearize_there() {
  T_obj_cam_ = increment(Vec3d{x_[0], x_[1], x_[2]}, Vec3d{x_[3], x_[4], x_[5]}) * T_obj_cam_;
  log_scale_ += x_[6];
  x_.setZero();
  read(true);
}

// move: the pixels' hits are those of another pose and size.
void DepthFit::read(bool move) {
  const std::size_t n = pixels_.gain.size(), stride = std::max<std::size_t>(1, n / kSizePixels);
  const ModeExtent u(pixels_.u_px, pixels_.gain, stride), v(pixels_.v_px, pixels_.gain, stride);
  const auto cell = [](double x) {
    return std::clamp(to_int((x + kBlocksReach) * kBlocks / (2 * kBlocksReach)), 0, kBlocks - 1);
  };
  const Rigidf T = T_obj_cam_.cast<float>();
  const auto scale = static_cast<float>(std::exp(log_scale_));
  count_ = 0;
  for (std::size_t i = 0; i < n && count_ < kMaxPixels; i += stride) {
    if (pixels_.gain[i] != 0) continue;
    const Vec3f direction = ray(K_, pixels_.u_px[i], pixels_.v_px[i]), along_obj = T.R * direction;
    float hit_m = pixels_.hit_m[i], phi = 0, slope = 0;
    Vec3f p_obj, g;
    for (int step = 0; step <= (move ? kNewtonSteps : 0); ++step) {
      if (step > 0) hit_m -= scale * phi / slope;
      p_obj = T * (hit_m * direction);
      sample(sdf_, (1 / scale) * p_obj, &phi, &g);
      slope = dot(g, along_obj);
      if (!(std::abs(slope) > kGrazing)) break;
    }
    const float error_m = pixels_.depth_m[i] - hit_m;
    if (!(std::abs(slope) > kGrazing) || !(std::abs(error_m) < kFar_m)) continue;
    const Vec3f m = cross(p_obj, g);
    auto row = rows_.col(count_);
    row.head<6>() << static_cast<double>(g.x), static_cast<double>(g.y), static_cast<double>(g.z),
        static_cast<double>(m.x), static_cast<double>(m.y), static_cast<double>(m.z);
    row.head<6>() *= -1 / static_cast<double>(slope);
    row[6] = static_cast<double>(dot(g, p_obj) / slope);
    const double x = u.at(pixels_.u_px[i]), y = v.at(pixels_.v_px[i]);
    row.tail<kBiasModes>() = bias_modes_at(x, y);
    error_m_[count_] = static_cast<double>(error_m);
    Reading& r = all_[static_cast<std::size_t>(count_++)];
    r.share =
        color_prior_ > 0 ? std::min(1.0, static_cast<double>(pixels_.foreground[i] / color_prior_)) : 1.0;
    r.block = kBlocks * cell(y) + cell(x);
  }
}

void DepthFit::weigh(double size_m) {
  for (int i = 0; i < count_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double off = residual(i) / size_m;
    weight_[k] = all_[k].share / (size_m * size_m * (1 + off * off));
  }
}

void DepthFit::solve(double systematic_m, const frame::Shape& shape) {
  const auto rows = rows_.leftCols(count_);
  for (int i = 0; i < count_; ++i) pulls_.col(i) = weight_[static_cast<std::size_t>(i)] * rows_.col(i);
  const auto pulls = pulls_.leftCols(count_);
  readings_.triangularView<Eigen::Lower>() = pulls * rows.transpose();
  const Row g = pulls * error_m_.head(count_);
  weights_ = 0;
  for (int i = 0; i < count_; ++i) weights_ += weight_[static_cast<std::size_t>(i)];
  priors_.setZero();
  priors_.topLeftCorner<6, 6>() = weak_knowledge(shape);
  priors_(6, 6) = 1;  // a log scale of 1 is nothing
  for (int k = 0; k < kBiasModes; ++k)
    priors_(7 + k, 7 + k) = std::pow(kShares[k] * std::max(systematic_m, kMinSystematic_m), -2);
  C_ = optim::inverse_symmetric<kUnknowns>(Square(readings_ + priors_));
  x_ = C_ * g;
}

double DepthFit::spread_m() const {
  std::array<double, kMaxPixels> sizes;
  for (int i = 0; i < count_; ++i) sizes[static_cast<std::size_t>(i)] = std::abs(residual(i));
  std::nth_element(sizes.begin(), sizes.begin() + count_ / 2, sizes.begin() + count_);
  return sizes[static_cast<std::size_t>(count_ / 2)] / kMedianOfNormal;
}

// Of the faces of a box a shift takes up any size, and what is left, the edges, are rounded by the volume: an
// error of the voxels over the slope that the readings have along the size beside the pose.
double DepthFit::grain_var() const {
  Eigen::Matrix<double, 7, 7> H = readings_.topLeftCorner<7, 7>();
  H.diagonal() += priors_.diagonal().head<7>();
  return std::pow(kGrain * static_cast<double>(sdf_.voxel_m), 2) * weights_ *
         optim::inverse_symmetric<7>(H)(6, 6);
}

// The sandwich: errors within a block of the image are taken as shared.
SizeLook DepthFit::look() const {
  std::array<double, kBlocks * kBlocks> pulls{};
  const Row along = C_.col(6);
  for (int i = 0; i < count_; ++i) {
    const Reading& r = all_[static_cast<std::size_t>(i)];
    pulls[static_cast<std::size_t>(r.block)] +=
        weight_[static_cast<std::size_t>(i)] * residual(i) * along.dot(rows_.col(i));
  }
  double own = 0;
  int blocks = 0;
  for (const double pull : pulls) own += pull * pull, blocks += pull != 0;
  own *= blocks > 2 * 7 ? static_cast<double>(blocks) / (blocks - 7) : 2.0;  // what the fit has taken up
  SizeLook look = look_of<kUnknowns>(x_, C_, own, along.dot(priors_ * along) + grain_var());
  look.log_scale += log_scale_;
  return look;
}

double sd_of(const SizeLook& look) { return std::sqrt(look.own_var + look.shared_var); }

std::string shown(const char* format, double a, double b, double c) {
  char text[256];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

}  // namespace

std::optional<SizeLook> size_by_depth(const energies::PixelSet& pixels, float color_prior,
                                      const frame::Shape& shape, const Camera& camera,
                                      const Rigidd& T_obj_cam, double noise_m, double systematic_m) {
  DepthFit fit(pixels, color_prior, shape, camera, T_obj_cam);
  if (!fit.enough()) return std::nullopt;
  // Another size makes residuals of millimetres: only what is left beside it is no surface of the object, and
  // tells how much the sensor bends.
  const double spread_m = std::max(noise_m, fit.spread_m());
  fit.weigh(kFirstSize * noise_m);
  fit.solve(systematic_m, shape);
  SizeLook look;
  bool bends = false;
  for (int round = 0; round < kRounds; ++round) {
    const double left_m = fit.spread_m();
    fit.weigh(kSize * std::max(noise_m, left_m));
    fit.solve(std::max(systematic_m, systematic_by_residuals(left_m, noise_m)), shape);
    look = fit.look();
    const bool differs = std::abs(look.log_scale) > kAgree_sd * sd_of(look);
    const bool says = sd_of(look) <= kSays;
    if (!says && !differs) return std::nullopt;
    bends = bends || !says;
    if (!differs && round > 0) break;  // weighed once more is enough
    if (round + 1 == kRounds || !differs) continue;
    fit.linearize_there();  // less is left beside it there
    if (!fit.enough()) return std::nullopt;
  }
  look.unexplained = fit.spread_m() / spread_m;
  // A sensor that bends may look like another size, but what it bends is left.
  if (sd_of(look) > kSays || (bends && look.unexplained > kExplained)) return std::nullopt;
  return look;
}

std::optional<SizeLook> size_by_outline(const energies::OutlineLines& lines,
                                        const std::vector<energies::OutlineResidual>& rows, double noise,
                                        const Rigidd& T_obj_cam, const Vector6d& to_depth,
                                        double shared_lines) {
  if (rows.size() < kMinLines || rows.size() != lines.lines.size()) return std::nullopt;
  Normals<8> sums;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const energies::OutlineLine& line = lines.lines[i];
    Eigen::Matrix<double, 8, 1> row;
    row.head<6>() = rows[i].J;
    row[6] = -(row[0] * line.p_obj.x + row[1] * line.p_obj.y + row[2] * line.p_obj.z);
    row[7] = 1 / (noise * line.sd_px);
    sums.add(row, -rows[i].off, 1 / (1 + 0.5 * rows[i].off * rows[i].off) / shared_lines);
  }
  const Vec3d along = T_obj_cam.R * Vec3d{0, 0, 1};
  const Eigen::Vector3d e(along.x, along.y, along.z);
  const double sd_m = kDistanceShare * inverse(T_obj_cam).t.z;
  sums.H.topLeftCorner<3, 3>() += e * e.transpose() / (sd_m * sd_m);
  sums.g.head<3>() += e.dot(to_depth.head<3>()) / (sd_m * sd_m) * e;
  sums.H.topLeftCorner<6, 6>().diagonal().array() += 1e-3;
  sums.H(6, 6) += 1;
  sums.H(7, 7) += 1 / (kCommon_px * kCommon_px);
  const Eigen::Matrix<double, 8, 8> C = optim::inverse_symmetric<8>(sums.H);
  return look_of<8>(C * sums.g, C, 0, C(6, 6));
}

void SizeWitness::observe(const SizeLook& look, const Mat3d& R_cam_obj) {
  if (!view_ || rotation_angle(R_cam_obj * transpose(view_->R)) > kNewView_rad)
    ++views_, view_ = Rigidd{R_cam_obj, {0, 0, 0}};
  const double rate = 1.0 / std::min(++frames_, kMaxFrames), off = look.log_scale - mean_;
  scatter_ += rate * (frames_ > 1 ? off * off - scatter_ : 0);
  mean_ += rate * off;
  own_var_ += rate * (look.own_var - own_var_);
  shared_var_ += rate * (look.shared_var - shared_var_);
  pull_ = look.pull;
  unexplained_ += rate * (look.unexplained - unexplained_);
}

double SizeWitness::sd() const {
  const double own = std::max(own_var_, scatter_) / std::min(std::max(1, frames_), kMaxFrames);
  return std::sqrt(own + shared_var_ / std::max(1, views_));
}

void SizeWitness::rescaled(double log_scale) {
  if (std::abs(log_scale) > kCurved) {
    const Vector6d pull = pull_;
    *this = {};
    pull_ = pull;
  } else {
    mean_ -= log_scale;
  }
}

// Of what is farther away the outline finds other lines.
bool SizeTest::outline_out_of_reach() const {
  return depth.known() && std::abs(depth.log_scale()) > kOutlineReaches && depth.unexplained() < kExplained;
}

SizeTest::LogScale SizeTest::free_scale() const {
  double information = 0, sum = 0;
  for (const SizeWitness* one : {&depth, &outline}) {
    if (!one->known() || (one == &outline && outline_out_of_reach())) continue;
    const double weight = std::pow(one->sd(), -2);
    information += weight, sum += weight * one->log_scale();
  }
  if (!(information > 0)) return {};
  return {sum / information, 1 / std::sqrt(information)};
}

double SizeTest::log_scale_to_add() const {
  const LogScale s = free_scale();
  return std::abs(s.mean) > std::max(kRescaleFrom, kRescaleSd * s.sd) ? s.mean : 0;
}

void SizeTest::rescaled(double log_scale) {
  depth.rescaled(log_scale);
  outline.rescaled(log_scale);
}

bool SizeTest::determines_scale() const { return free_scale().sd < kKnownSd; }

Matrix6d SizeTest::free_covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const {
  const double sd = std::min(1.0, free_scale().sd);
  Vector6d shift = sd * (optim::camera_by_increment(T_cam_obj, -shape.centre_obj) * depth.pull());
  // The origin of a larger shape is farther from its centre.
  const Vec3d origin = T_cam_obj.R * shape.centre_obj;
  shift.head<3>() -= sd * Eigen::Vector3d(origin.x, origin.y, origin.z);
  return shift * shift.transpose();
}

std::string SizeTest::other_size() const {
  if (!depth.known()) return {};
  const double s = depth.log_scale(), sd = depth.sd();
  if (!(std::abs(s) - kBand > kSure_sd * sd)) return {};
  if (outline.known() && !outline_out_of_reach() &&
      std::abs(s - outline.log_scale()) > kBand + kAgree_sd * std::hypot(sd, outline.sd()))
    return {};
  const auto percent = [](double log_scale) { return 100 * std::abs(std::expm1(log_scale)); };
  const double half = kInterval_sd * sd + kInterval;
  const double a = percent(s - half), b = percent(s + half);
  return shown(
      s > 0 ? "the object appears %.1f %% larger than the model (%.1f to %.1f), or its depths are too "
              "large by as much; check the mesh and its unit"
            : "the object appears %.1f %% smaller than the model (%.1f to %.1f), or its depths are too "
              "small by as much; check the mesh and its unit",
      percent(s), std::min(a, b), std::max(a, b));
}

bool SizeTest::outline_agrees() const {
  return outline.known() && outline.sd() < kTellingSd &&
         std::abs(outline.log_scale()) < kBand + kLikely_sd * outline.sd();
}

Matrix6d SizeTest::covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const {
  if (!depth.known()) return Matrix6d::Zero();
  const double sure = std::max(0.0, std::abs(depth.log_scale()) - kAgree_sd * depth.sd() - kLeastSize);
  const Vector6d shift = sure * (optim::camera_by_increment(T_cam_obj, -shape.centre_obj) * depth.pull());
  return shift * shift.transpose();
}

}  // namespace sdftrack::tracking
