// SPDX-License-Identifier: MIT
#include "tracking/size/depth_size.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/to_int.h"
#include "optim/camera_increment.h"
#include "optim/dense.h"
#include "tracking/trust/systematic.h"

namespace sdftrack::tracking {

namespace {

constexpr int kSizePixels = 300, kMinPixels = 60;  // pixels
constexpr int kBlocks = 6;                         // along x and y: errors may be shared within one
constexpr double kBlocksReach = 2;                 // of the blocks from the middle of the pixels, in their sd
constexpr double kMedianOfNormal = 0.6745;
constexpr double kFirstSize = 6, kSize = 2.5;  // of the residuals with full weight, over the noise
constexpr int kRounds = 3, kStrainRounds = 2;
constexpr int kNewtonSteps = 2;
constexpr double kGrain = 0.04;              // voxels
constexpr double kSays = 0.015;              // sd of one frame beyond which the estimate is not used
constexpr float kFar_m = 0.03;               // a residual beyond this is that of something else
constexpr double kMinSystematic_m = 1.5e-4;  // of volumes and sensors that are stated to be free of errors
constexpr double kDiffers_sd = 3;
constexpr double kStrainSays = 0.06, kMaxStretch = 0.7;  // sd and size of a log stretch, at most
constexpr double kShares[kBiasModes] = {kOffsetShare,    kLinearShare,    kLinearShare,
                                        kQuadraticShare, kQuadraticShare, kQuadraticShare};

constexpr int kLogScale = 6, kModes = 7, kFirstStrain = kModes + kBiasModes;
constexpr int kMaxPixels = 2 * kSizePixels;

Eigen::Vector3d vector_of(const Vec3f& v) { return {double(v.x), double(v.y), double(v.z)}; }

// A pixel that shows the surface, with its row and its error.
struct Reading {
  double share;
  int block;
};

// The pixels of a subset, and the fit to them: pose, log scale, the sensor's modes, and kStrains strains.
template <int kStrains>
class DepthFit {
 public:
  static constexpr int kUnknowns = kFirstStrain + kStrains;

  DepthFit(const energies::PixelSet& pixels, float color_prior, const frame::Shape& shape,
           const Camera& camera, const Rigidd& T_obj_cam);
  // Evaluates the measurements again at the pose and the log scale found.
  void linearize_there();
  bool enough() const { return count_ >= kMinPixels; }
  // Measurements with residuals above this size get less weight.
  void weigh(double size_m);
  void solve(double systematic_m, const frame::Shape& shape);
  double spread_m() const;  // of the residuals, by their median
  SizeLook look() const;
  StrainLook strain_look() const;

 private:
  using Row = Eigen::Matrix<double, kUnknowns, 1>;
  using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using PerPixel = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxPixels, 1>;

  double grain_var() const;
  PerPixel residuals() const;
  PerPixel weighted(int k) const { return weight_.head(count_).cwiseProduct(along_pixels(k)); }
  auto along_pixels(int k) const { return columns_.col(k).head(count_); }

  void read(bool move);

  const energies::PixelSet& pixels_;
  float color_prior_;
  const SdfView& sdf_;
  const Vec3f middle_obj_;
  Intrinsics<float> K_;
  Rigidd T_obj_cam_;
  double log_scale_ = 0;  // of the current evaluation
  // One column for each unknown, one row for each pixel: sums run over contiguous pixels.
  Eigen::Matrix<double, kMaxPixels, kUnknowns> columns_;
  Eigen::Matrix<double, kMaxPixels, 1> error_m_, weight_;
  std::array<Reading, kMaxPixels> all_;
  int count_ = 0;
  Square readings_ = Square::Zero(), priors_ = Square::Zero(), C_ = Square::Zero();
  double weights_ = 0;
  Row x_ = Row::Zero();
};

template <int kStrains>
DepthFit<kStrains>::DepthFit(const energies::PixelSet& pixels, float color_prior, const frame::Shape& shape,
                             const Camera& camera, const Rigidd& T_obj_cam)
    : pixels_(pixels),
      color_prior_(color_prior),
      sdf_(shape.sdf),
      middle_obj_(shape.moments.mean.cast<float>()),
      K_(camera.K.cast<float>()),
      T_obj_cam_(T_obj_cam) {
  read(false);
}

template <int kStrains>
void DepthFit<kStrains>::linearize_there() {
  T_obj_cam_ = increment(Vec3d{x_[0], x_[1], x_[2]}, Vec3d{x_[3], x_[4], x_[5]}) * T_obj_cam_;
  log_scale_ += x_[6];
  x_.setZero();
  read(true);
}

// move: the pixels' hits are those of another pose and size.
template <int kStrains>
void DepthFit<kStrains>::read(bool move) {
  const std::size_t n = pixels_.gain.size(), stride = std::max<std::size_t>(1, n / kSizePixels);
  const ModeExtent u(pixels_.u_px, pixels_.gain, stride), v(pixels_.v_px, pixels_.gain, stride);
  const auto cell = [](double x) {
    return std::clamp(to_int((x + kBlocksReach) * kBlocks / (2 * kBlocksReach)), 0, kBlocks - 1);
  };
  const Rigidf T = T_obj_cam_.cast<float>();
  const auto scale = float(std::exp(log_scale_));
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
    Row row;
    row.template head<6>() << double(g.x), double(g.y), double(g.z), double(m.x), double(m.y), double(m.z);
    row.template head<6>() *= -1 / double(slope);
    row[6] = double(dot(g, p_obj) / slope);
    if constexpr (kStrains > 0)
      row.template tail<kStrains>() = strains(vector_of((1 / slope) * g), vector_of(p_obj - middle_obj_));
    const double x = u.at(pixels_.u_px[i]), y = v.at(pixels_.v_px[i]);
    row.template segment<kBiasModes>(kModes) = bias_modes_at(x, y);
    columns_.row(count_) = row.transpose();
    error_m_[count_] = double(error_m);
    Reading& r = all_[count_++];
    r.share = color_prior_ > 0 ? std::min(1.0, double(pixels_.foreground[i] / color_prior_)) : 1.0;
    r.block = kBlocks * cell(y) + cell(x);
  }
}

template <int kStrains>
typename DepthFit<kStrains>::PerPixel DepthFit<kStrains>::residuals() const {
  PerPixel left = error_m_.head(count_);
  for (int k = 0; k < kUnknowns; ++k) left -= x_[k] * along_pixels(k);
  return left;
}

template <int kStrains>
void DepthFit<kStrains>::weigh(double size_m) {
  const PerPixel left_m = residuals();
  for (int i = 0; i < count_; ++i) {
    const double off = left_m[i] / size_m;
    weight_[i] = all_[i].share / (size_m * size_m * (1 + off * off));
  }
}

template <int kStrains>
void DepthFit<kStrains>::solve(double systematic_m, const frame::Shape& shape) {
  Row g;
  for (int j = 0; j < kUnknowns; ++j) {
    const PerPixel pulls = weighted(j);
    for (int k = j; k < kUnknowns; ++k) readings_(k, j) = readings_(j, k) = pulls.dot(along_pixels(k));
    g[j] = pulls.dot(error_m_.head(count_));
  }
  weights_ = weight_.head(count_).sum();
  priors_.setZero();
  priors_.template topLeftCorner<6, 6>() = weak_knowledge(shape);
  priors_(kLogScale, kLogScale) = 1;  // a log scale of 1 is a very weak prior
  priors_.diagonal().template tail<kStrains>().setOnes();
  for (int k = 0; k < kBiasModes; ++k)
    priors_(kModes + k, kModes + k) = std::pow(kShares[k] * std::max(systematic_m, kMinSystematic_m), -2);
  C_ = optim::inverse_symmetric<kUnknowns>(Square(readings_ + priors_));
  x_ = C_ * g;
}

template <int kStrains>
double DepthFit<kStrains>::spread_m() const {
  std::array<double, kMaxPixels> sizes;
  const PerPixel left_m = residuals();
  for (int i = 0; i < count_; ++i) sizes[i] = std::abs(left_m[i]);
  std::nth_element(sizes.begin(), sizes.begin() + count_ / 2, sizes.begin() + count_);
  return sizes[count_ / 2] / kMedianOfNormal;
}

// Factor by which the residuals' squares are too small in so many blocks, because of the fitted unknowns.
double taken_up(int blocks, int unknowns) {
  return blocks > 2 * unknowns ? double(blocks) / (blocks - unknowns) : 2.0;
}

// On the faces of a box a shift absorbs any size; the edges, which remain, are rounded by the volume. Hence
// the variance is that of an error of the voxels over the slope along the size, the pose eliminated.
template <int kStrains>
double DepthFit<kStrains>::grain_var() const {
  Eigen::Matrix<double, 7, 7> H = readings_.template topLeftCorner<7, 7>();
  H.diagonal() += priors_.diagonal().template head<7>();
  return std::pow(kGrain * double(sdf_.voxel_m), 2) * weights_ * optim::inverse_symmetric<7>(H)(6, 6);
}

// The sandwich: errors within a block of the image count as shared.
template <int kStrains>
SizeLook DepthFit<kStrains>::look() const {
  std::array<double, kBlocks * kBlocks> pulls{};
  const Row along = C_.col(kLogScale);
  const PerPixel pulled = weight_.head(count_).cwiseProduct(residuals());
  PerPixel responses = along[0] * along_pixels(0);
  for (int k = 1; k < kUnknowns; ++k) responses += along[k] * along_pixels(k);
  for (int i = 0; i < count_; ++i) pulls[all_[i].block] += pulled[i] * responses[i];
  double own = 0;
  int blocks = 0;
  for (const double pull : pulls) own += pull * pull, blocks += pull != 0;
  own *= taken_up(blocks, 7);
  SizeLook look = size_look<kUnknowns>(kLogScale, x_, C_, own, along.dot(priors_ * along) + grain_var());
  look.log_scale += log_scale_;
  return look;
}

template <int kStrains>
StrainLook DepthFit<kStrains>::strain_look() const {
  const Eigen::Matrix<double, kUnknowns, kStrains> along = C_.template rightCols<kStrains>();
  Eigen::Matrix<double, kStrains, kBlocks* kBlocks> pulls = decltype(pulls)::Zero();
  const PerPixel pulled = weight_.head(count_).cwiseProduct(residuals());
  for (int i = 0; i < count_; ++i)
    pulls.col(all_[i].block) += pulled[i] * along.transpose() * columns_.row(i).transpose();
  const auto blocks = int((pulls.row(0).array() != 0).count());
  StrainLook look;
  look.strain = x_.template tail<kStrains>();
  look.own_cov = taken_up(blocks, 7 + kStrains) * pulls * pulls.transpose();
  look.shared_cov =
      along.transpose() * priors_ * along + std::pow(kGrain * double(sdf_.voxel_m), 2) * weights_ *
                                                C_.template bottomRightCorner<kStrains, kStrains>();
  return look;
}

}  // namespace

std::optional<SizeLook> size_by_depth(const energies::PixelSet& pixels, float color_prior,
                                      const frame::Shape& shape, const Camera& camera,
                                      const Rigidd& T_obj_cam, double noise_m, double systematic_m) {
  DepthFit<0> fit(pixels, color_prior, shape, camera, T_obj_cam);
  if (!fit.enough()) return std::nullopt;
  // A wrong size causes residuals of millimetres: only those left by the fitted size are not the object's
  // surface, and show how much the sensor bends.
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
    const bool differs = std::abs(look.log_scale) > kDiffers_sd * look.sd();
    const bool says = look.sd() <= kSays;
    if (!says && !differs) return std::nullopt;
    bends = bends || !says;
    if (!differs && round > 0) break;  // one more weighting is enough
    if (round + 1 == kRounds || !differs) continue;
    fit.linearize_there();  // smaller residuals are left there
    if (!fit.enough()) return std::nullopt;
  }
  look.unexplained = fit.spread_m() / spread_m;
  // A sensor that bends may look like another size, but its bending remains in the residuals.
  if (look.sd() > kSays || (bends && look.unexplained > kExplained)) return std::nullopt;
  return look;
}

std::optional<StrainLook> strain_by_depth(const energies::PixelSet& pixels, float color_prior,
                                          const frame::Shape& shape, const Camera& camera,
                                          const Rigidd& T_obj_cam, double noise_m, double systematic_m) {
  DepthFit<kStrainModes> fit(pixels, color_prior, shape, camera, T_obj_cam);
  if (!fit.enough()) return std::nullopt;
  fit.weigh(kFirstSize * noise_m);
  fit.solve(systematic_m, shape);
  for (int round = 0; round < kStrainRounds; ++round) {
    const double left_m = fit.spread_m();
    fit.weigh(kSize * std::max(noise_m, left_m));
    fit.solve(std::max(systematic_m, systematic_by_residuals(left_m, noise_m)), shape);
  }
  StrainLook look = fit.strain_look();
  look.unexplained = fit.spread_m() / noise_m;
  const StrainLook::Stretch most = look.largest();
  if (!(most.sd < kStrainSays && std::abs(most.log_stretch) < kMaxStretch)) return std::nullopt;
  return look;
}

}  // namespace sdftrack::tracking
