// SPDX-License-Identifier: MIT
#pragma once

namespace sdftrack {

enum class OpinionPool { kLinear, kLogarithmic };

// Lengths in cells of the object's grid, which is a pixel wide at the start unless the object is large.
struct ContourOptions {
  bool affine = false;

  // Colours.
  int bins = 16;      // per channel, 16 or 32
  int windows = 6;    // along each side of the grid, each with its own histograms; 1: one for all
  float shrink = 50;  // pixels that a window's histograms borrow from those of the whole
  OpinionPool pool = OpinionPool::kLinear;
  float object_rate = 0.02f;  // of a frame in the opinion pools
  float background_rate = 0.2f;
  float least_posterior = 0.018f;  // no colour proves anything

  // Grid.
  float ring = 0.3f;     // width of the background around the object, over the longer side of its box
  int most_cells = 160;  // along the longer side of the object's box

  // Registration and evolution.
  float softness = 1.5f;  // s of the Heaviside
  float band = 8;
  int registration_steps = 12;
  float reach = 24;  // how far the object may jump between two frames, beyond what Gauss-Newton bridges
  int shape_steps = 5;
  float dt = 4;              // of a shape step
  float mu = 0.05f;          // of the distance regulariser; mu dt <= 0.2
  float tension = 1;         // of the contour: 0, none, as printed; 1, the regulariser is a Laplacian
  float least_part = 0.01f;  // pieces smaller than this share of the largest are dropped

  // Start from a box.
  int box_rounds = 8;

  // Drift correction, when the shape is so far from the middle or so much larger.
  float drift_cells = 3, drift_log_scale = 0.05f;

  // std::invalid_argument names the first that cannot be.
  void check() const;
};

// visit(name, value, least, most) for every number among the options (`Options`: ContourOptions, const or
// not). The one list that checks, bindings and Python go by.
template <class Options, class Visit>
void each_number(Options& o, const Visit& visit) {
  visit("bins", o.bins, 16, 32);
  visit("windows", o.windows, 1, 16);
  visit("shrink", o.shrink, 1, 1e6);
  visit("object_rate", o.object_rate, 0, 1);
  visit("background_rate", o.background_rate, 0, 1);
  visit("least_posterior", o.least_posterior, 1e-6, 0.4);
  visit("ring", o.ring, 0.05, 2);
  visit("most_cells", o.most_cells, 32, 2048);
  visit("softness", o.softness, 0.3, 10);
  visit("band", o.band, 2, 32);
  visit("registration_steps", o.registration_steps, 0, 200);
  visit("reach", o.reach, 0, 200);
  visit("shape_steps", o.shape_steps, 0, 200);
  visit("dt", o.dt, 1e-3, 10);
  visit("mu", o.mu, 0, 10);
  visit("tension", o.tension, 0, 4);
  visit("least_part", o.least_part, 0, 1);
  visit("box_rounds", o.box_rounds, 1, 100);
  visit("drift_cells", o.drift_cells, 0, 64);
  visit("drift_log_scale", o.drift_log_scale, 0, 1);
}

}  // namespace sdftrack
