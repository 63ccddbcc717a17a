// SPDX-License-Identifier: MIT
// A term of every compiled pair with readings on, beside and far from a box.
#pragma once

#include <random>
#include <stdexcept>

#include "energies/photometric.h"
#include "energies/pixel_set.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

const Volume kBox = make_volume(40, 0.1, [](Vec3d p) { return box_distance(p, {0.05, 0.03, 0.04}); });
const Rigidf kPose =
    inverse(Rigidd{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.5}}).cast<float>();  // T_obj_cam
const Intrinsics<float> kCamera{525, 520, 160, 120};

// Readings on the body, beside it and far outside the volume.
energies::PixelSet some_pixels(int count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(90, 230), v(60, 180), z(0.42f, 0.58f), noise(0.5f, 2), share(0, 1);
  energies::PixelSet pixels;
  for (int i = 0; i < count; ++i) {
    // One after the other: in the order of a call's arguments compilers differ.
    const float at_u = u(random), at_v = v(random), depth = z(random), scale = noise(random),
                p = share(random);
    pixels.push(at_u, at_v, i % 37 == 36 ? 2.0f : depth, scale, i, p);  // some far behind
  }
  return pixels;
}

// The box's colours, and pixels that show them at kPose under another light.
struct Painted {
  std::vector<std::uint16_t> rgb_seen;
  energies::GreyPixels grey;
  std::vector<energies::PhotometricHit> hits;

  explicit Painted(const energies::PixelSet& pixels) {
    const SdfView sdf = kBox.view();
    for (int i = 0; i < sdf.nx * sdf.ny * sdf.nz; ++i) {
      const int x = i % sdf.nx, y = i / sdf.nx % sdf.ny, z = i / (sdf.nx * sdf.ny);
      const double level = 0.5 + 0.2 * std::sin(0.9 * x + 0.4 * z) + 0.2 * std::cos(0.7 * y);
      for (int k = 0; k < 3; ++k) rgb_seen.push_back(static_cast<std::uint16_t>(65280 * level));
      rgb_seen.push_back(x > 4 ? 9 : 0);  // a border that nobody has seen
    }
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0, 0.02f);
    for (std::size_t i = 0; i < pixels.depth_m.size(); i += 2) {
      const Vec3f p = kPose * (pixels.depth_m[i] * ray(kCamera, pixels.u_px[i], pixels.v_px[i]));
      double level = 0.5;
      Vec3d unused;
      energies::sample_brightness(sdf, {rgb_seen.data(), 1}, p.cast<double>(), &level, &unused);
      grey.push(pixels.u_px[i], pixels.v_px[i], pixels.depth_m[i],
                0.9f * static_cast<float>(level) + 0.04f + noise(random));
    }
  }
  energies::PhotometricEnergy energy(const optim::State& x) {
    energies::PhotometricEnergy made(kBox.view(), {rgb_seen.data(), 1}, &grey, {}, &hits);
    if (made.settle(x) < 50) throw std::logic_error("expected pixels that show the box");
    return made;
  }
};

energies::SingleObject<float> field_of(energies::SingleObject<float>*) { return {kBox.view(), kPose}; }
energies::ScaledObject<float> field_of(energies::ScaledObject<float>*) { return {kBox.view(), kPose, 1.1f}; }
energies::WithIntrinsics<energies::SingleObject<float>> field_of(
    energies::WithIntrinsics<energies::SingleObject<float>>*) {
  return {{kBox.view(), kPose}, kCamera};
}
// Copies of the box that touch and overlap.
template <int K>
energies::SoftMin<K, float> field_of(energies::SoftMin<K, float>*) {
  energies::SoftMin<K, float> field;
  for (int k = 0; k < K; ++k) {
    const auto side = static_cast<float>(k);
    field.object[k] = {kBox.view(),
                       Rigidf{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.03f * side, -0.02f * side, 0}} * kPose};
  }
  field.sharpness_per_m = 300;
  return field;
}
energies::DepthLogistic<float> penalty_of(energies::DepthLogistic<float>*) {
  return {0.003f, 0.1f, energies::Curvature::kIrls, 0.02f};
}
energies::ColorOdds<float> penalty_of(energies::ColorOdds<float>*) { return {0.003f, 0.1f, 0.7f}; }
energies::ColorPrinted<float> penalty_of(energies::ColorPrinted<float>*) { return {0.003f}; }

// The same box with its values on a device (CudaWork).
template <class Device>
void on_device(Device* device, energies::SingleObject<float>* field) {
  field->sdf = device->volume(field->sdf);
}
template <class Device>
void on_device(Device* device, energies::ScaledObject<float>* field) {
  field->sdf = device->volume(field->sdf);
}
template <class Device>
void on_device(Device* device, energies::WithIntrinsics<energies::SingleObject<float>>* field) {
  on_device(device, &field->field);
}

template <class Device, int K>
void on_device(Device* device, energies::SoftMin<K, float>* field) {
  for (auto& object : field->object) on_device(device, &object);
}

template <class Field, class Penalty>
energies::Term<Field, Penalty> term_on(energies::PixelsView<float> pixels, energies::Residual residual,
                                       bool reclassify, int newton_steps) {
  Field* const field = nullptr;
  Penalty* const penalty = nullptr;
  return {field_of(field), penalty_of(penalty), kCamera, pixels, residual, reclassify, newton_steps};
}

}  // namespace
}  // namespace sdftrack
