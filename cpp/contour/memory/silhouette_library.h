// SPDX-License-Identifier: MIT
// A library of unoccluded silhouettes, which explain a partly occluded one (docs/shape_memory.md).
//
// An occluder takes pixels away from a silhouette and adds none. A stored silhouette therefore explains an
// observed one to the extent that the observed one does not reach beyond it; its excess may be hidden. Unlike
// in the regression of thesis 6.3.4, no harmonic of the observed silhouette has to be correct.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contour/memory/cosine_series.h"
#include "contour/memory/templates.h"

namespace sdftrack::contour {

// The visible and the hidden part together, and the hidden part alone.
struct Completion {
  Mask completed, hidden;
};

// Slivers along the visible contour are differences between two poses. They are ignored up to 2 px thick, or
// 4 px where the visible silhouette extends far beyond the expected one (`off_px` per contour pixel).
Completion with_hidden(const Mask& seen, const Mask& expected, double off_px);
Completion with_hidden(const Mask& seen, const Mask& expected);

// The average of some of the stored silhouettes.
struct Expected {
  Picture phi;                 // signed distances, pixels, negative inside
  double beyond_px = 0;        // observed pixels outside the expected silhouette
  std::vector<float> weights;  // of the silhouettes that were averaged
  std::vector<int> finalists;  // their places in the library
};

// How the stored silhouettes explain an observed one; all shares 0 to 1.
struct Explanation {
  Mask completed, hidden;
  double missing = 0;    // share of the whole that is not visible; slivers count, even if not in `hidden`
  double riddled = 0;    // share of the expected interior that is neither visible nor explained as hidden
  double beyond_px = 0;  // area of the observed silhouette beyond the best stored one
  double off_px = 0;     // beyond_px per pixel of the observed contour
  double explained = 0;  // share of the observed contour that lies on the expected one
  double outline = 0;    // length of that part over the length of the expected contour
  std::vector<float> weights;
  std::vector<int> finalists;

  // Ratio that tells whether `hidden` may be a difference between two poses: another pose sticks out as much
  // as it lacks, while an occluder only takes away. Infinite where nothing is hidden.
  double doubt() const;
};

class SilhouetteLibrary {
 public:
  struct Options {
    int n_harmonics = 10;  // of the codes that find the nearest silhouettes
    HarmonicOrder order = HarmonicOrder::kMax;
    int size = 64;          // side of the grid
    int capacity = 256;     // beyond it, the older of the two most similar silhouettes is replaced
    double spacing = 0.02;  // symmetric difference over area below which a silhouette is not stored
  };
  explicit SilhouetteLibrary(const Options& options);

  int count() const { return int(shapes_.size()); }
  int size() const { return options_.size; }
  const CosineSeries& series() const { return series_; }
  const std::vector<float>& code(int place) const { return at(place).code; }
  Mask mask(int place) const;
  const std::vector<float>& stored_template(int place, std::size_t stage) const {
    return at(place).templates[stage];
  }

  // Stores a silhouette unless a similar one is stored already.
  void add(const Mask& mask);
  // Explains a mask by the stored silhouettes; there must be at least one.
  Explanation explain(const Mask& mask) const;
  // Explains a mask by one expected silhouette. `own_edge`: the outline next to the hidden part belongs to
  // the occluder and need not be explained.
  Explanation explain_by(const Mask& mask, const Expected& expected, bool own_edge = false) const;
  // Weighted average of signed distances, pixels.
  Picture average(const std::vector<float>& weights, const std::vector<int>& places) const;
  // Symmetric difference of each silhouette to a mask over the mask's area, from small pictures.
  std::vector<float> dissimilarity(const Mask& mask) const;

  // The saved state of a library, in addition to the masks; a library can continue from it.
  struct State {
    std::vector<Mask> masks;
    std::vector<float> unlike;  // of each silhouette to each, by rows
    std::vector<std::int64_t> ages;
    std::int64_t clock = 0;
  };
  State state() const;
  void restore(const State& state);

 private:
  struct Shape {
    std::vector<float> code;
    std::vector<std::int16_t> small;  // pixels inside, by square
    std::vector<signed char> phi;     // in steps
    float area = 0;
    std::array<std::vector<float>, 2> templates;  // of stored_stages()
    std::vector<float> unlike;                    // to the shape at each place
    std::int64_t age = 0;
  };

  const Shape& at(int place) const { return shapes_[place]; }
  Shape shape_of(const Mask& mask) const;
  std::vector<float> differences(const Mask& mask) const;
  std::size_t place_to_reuse() const;
  std::vector<int> nearest(const Mask& mask, std::vector<float>* beyond_px) const;

  Options options_;
  CosineSeries series_;
  std::vector<Shape> shapes_;
  std::int64_t clock_ = 0;
};

}  // namespace sdftrack::contour
