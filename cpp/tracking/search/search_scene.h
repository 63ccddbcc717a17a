// SPDX-License-Identifier: MIT
// A frame as a search sees it: subsampled to nodes, with what is known of each.
#pragma once

#include <vector>

#include "tracking/search/search.h"

namespace sdftrack::tracking {

enum class Node : unsigned char {
  kUnknown,    // no measurement, and no other evidence of what is here
  kCandidate,  // the measurement may be the object's
  kOther,      // something else: it may stand in front of the object
  kPlane,      // a table or a wall: the object is neither in it nor behind it
};

// Nodes every `step` pixels of the ideal pinhole image.
struct SearchScene {
  int x0 = 0, y0 = 0, step = 1, width = 0, height = 0;
  std::vector<float> depth_m;  // 0: no measurement
  std::vector<Node> node;

  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
  }
  Vec2f pixel(int i, int j) const {
    return {static_cast<float>(x0 + i * step), static_cast<float>(y0 + j * step)};
  }
  Vec3f point(const Intrinsics<float>& K, int k) const {
    const Vec2f u = pixel(k % width, k / width);
    return depth_m[static_cast<std::size_t>(k)] * ray(K, u.x, u.y);
  }
};

// The part of the frame that the query refers to, with a margin. Without a mask, planes that are larger than
// the object are found and marked; around a box only planes that extend beyond it.
void make_search_scene(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const SearchQuery& query, SearchScene* scene);

// The nodes with x0 <= i < x1, y0 <= j < y1.
void crop(const SearchScene& scene, const frame::Rect& nodes, SearchScene* out);

}  // namespace sdftrack::tracking
