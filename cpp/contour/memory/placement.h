// SPDX-License-Identifier: MIT
// A silhouette's place in an image, between the memory's frame and the tracker's grid, and its prediction.
//
// The tracker's grid follows the bounding box of the visible part in jumps, but a memory needs equal shapes
// at equal places. Its frame is therefore centred at the silhouette's centroid, has a fixed area (as in
// `st.contour.align`), and turns with the tracker. Warps here count cells from the corner of a grid.
#pragma once

#include <array>
#include <vector>

#include "contour/grid_warp.h"
#include "contour/memory/plane.h"

namespace sdftrack::contour {

// Square root of a silhouette's area over its frame's side: a body three times as long as wide still fits.
constexpr double kFill = 0.35;

struct Placement {
  std::array<double, 2> center_px = {0, 0};   // centroid in the image
  double size_px = 1;                         // square root of the area
  std::array<double, 4> turn = {1, 0, 0, 1};  // 2 x 2, determinant 1: from the frame's to the image's axes

  // Maps pixels of a frame of `size` x `size` to the image.
  GridWarp to_image(int size) const;
  // Shifted by x, y pixels of the frame, then scaled and turned.
  Placement moved(const std::array<double, 4>& move, int size) const;
};

// The mask must not be empty.
Placement placement_of(const Mask& mask, const GridWarp& warp);

// A picture of the tracker's grid in a placement's frame, averaged where it shrinks; 0 beyond the grid.
Picture seen_from(const Picture& picture, const GridWarp& warp, const Placement& placement, int size,
                  int margin = 0);
Mask seen_from(const Mask& mask, const GridWarp& warp, const Placement& placement, int size);
// Maps a mask of a placement's frame to the tracker's grid.
Mask put_back(const Mask& mask, const GridWarp& warp, const Placement& placement, int width, int height);

// Expected place and size, and the rms error of earlier predictions relative to the size.
struct Prediction {
  std::array<double, 2> center_px = {0, 0};
  double size_px = 1, place_error = 0, size_error = 0;
};

// Constant velocity and size from the weighted places and sizes of the last frames.
class MotionPredictor {
 public:
  // A weight of 1 means that the whole silhouette was visible.
  void add(int time, const Placement& placement, double weight = 1);
  // Drops the places; the errors of earlier predictions are kept.
  void forget() { seen_.clear(); }
  // There must be at least one earlier frame.
  Prediction predict(int time) const;
  bool empty() const { return seen_.empty(); }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [seen, errors] = self;
    archive(seen, errors);
  }

 private:
  struct Seen {
    int time = 0;
    double x = 0, y = 0, log_size = 0, weight = 0;

    template <class Archive, class Self>
    static void visit(Archive& archive, Self& self) {
      auto& [when, column, row, log_of_size, share] = self;
      archive(when, column, row, log_of_size, share);
    }
  };

  std::vector<Seen> seen_;                     // the oldest first
  std::vector<std::array<double, 3>> errors_;  // of x and y over the size, and of the log size
};

}  // namespace sdftrack::contour
