// SPDX-License-Identifier: MIT
// The points that the colour camera sees: a small z-buffer of its image, over one object's region.
#pragma once

#include <vector>

namespace sdftrack::appearance {

// The two cameras stand apart: a point that the depth camera measures may be hidden from the colour camera,
// whose pixel then shows what stands in front. All measurements of the region are entered; one that lies
// clearly behind the nearest of its cell is hidden. An empty cell hides nothing.
class ColorSight {
 public:
  // Starts again for the colour pixels [x0, x1) x [y0, y1), in cells of cell_px.
  void clear(int x0, int y0, int x1, int y1, int cell_px);
  void add(int x, int y, float depth);
  bool sees(int x, int y, float depth) const;

 private:
  int cell_of(int x, int y) const;  // -1 outside

  int x0_ = 0, y0_ = 0, columns_ = 0, rows_ = 0;
  int cell_px_ = 1;
  std::vector<float> nearest_;
};

}  // namespace sdftrack::appearance
