// SPDX-License-Identifier: MIT
#include "levelset/cube_cases.h"

#include <stdexcept>
#include <vector>

namespace sdftrack::levelset {

namespace {

constexpr int kEdges = 12, kNone = -1;
using Loop = std::vector<int>;  // edges in order around a piece of the surface
using Ring = std::array<int, 4>;

int edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  return number_of({axis, a & b});
}

// The corners of a face, counter-clockwise seen from outside.
Ring corners_of(int axis, int side) {
  const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, at = side << axis;
  return side ? Ring{at, at | b, at | b | c, at | c} : Ring{at | c, at | b | c, at | b, at};
}

// Along the face's border, each run of inside corners starts and ends at an edge; a line of the surface joins
// the two edges. next: from the start of a line to its end.
void add_lines(int inside, const Ring& ring, std::array<int, kEdges>* next) {
  const auto corner = [&](int i) { return ring[i & 3]; };
  const auto in = [&](int i) { return (inside >> corner(i) & 1) != 0; };
  for (int i = 0; i < 4; ++i) {
    if (in(i) || !in(i + 1)) continue;
    int last = i + 1;
    while (in(last + 1)) ++last;
    const int begin = edge_between(corner(i), corner(i + 1)),
              end = edge_between(corner(last), corner(last + 1));
    (*next)[begin] = end;
  }
}

std::vector<Loop> loops_of(int inside) {
  std::array<int, kEdges> next;
  next.fill(kNone);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) add_lines(inside, corners_of(axis, side), &next);
  std::vector<Loop> loops;
  for (int first = 0; first < kEdges; ++first) {
    Loop loop;
    for (int e = first; next[e] != kNone;) {
      loop.push_back(e);
      const int at = e;
      e = next[at], next[at] = kNone;
    }
    if (!loop.empty()) loops.push_back(loop);
  }
  return loops;
}

// Whether both edges lie in one face of the cell.
bool share_face(int a, int b) {
  const CubeEdge p = cube_edge(a), q = cube_edge(b);
  for (int axis = 0; axis < 3; ++axis)
    if (axis != p.axis && axis != q.axis && (p.corner >> axis & 1) == (q.corner >> axis & 1)) return true;
  return false;
}

// The corner at which a loop's triangles meet. No inner side may lie in a face of the cell, because the cell
// behind that face could have the same side.
std::size_t apex_of(const Loop& loop) {
  for (std::size_t apex = 0; apex < loop.size(); ++apex) {
    bool fits = true;
    for (std::size_t k = 2; k + 1 < loop.size(); ++k)
      fits = fits && !share_face(loop[apex], loop[(apex + k) % loop.size()]);
    if (fits) return apex;
  }
  throw std::logic_error("marching cubes: a case without triangles");
}

}  // namespace

std::array<CubeCase, kCubeCases> make_cube_cases() {
  std::array<CubeCase, kCubeCases> cases{};
  for (int inside = 0; inside < kCubeCases; ++inside) {
    CubeCase& out = cases[inside];
    int at = 0;
    for (const Loop& loop : loops_of(inside)) {
      const std::size_t apex = apex_of(loop), n = loop.size();
      for (std::size_t k = 1; k + 1 < n; ++k)
        for (const std::size_t corner : {apex, apex + k, apex + k + 1})
          out.edges[at++] = static_cast<std::uint8_t>(loop[corner % n]);
    }
    out.triangles = static_cast<std::uint8_t>(at / 3);
  }
  return cases;
}

}  // namespace sdftrack::levelset
