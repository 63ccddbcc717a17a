// SPDX-License-Identifier: MIT
// The rigid motions that map a shape onto itself, and which of the equivalent poses is reported.
#pragma once

#include <vector>

#include "base/rigid.h"

namespace sdftrack::frame {

struct SymmetryAxis {
  Vec3d axis, point;  // a unit vector; metres

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [direction, place] = self;
    archive(direction, place);
  }
};

struct Symmetry {
  std::vector<Rigidd> discrete;    // without the identity
  std::vector<SymmetryAxis> axes;  // of continuous symmetry

  bool empty() const { return discrete.empty() && axes.empty(); }
  // The identity first; `steps` equal turns about each of at most two axes.
  std::vector<Rigidd> motions(int steps) const;
  // Among the poses equivalent to T, the one whose rotation is nearest to R_near. Exact for one axis; about
  // several axes (a ball), the rotation itself.
  Rigidd canonical(const Rigidd& T, const Mat3d& R_near) const;
  // Of the shape enlarged about the origin of its frame.
  void enlarge(double factor);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [motions, turns] = self;
    archive(motions, turns);
  }
};

// So many turns that the farthest point moves by at most 1 % of the diameter from one to the next (BOP).
constexpr int kSymmetrySteps = 315;

}  // namespace sdftrack::frame
