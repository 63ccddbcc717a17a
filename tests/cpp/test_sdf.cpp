// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "sdf/bvh.h"
#include "sdf/crossings.h"
#include "sdf/mesh_report.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/primitives.h"
#include "sdf/redistance.h"
#include "sdf/surface_samples.h"
#include "sdf/winding.h"

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

// The corner tetrahedron x, y, z >= 0, x + y + z <= 1.
Soup tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
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

TEST(Winding, both_countings_agree_on_a_closed_mesh) {
  const Soup mesh = tetrahedron();
  const sdf::Grid grid{9, 9, 9, 0.15, {-0.11, -0.12, -0.13}};
  const auto counted = sdf::winding_numbers(mesh.view(), grid, 2);
  const sdf::WindingTree tree(mesh.view());
  for (int iz = 0; iz < 9; ++iz)
    for (int iy = 0; iy < 9; ++iy)
      for (int ix = 0; ix < 9; ++ix)
        EXPECT_NEAR(tree(grid.point(ix, iy, iz)), counted[grid.index(ix, iy, iz)], 0.02);
}

TEST(MeshReport, a_tetrahedron_is_closed_and_holds_a_sixth) {
  const sdf::CleanMesh mesh = sdf::clean_mesh(tetrahedron().view());
  EXPECT_EQ(mesh.report.unbalanced_edges, 0u);
  EXPECT_EQ(mesh.report.parts, 1u);
  EXPECT_NEAR(mesh.report.volume_m3, 1.0 / 6, 1e-15);
}

TEST(MeshReport, a_face_and_its_reverse_cancel_and_a_missing_one_leaves_three_open_edges) {
  Soup mesh = tetrahedron();
  mesh.faces.push_back({0, 1, 2});
  const sdf::CleanMesh open = sdf::clean_mesh(mesh.view());
  EXPECT_EQ(open.faces.size(), 3u);
  EXPECT_EQ(open.report.duplicate_faces, 2u);
  EXPECT_EQ(open.report.open_edges, 3u);
}

TEST(MeshReport, a_double_sided_tetrahedron_keeps_one_side_and_points_outwards) {
  Soup mesh = tetrahedron();
  for (int i = 0; i < 4; ++i) mesh.faces.push_back({mesh.faces[i].a, mesh.faces[i].c, mesh.faces[i].b});
  const sdf::CleanMesh one = sdf::clean_mesh(mesh.view());
  EXPECT_EQ(one.faces.size(), 4u);
  EXPECT_EQ(one.report.double_sided_faces, 4u);
  EXPECT_EQ(one.report.unbalanced_edges, 0u);
  EXPECT_NEAR(one.report.volume_m3, 1.0 / 6, 1e-15);
}

TEST(MeshReport, a_tetrahedron_that_is_inside_out_is_turned) {
  Soup mesh = tetrahedron();
  for (sdf::Face& f : mesh.faces) std::swap(f.b, f.c);
  const sdf::CleanMesh turned = sdf::clean_mesh(mesh.view());
  EXPECT_EQ(turned.report.inverted_parts, 1u);
  EXPECT_NEAR(turned.report.volume_m3, 1.0 / 6, 1e-15);
}

TEST(SurfaceSamples, of_a_plane_lie_in_it) {
  const sdf::Grid grid{6, 6, 6, 0.1, {0, 0, 0}};
  std::vector<float> phi(grid.size());
  for (int iz = 0; iz < 6; ++iz)
    for (int iy = 0; iy < 6; ++iy)
      for (int ix = 0; ix < 6; ++ix) phi[grid.index(ix, iy, iz)] = static_cast<float>(0.1 * iz - 0.23);
  const auto samples = sdf::ZeroSurface(grid.view(phi.data())).samples(50);
  ASSERT_EQ(samples.size(), 50u);
  for (const sdf::SurfaceSample& s : samples) {
    EXPECT_NEAR(s.p_obj.z, 0.23, 1e-6);
    EXPECT_NEAR(s.n_obj.z, 1, 1e-6);
  }
}

TEST(Primitives, the_centre_of_an_ellipsoid_is_its_shortest_axis_deep) {
  EXPECT_NEAR(sdf::ellipsoid_distance({0, 0, 0}, {3, 1, 2}), -1, 1e-8);
  EXPECT_NEAR(sdf::ellipsoid_distance({4, 0, 0}, {3, 1, 2}), 1, 1e-8);
}

}  // namespace
}  // namespace sdftrack
