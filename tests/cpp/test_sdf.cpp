// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "base/rigid.h"
#include "sdf/bvh.h"
#include "sdf/crossings.h"
#include "sdf/mesh/open_mesh.h"
#include "sdf/sweep.h"

namespace sdftrack {
namespace {

struct Soup {
  std::vector<Vec3d> vertices;
  std::vector<sdf::Face> faces;

  sdf::MeshView view() const { return {vertices.data(), vertices.size(), faces.data(), faces.size()}; }
};

Soup random_triangles(int n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> at(-1, 1);
  Soup soup;
  for (int i = 0; i < 3 * n; ++i) soup.vertices.push_back({at(random), at(random), at(random)});
  for (std::int32_t i = 0; i < n; ++i) soup.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  return soup;
}

TEST(Triangle, a_point_is_nearest_to_a_corner_an_edge_or_the_inside) {
  const sdf::Triangle t{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  EXPECT_LT(norm(sdf::closest_point(t, {-1, -1, 1}) - Vec3d{0, 0, 0}), 1e-15);
  EXPECT_LT(norm(sdf::closest_point(t, {1, -3, 0}) - Vec3d{1, 0, 0}), 1e-15);
  EXPECT_LT(norm(sdf::closest_point(t, {2, 2, 5}) - Vec3d{1, 1, 0}), 1e-15);
  EXPECT_LT(norm(sdf::closest_point(t, {0.5, 0.5, -7}) - Vec3d{0.5, 0.5, 0}), 1e-15);
}

TEST(Triangle, one_without_area_answers_with_its_edge) {
  const Vec3d a{0, 0, 0}, b{2, 0, 0}, p{1, 1, 0};
  for (const sdf::Triangle& t : {sdf::Triangle{a, a, b}, sdf::Triangle{a, b, b}, sdf::Triangle{a, b, a}})
    EXPECT_LT(norm(sdf::closest_point(t, p) - Vec3d{1, 0, 0}), 1e-15);
  EXPECT_LT(norm(sdf::closest_point({b, b, b}, p) - b), 1e-15);
}

TEST(Bvh, finds_the_nearest_of_all_triangles_with_any_guess) {
  const Soup soup = random_triangles(200);
  const sdf::Bvh bvh(soup.view());
  for (int i = 0; i < 100; ++i) {
    const Vec3d p{std::sin(i * 1.3), std::cos(i * 2.1), std::sin(i * 0.7 + 1)};
    double best = 1e9;
    for (std::size_t k = 0; k < soup.faces.size(); ++k)
      best = std::min(best, norm(p - sdf::closest_point(soup.view().triangle(k), p)));
    EXPECT_EQ(std::sqrt(bvh.closest(p).distance2), best);
    EXPECT_EQ(std::sqrt(bvh.closest(p, 1e9, i).distance2), best);
    EXPECT_EQ(bvh.closest(p, 0.5 * best * best).face, -1);
  }
}

TEST(Bvh, finds_the_first_of_all_hits) {
  const Soup soup = random_triangles(200);
  const sdf::Bvh bvh(soup.view());
  int hits = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3d o{2 * std::sin(i * 1.3), 2 * std::cos(i * 2.1), -2}, d{-o.x, -o.y, 1.5 + std::sin(i)};
    double best = std::numeric_limits<double>::infinity();
    sdf::RayHit hit;
    for (std::size_t k = 0; k < soup.faces.size(); ++k)
      if (sdf::intersect(soup.view().triangle(k), o, d, &hit)) best = std::min(best, hit.t);
    EXPECT_EQ(bvh.first_hit(o, d).hit.t, best);
    hits += std::isfinite(best);
  }
  EXPECT_GT(hits, 100);
}

TEST(Bvh, many_equal_triangles_do_not_make_it_deep) {
  Soup soup;
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.faces.assign(5000, {0, 1, 2});
  EXPECT_NEAR(sdf::Bvh(soup.view()).closest({0.2, 0.2, 2}).distance2, 4, 1e-12);
  EXPECT_THROW(sdf::Bvh(sdf::MeshView{}), std::invalid_argument);
}

// -- signs
double winding_number(const Soup& soup, Vec3d p) {
  double angle = 0;  // solid angles (van Oosterom and Strackee)
  for (std::size_t k = 0; k < soup.faces.size(); ++k) {
    const sdf::Triangle t = soup.view().triangle(k);
    const Vec3d a = t.a - p, b = t.b - p, c = t.c - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    angle +=
        2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return angle / (4 * 3.14159265358979);
}

// Adds a box with its middle at T's, turned inside out or not.
void add_box(Vec3d half, const Rigidd& T, bool inside_out, Soup* soup) {
  constexpr int kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                                 {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  const auto first = static_cast<std::int32_t>(soup->vertices.size());
  for (int i = 0; i < 8; ++i)
    soup->vertices.push_back(
        T * Vec3d{(i & 4 ? 1 : -1) * half.x, (i & 2 ? 1 : -1) * half.y, (i & 1 ? 1 : -1) * half.z});
  for (const auto& f : kFaces)
    soup->faces.push_back({first + f[0], first + f[inside_out ? 2 : 1], first + f[inside_out ? 1 : 2]});
}

TEST(WindingNumbers, are_those_of_the_solid_angles_where_parts_overlap_and_where_one_is_hollow) {
  const sdf::Grid grid{30, 30, 30, 0.0051, {-0.0741, -0.0743, -0.074}};
  for (const double turn : {0.3, 1.1, 2.0}) {
    Soup soup;
    add_box({0.05, 0.04, 0.03}, Rigidd{Mat3d::identity(), {}}, false, &soup);
    add_box({0.04, 0.032, 0.024}, {rotation_exp(Vec3d{turn, 0.5, -turn}), {0.02, -0.03, 0.01}}, false, &soup);
    add_box({0.015, 0.01, 0.015}, Rigidd{Mat3d::identity(), {}}, true, &soup);
    const std::vector<std::int8_t> found = sdf::winding_numbers(soup.view(), grid, 1);
    int most = 0;
    for (int z = 0; z < 30; ++z)
      for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 30; ++x) {
          const int n = found[grid.index(x, y, z)];
          EXPECT_NEAR(n, winding_number(soup, grid.point(x, y, z)), 1e-6);
          most = std::max(most, n);
        }
    EXPECT_EQ(most, 2);
  }
}

TEST(WindingNumbers, voxels_exactly_on_edges_and_corners_get_a_consistent_sign) {
  Soup soup;
  add_box({1, 1, 1}, {Mat3d::identity(), {3, 3, 3}}, false, &soup);
  const sdf::Grid grid{8, 8, 8, 1, {0, 0, 0}};
  const std::vector<std::int8_t> found = sdf::winding_numbers(soup.view(), grid, 1);
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const int n = found[grid.index(x, y, z)],
                  off = std::max({std::abs(x - 3), std::abs(y - 3), std::abs(z - 3)});
        EXPECT_TRUE(off == 0 ? n == 1 : off == 1 ? n == 0 || n == 1 : n == 0);
      }
  for (Vec3d& v : soup.vertices) v = 1e6 * v;
  EXPECT_THROW(static_cast<void>(sdf::winding_numbers(soup.view(), grid, 1)), std::invalid_argument);
}

// A ball of rings whose cap above `open_m` is missing.
Soup open_ball(double radius_m, double open_m) {
  constexpr int kRings = 16, kSides = 24;
  Soup soup;
  for (int i = 0; i <= kRings; ++i)
    for (int j = 0; j < kSides; ++j) {
      const double a = 3.14159265358979 * i / kRings, b = 2 * 3.14159265358979 * j / kSides;
      soup.vertices.push_back(radius_m *
                              Vec3d{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)});
    }
  for (std::int32_t i = 0; i < kRings; ++i)
    for (std::int32_t j = 0; j < kSides; ++j) {
      if (soup.vertices[std::size_t(kSides * i)].z > open_m) continue;
      const std::int32_t a = kSides * i + j, b = kSides * i + (j + 1) % kSides;
      if (i > 0) soup.faces.push_back({a, a + kSides, b});
      if (i + 1 < kRings) soup.faces.push_back({b, a + kSides, b + kSides});
    }
  return soup;
}

// Blocks share one sum; none of them may speak for a voxel on the other side of 1/2.
TEST(OpenMesh, every_voxel_has_the_sign_of_its_own_sum) {
  const Soup soup = open_ball(0.05, 0.02);
  const sdf::Grid grid{44, 44, 44, 0.003, {-0.0641, -0.0643, -0.064}};
  const sdf::OpenMeshSdf found = sdf::open_mesh_to_sdf(soup.view(), sdf::Bvh(soup.view()), grid, 6, 1);
  EXPECT_GT(found.gap_voxels, 0u);
  int inside = 0;
  for (std::size_t i = 0; i < found.phi.size(); i += 7) {
    const int x = int(i % 44), y = int(i / 44 % 44), z = int(i / (44 * 44));
    const double n = winding_number(soup, grid.point(x, y, z));
    if (std::abs(n - 0.5) < 1e-3) continue;  // the dipoles' error
    EXPECT_EQ(found.phi[i]<0, n> 0.5);
    inside += n > 0.5;
  }
  EXPECT_GT(inside, 1000);
}

TEST(OpenMesh, a_volume_may_have_more_than_32767_voxels_a_side) {  // counted in 16 bits once
  const Soup soup = open_ball(0.05, 0.02);
  const auto inside = [&](int nx) {
    const sdf::Grid grid{nx, 13, 12, 0.01, {-0.0505, -0.0505, -0.0505}};
    const sdf::OpenMeshSdf found = sdf::open_mesh_to_sdf(soup.view(), sdf::Bvh(soup.view()), grid, 6, 1);
    std::vector<std::size_t> out;
    for (int row = 0; row < 13 * 12; ++row)
      for (int x = 0; x < nx; ++x)
        if (found.phi[std::size_t(row) * std::size_t(nx) + std::size_t(x)] < 0)
          out.push_back(std::size_t(row) * 100000 + std::size_t(x));
    return out;
  };
  EXPECT_EQ(inside(40000), inside(40));
}

// At each voxel that was not known the squares of the steps up from its lower neighbours add up to h^2.
TEST(Sweep, solves_the_upwind_differences_of_a_slope_of_1) {
  const sdf::Grid grid{9, 8, 7, 0.01, {}};
  std::mt19937 random(5);
  std::vector<std::uint8_t> known;
  std::vector<float> u;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    known.push_back(random() % 30 == 0);
    u.push_back(known.back() ? 0.02f * float(random() % 1000) / 1000 : 0);
  }
  const std::vector<float> before = u;
  sdf::fast_sweep(grid, known, 2, &u);
  const auto at = [&](int x, int y, int z) {
    const bool out = x < 0 || y < 0 || z < 0 || x >= 9 || y >= 8 || z >= 7;
    return out ? 1e9 : double(u[grid.index(x, y, z)]);
  };
  for (int z = 0; z < 7; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 9; ++x) {
        const std::size_t i = grid.index(x, y, z);
        if (known[i]) {
          EXPECT_EQ(u[i], before[i]);
          continue;
        }
        double squares = 0;
        for (const double lower :
             {std::min(at(x - 1, y, z), at(x + 1, y, z)), std::min(at(x, y - 1, z), at(x, y + 1, z)),
              std::min(at(x, y, z - 1), at(x, y, z + 1))})
          squares += std::pow(std::max(0.0, double(u[i]) - lower), 2);
        EXPECT_NEAR(std::sqrt(squares), 0.01, 1e-6);  // of differences in float
      }
}

}  // namespace
}  // namespace sdftrack
