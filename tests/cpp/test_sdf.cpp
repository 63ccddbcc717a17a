// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "sdf/bvh.h"

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

}  // namespace
}  // namespace sdftrack
