// SPDX-License-Identifier: MIT
#pragma once

namespace sdftrack::contour {

enum class OpinionPool { kLinear, kLogarithmic };

// Lengths are in cells of the object's grid. A cell is a pixel wide at the start unless the object is large.
struct ContourOptions {
  bool affine = false;

  // Colours.
  int bins = 16;      // per channel, 16 or 32
  int windows = 6;    // along each side of the grid, each with its own histograms; 1: one for all
  float shrink = 50;  // pixels that a window's histograms borrow from those of the whole
  OpinionPool pool = OpinionPool::kLinear;
  float object_rate = 0.02f;  // weight of a frame in the opinion pools
  float background_rate = 0.2f;

  // Evidence in addition to the colours, from the optical flow.
  bool motion = true;    // uses each pixel's motion: the flow comes with each image
  bool evidence = true;  // the reported confidence; cues/evidence.h

  // Grid.
  int max_cells = 160;  // along the longer side of the object's box

  // Registration and evolution.
  float softness = 1.5f;  // s of the Heaviside
  float band = 8;
  int registration_steps = 12;
  float reach = 24;   // how far the object may jump between two frames, beyond the range of Gauss-Newton
  float dt = 4;       // of a shape step
  float mu = 0.05f;   // of the distance regulariser; mu dt <= 0.2
  float tension = 1;  // of the contour: 0, none, as printed; 1, the regulariser is a Laplacian

  // Start from a box.
  bool box_prior = true;  // segmented once more by place and edges (cues/box_start.h)

  // Throws std::invalid_argument that names the first invalid option.
  void check() const;
};

}  // namespace sdftrack::contour
