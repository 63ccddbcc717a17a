// SPDX-License-Identifier: MIT
#include "sdf/redistance.h"

#include <cstdint>
#include <stdexcept>

#include "base/interrupt.h"
#include "sdf/bvh.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/zero_set.h"

namespace sdftrack::sdf {

constexpr std::size_t kBetweenLooks = 3 << 14;  // vertices

void refuse_one_sign() {
  throw std::invalid_argument(
      "values: expected a field with negative (inside) and positive (outside) values, got one sign only; "
      "there is no surface to measure from");
}

std::vector<float> redistance(const Grid& grid, const float* phi, int threads) {
  std::vector<Vec3d> vertices;
  for_each_zero_triangle(grid.view(phi), [&](const Triangle& t) {
    if (vertices.size() % kBetweenLooks == 0) check_interrupt();
    for (const Vec3d& p : {t.a, t.b, t.c}) vertices.push_back(grid.origin_obj + grid.voxel_m * p);
  });
  if (vertices.empty()) refuse_one_sign();
  std::vector<Face> faces(vertices.size() / 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto k = static_cast<std::int32_t>(3 * i);
    faces[i] = {k, k + 1, k + 2};
  }
  const Bvh bvh({vertices.data(), vertices.size(), faces.data(), faces.size()});
  std::vector<float> u = mesh_distance(bvh, grid, kBandRedistanced, threads);
  for (std::size_t i = 0; i < u.size(); ++i)
    if (phi[i] < 0) u[i] = -u[i];
  return u;
}

}  // namespace sdftrack::sdf
