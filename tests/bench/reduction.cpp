// SPDX-License-Identifier: MIT
// The sum over pixels by itself: nanoseconds per point of a linearisation and of a trial, for each
// instruction set.
//   sdftrack_reduction [points] [depth|rgbd] [instruction set]
// With an instruction set it does a fixed amount of work and prints nothing: what callgrind counts.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "energies/pixel_set.h"
#include "energies/term_ops.h"

using namespace sdftrack;

namespace {

constexpr int kVoxels = 200;
constexpr float kVoxel_m = 0.0012f;
constexpr int kRepeats = 201, kCounted = 20;

// A handle and a body: a capsule and a ball, 0.18 m long, about the origin.
float distance(Vec3f p) {
  const float along = std::clamp(p.x, -0.07f, 0.05f);
  const float capsule = std::hypot(p.x - along, p.y, p.z) - 0.022f;
  return std::min(capsule, std::hypot(p.x - 0.04f, p.y, p.z) - 0.045f);
}

struct Scene {
  std::vector<float> phi;
  SdfView sdf{};
  Rigidf T_obj_cam = inverse(Rigidd{rotation_exp(Vec3d{0.4, -0.7, 0.3}), {0.01, -0.02, 0.8}}).cast<float>();
  Intrinsics<float> K{525, 525, 319.5f, 239.5f};
  energies::PixelSet pixels;

  explicit Scene(int points) {
    const Vec3f origin = -(0.5f * kVoxel_m * (kVoxels - 1)) * Vec3f{1, 1, 1};
    for (int z = 0; z < kVoxels; ++z)
      for (int y = 0; y < kVoxels; ++y)
        for (int x = 0; x < kVoxels; ++x)
          phi.push_back(distance(origin + kVoxel_m * Vec3f{float(x), float(y), float(z)}));
    sdf = {phi.data(), kVoxels, kVoxels, kVoxels, kVoxel_m, origin};
    gather(points);
  }

  // Pixels in the order of the image, as a tracker has them, with 1 mm of noise.
  void gather(int points) {
    std::vector<Vec3f> seen;
    const float step = 0.25f;  // fine enough for any number of points
    for (float v = 150; v < 330; v += step)
      for (float u = 200; u < 440; u += step) {
        float z = 0.6f;
        const Vec3f r = ray(K, u, v);
        for (int k = 0; k < 60 && z < 1; ++k) z += distance(T_obj_cam * (z * r));
        if (z < 1) seen.push_back({u, v, z});
      }
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0, 0.001f);
    std::uniform_real_distribution<float> share(0.1f, 1);
    const auto n = static_cast<std::size_t>(points);
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3f& s = seen[k * seen.size() / n];
      pixels.push(s.x, s.y, s.z + noise(random), 1, 0, share(random));
    }
  }
};

template <class Work>
double nanoseconds(int points, const Work& work) {
  std::vector<double> times;
  for (int k = 0; k < kRepeats; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - begin;
    times.push_back(took.count() / points);
  }
  std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
  return times[kRepeats / 2];
}

template <class Penalty>
void run(Scene* scene, const Penalty& penalty, const std::string& only) {
  using Field = energies::SingleObject<float>;
  const int n = scene->pixels.count();
  energies::Term<Field, Penalty> term{{scene->sdf, scene->T_obj_cam}, penalty, scene->K, scene->pixels.view(),
                                      energies::Residual::kRayHit,    true,    1};
  for (const Isa isa : supported_isas()) {
    if (!only.empty() && isa_name(isa) != only) continue;
    const energies::TermOps<Field, Penalty>& ops = energies::ops_for<Field, Penalty>(isa);
    for (int k = 0; k < 2; ++k) ops.settle(term, 0, n);
    double sum = 0;
    const auto linearize = [&] { sum += ops.linearize(term, 0, n).cost; };
    const auto cost = [&] { sum += ops.cost(term, 0, n); };
    if (!only.empty()) {
      for (int k = 0; k < kCounted; ++k) linearize(), cost();
      continue;
    }
    const double a = nanoseconds(n, linearize), b = nanoseconds(n, cost);
    std::printf("%-9s %6d points  linearize %6.2f ns  cost %6.2f ns  (%g)\n", isa_name(isa).c_str(), n, a, b,
                sum);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Scene scene(argc > 1 ? std::atoi(argv[1]) : 2048);
  const std::string mode = argc > 2 ? argv[2] : "depth", only = argc > 3 ? argv[3] : "";
  if (mode == "rgbd")
    run(&scene, energies::ColorOdds<float>{0.001f, 0.1f, 0.7f}, only);
  else
    run(&scene, energies::DepthLogistic<float>{0.001f, 0.1f}, only);
  return 0;
}
