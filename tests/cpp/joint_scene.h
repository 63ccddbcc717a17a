// SPDX-License-Identifier: MIT
// A row of boxes with readings that two or more of them may have made, and starts a few millimetres off.
// Every other box stands back, so that none could slide along the row: rounding would decide where a fit
// ends.
#pragma once

#include <random>

#include "energies/joint_fits.h"
#include "energies/sdf_energy.h"
#include "optim/lm.h"
#include "optim/prior.h"
#include "tracking/several/collision.h"
#include "volume_fixture.h"

namespace sdftrack {

class JointScene {
 public:
  JointScene(int objects, const energies::SdfEnergyOptions& options, bool contact, int pixels = 4000)
      : count_(objects), options_(options) {
    static const Volume box = make_volume(30, 0.09, [](Vec3d p) { return box_distance(p, kHalf); });
    static const frame::Shape shape = frame::make_shape(box.view(), 1, 30);
    shape_ = &shape;
    options_.residual = energies::Residual::kRayHit;
    options_.scale_m = 0.003f;
    x_.K = {400, 400, 160, 120};
    const Mat3d R = rotation_exp(Vec3d{0.5, -0.4, 0.2});
    std::mt19937 random(8);
    std::uniform_real_distribution<double> off(-1, 1);
    for (int k = 0; k < objects; ++k) {
      const double along = 2 * kHalf.x * (k - 0.5 * (objects - 1));
      truth_.push_back(inverse(Rigidd{R, R * Vec3d{along, 0.012 * (k % 2), 0} + Vec3d{0, 0, 0.5}}));
      const double a = off(random), b = off(random), c = off(random), d = off(random);
      x_.T_obj_cam.push_back(increment(Vec3d{0.003 * a, 0.003 * b, 0.002}, Vec3d{0.02 * c, 0.02 * d, 0.01}) *
                             truth_.back());
      priors_.emplace_back(optim::Unknowns{1, false, false}, 0, x_.T_obj_cam.back(),
                           optim::PosePrior::isotropic(0.02, 0.2));
    }
    read(pixels, &random);
    if (contact) {
      collision_.prepare(std::vector<const frame::Shape*>(truth_.size(), shape_),
                         std::vector<int>(truth_.size(), pixels / objects), x_, 0.02);
      collision_.set_tolerance(0.001);
    }
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      task_.part[p].objects = static_cast<int>(parts_[p].of.size());
      std::copy(parts_[p].of.begin(), parts_[p].of.end(), task_.part[p].of);
      task_.part[p].pixels = parts_[p].pixels.count();
      all_.append(parts_[p].pixels);
    }
    task_.objects = objects, task_.parts = static_cast<int>(parts_.size());
    for (int k = 0; k < objects; ++k) {
      task_.sdf[k] = shape.sdf, task_.T_obj_cam[k] = x_.T_obj_cam[static_cast<std::size_t>(k)];
      task_.beside[k].prior = priors_[static_cast<std::size_t>(k)].term();
    }
    task_.pixels = &all_, task_.K = x_.K, task_.options = options_, task_.settle_steps = 2;
    task_.contacts = collision_.on_device();
    lm_.cost_gain = 1e-3, lm_.block = 6;
    task_.rules = lm_;
  }
  JointScene(const JointScene&) = delete;
  JointScene& operator=(const JointScene&) = delete;

  const energies::JointTask& task() const { return task_; }

  // On the CPU.
  optim::LmResult minimum() {
    optim::GroupEnergy group;
    group.clear(count_);
    std::vector<energies::SdfEnergy> data;
    data.reserve(parts_.size());
    for (Part& part : parts_) {
      const std::vector<SdfView> sdfs(part.of.size(), shape_->sdf);
      const int objects = static_cast<int>(part.of.size());
      data.emplace_back(sdfs.data(), objects, &part.pixels, options_);
      optim::State own{{}, x_.K, {}};
      for (const int k : part.of) own.T_obj_cam.push_back(x_.T_obj_cam[static_cast<std::size_t>(k)]);
      data.back().settle(own, 2);
      group.add(&data.back(), 1, part.of.data(), objects);
    }
    for (int k = 0; k < count_; ++k) group.add(&priors_[static_cast<std::size_t>(k)], 1, &k, 1);
    if (!collision_.empty()) group.add(&collision_);
    return optim::minimize(group, x_, lm_);
  }

 private:
  static constexpr Vec3d kHalf{0.03, 0.025, 0.035};
  struct Part {
    std::vector<int> of;
    energies::PixelSet pixels;
  };

  // Single objects, neighbours, and all of them.
  void read(int pixels, std::mt19937* random) {
    const int all = count_ > 2 ? 2 * count_ - 1 : count_;
    for (int k = 0; k < count_; ++k) parts_.push_back({{k}, {}});
    for (int k = 0; count_ > 2 && k + 1 < count_; ++k) parts_.push_back({{k, k + 1}, {}});
    parts_.push_back({{}, {}});
    for (int k = 0; k < count_; ++k) parts_.back().of.push_back(k);
    std::uniform_real_distribution<float> u(60, 260), v(60, 180), share(0.05f, 0.95f);
    std::normal_distribution<float> noise(0, 0.001f);
    for (int n = 0; n < pixels;) {
      const Vec2f at{u(*random), v(*random)};
      const float error = noise(*random), p = share(*random);
      float z = 0.3f, least = 1;
      int nearest = 0;
      for (int step = 0; step < 80; ++step) {
        least = 1;
        for (int k = 0; k < count_; ++k) {
          float phi;
          Vec3f unused;
          sample(
              shape_->sdf,
              truth_[static_cast<std::size_t>(k)].cast<float>() * (z * ray(x_.K.cast<float>(), at.x, at.y)),
              &phi, &unused);
          if (phi < least) least = phi, nearest = k;
        }
        z += 0.9f * least;
      }
      if (!(z < 0.8f)) continue;
      const int requested =
          n % 3 == 0 ? nearest : (n % 3 == 1 && count_ > 2 ? count_ + std::min(nearest, count_ - 2) : all);
      parts_[static_cast<std::size_t>(requested)].pixels.push(at.x, at.y, z + error, 1, n++, p);
    }
  }

  int count_;
  energies::SdfEnergyOptions options_;
  const frame::Shape* shape_;
  optim::State x_;
  std::vector<Rigidd> truth_;
  std::vector<optim::PosePrior> priors_;
  std::vector<Part> parts_;
  tracking::CollisionEnergy collision_{{}};
  energies::PixelSet all_;
  energies::JointTask task_;
  optim::LmOptions lm_;
};

}  // namespace sdftrack
