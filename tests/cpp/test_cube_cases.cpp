// SPDX-License-Identifier: MIT
// The triangles of marching cubes: of every case, and of every two cells side by side.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "levelset/cube_cases.h"

namespace sdftrack::levelset {
namespace {

using Side = std::pair<int, int>;  // of a triangle, from edge to edge

const auto& cases() {
  static const auto made = make_cube_cases();
  return made;
}

// Sides of triangles that no other triangle of the case has.
std::set<Side> border_of(const CubeCase& one) {
  std::set<Side> open;
  for (int k = 0; k < one.triangles; ++k)
    for (int side = 0; side < 3; ++side) {
      const int from = one.edges[3 * k + side], to = one.edges[3 * k + (side + 1) % 3];
      if (open.erase({to, from}) == 0) EXPECT_TRUE(open.insert({from, to}).second);
    }
  return open;
}

bool in_face(int edge, int axis, int at) {
  const CubeEdge e = cube_edge(edge);
  return e.axis != axis && (e.corner >> axis & 1) == at;
}

// Those in a face, by the edges of the cell behind it where `at` is 1.
std::set<Side> border_in(const CubeCase& one, int axis, int at) {
  const auto behind = [&](int edge) {
    const CubeEdge e = cube_edge(edge);
    return number_of({e.axis, e.corner & ~(1 << axis)});
  };
  std::set<Side> out;
  for (const auto& [from, to] : border_of(one))
    if (in_face(from, axis, at) && in_face(to, axis, at)) out.insert({behind(from), behind(to)});
  return out;
}

TEST(CubeCases, an_edge_is_known_by_its_number) {
  for (int edge = 0; edge < 12; ++edge) {
    const CubeEdge e = cube_edge(edge);
    EXPECT_EQ(number_of(e), edge);
    EXPECT_EQ(e.corner >> e.axis & 1, 0);
  }
}

TEST(CubeCases, triangles_have_the_edges_that_are_cut_and_no_others) {
  for (int inside = 0; inside < kCubeCases; ++inside) {
    const CubeCase& one = cases()[static_cast<std::size_t>(inside)];
    ASSERT_LE(one.triangles, kMostTriangles);
    const std::set<int> used(one.edges, one.edges + 3 * one.triangles);
    for (int edge = 0; edge < 12; ++edge) {
      const CubeEdge e = cube_edge(edge);
      const bool cut = (inside >> e.corner & 1) != (inside >> (e.corner | 1 << e.axis) & 1);
      EXPECT_EQ(used.count(edge) == 1, cut) << inside << " " << edge;
    }
  }
}

TEST(CubeCases, every_border_lies_in_a_face) {
  for (const CubeCase& one : cases()) {
    std::size_t in_faces = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (const int at : {0, 1}) in_faces += border_in(one, axis, at).size();
    EXPECT_EQ(in_faces, border_of(one).size());
  }
}

TEST(CubeCases, no_side_of_two_triangles_lies_in_a_face) {
  for (const CubeCase& one : cases()) {
    const std::set<Side> border = border_of(one);
    for (int k = 0; k < 3 * one.triangles; ++k) {
      const int from = one.edges[k], to = one.edges[k % 3 == 2 ? k - 2 : k + 1];
      if (border.count({from, to}) == 1) continue;
      for (int axis = 0; axis < 3; ++axis)
        for (const int at : {0, 1}) EXPECT_FALSE(in_face(from, axis, at) && in_face(to, axis, at));
    }
  }
}

TEST(CubeCases, cells_side_by_side_have_the_same_lines_in_opposite_directions) {
  const auto corners_in = [](int inside, int axis, int at) {
    int out = 0;
    for (int corner = 0; corner < 8; ++corner)
      if ((corner >> axis & 1) == at && (inside >> corner & 1) != 0) out |= 1 << (corner & ~(1 << axis));
    return out;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int a = 0; a < kCubeCases; ++a)
      for (int b = 0; b < kCubeCases; ++b) {
        if (corners_in(a, axis, 1) != corners_in(b, axis, 0)) continue;
        std::set<Side> turned;
        for (const auto& [from, to] : border_in(cases()[static_cast<std::size_t>(b)], axis, 0))
          turned.insert({to, from});
        ASSERT_EQ(border_in(cases()[static_cast<std::size_t>(a)], axis, 1), turned) << a << " " << b;
      }
}

}  // namespace
}  // namespace sdftrack::levelset
