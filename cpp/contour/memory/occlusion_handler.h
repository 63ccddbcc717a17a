// SPDX-License-Identifier: MIT
// Detects and fills in occlusions for a contour tracker (thesis 6.3.4; docs/shape_memory.md, "In a video").
//
// An occluder takes area away from one side, and the tracker's grid moves and shrinks with the visible rest.
// Each frame is therefore compared with the place and size predicted from the frames before. Where area is
// suddenly missing, the silhouettes of the memory are matched to the colours of the image around the
// predicted place; the best one shows what is hidden. A silhouette that was visible as a whole is learned
// some frames later, unless an occlusion follows.
#pragma once

#include <vector>

#include "contour/memory/placement.h"
#include "contour/memory/silhouette_memory.h"
#include "contour/memory/silhouette_search.h"
#include "contour/tracker.h"

namespace sdftrack::contour {

class OcclusionHandler {
 public:
  struct Judged {
    ShapeJudgement judgement = ShapeJudgement::kNone;
    Mask recovered;  // on the tracker's grid, where the shape is occluded
  };

  // The first frame, in which the whole object is visible.
  void begin(const ContourTracker& tracker, const SilhouetteMemory& memory);
  // The shape that the tracker has observed in `image`, between its calls of observe and finish. `burn_in`:
  // the whole object is visible; the memory learns without judging.
  Judged judge(ContourTracker* tracker, const RgbView& image, bool burn_in, SilhouetteMemory* memory);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [time, lost, motion, waiting, size_px, last] = self;
    archive(time, lost, motion, waiting, size_px, last);
    archive.check(last.width == last.height);
    for (const Mask& mask : waiting) archive.check(mask.width == last.width && mask.height == last.height);
  }

 private:
  // The mask on the tracker's grid, and the map of its cells, counted from the corner, to the image.
  struct Shape {
    Mask mask;
    GridWarp warp;
    Placement placement;
    explicit Shape(const ContourGrid& grid);
  };

  Mask whole(const Shape& shape, int size);
  Prediction predict(const Shape& shape);
  void learn_later(Mask mask, SilhouetteMemory* memory);
  Judged judge_loss(const Shape& shape, const Prediction& predicted, const Picture& posterior,
                    const SilhouetteMemory& memory);
  Judged novel(const Shape& shape, const Prediction& predicted);

  int time_ = 0;
  bool lost_ = false;
  MotionPredictor motion_;
  std::vector<Mask> waiting_;  // to be learned, the oldest first
  double size_px_ = 0;
  Mask last_;  // the last whole silhouette, in the memory's frame
};

}  // namespace sdftrack::contour
