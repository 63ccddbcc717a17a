// SPDX-License-Identifier: MIT
// The tracker for Python: it keeps the arrays of its volumes. sdftrack.Tracker admits one thread at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "appearance.h"
#include "release_gil.h"
#include "tracking/start/start.h"
#include "tracking/tracker.h"
#include "volume.h"

namespace sdftrack::bindings {

// A frame from Python. depth, mask and colour may be None; without depth, `error` may give the reason.
struct PyFrame {
  py::object depth, mask, color, color_map;
  double time_s;
  std::string error;
  py::object given = py::none();  // the depth before holes were filled; None: the same
};

class PyTracker {
 public:
  PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera,
            const tracking::TrackerOptions& options, int threads, bool recover, tracking::MotionModel motion,
            int device, tracking::Collision collision);

  tracking::Tracker& core() { return *tracker_; }
  // The core, which has an object k; ValueError otherwise.
  tracking::Tracker& with(int k);

  // Calls work(frame) on the core's form of the frame, without the interpreter's lock.
  template <class Release = ReleaseGil, class Work>
  void run(const PyFrame& frame, const Work& work) {
    const appearance::ColorImage image = color_view(frame.color, frame.color_map);
    const appearance::ColorImage* const color = image.rgb ? &image : nullptr;
    if (frame.depth.is_none()) {
      const Release release;
      work(tracker_->make_unreadable_frame(frame.error, frame.time_s, color));
      return;
    }
    const ImageView<float> view = image_view(frame.depth.cast<py::array>(), "depth", tracker_->camera());
    const unsigned char* mask_data = mask_view(frame.mask, tracker_->camera());
    const float* const given_m = given_view(frame.given, tracker_->camera());
    const Release release;
    frame::DepthFrame seen = tracker_->make_frame(view, mask_data, frame.time_s, color);
    seen.given_m = given_m;
    work(seen);
  }

  // The arrays of each object's shape, released with the object.
  struct Held {
    py::array values, seen, colors;
  };
  std::vector<Held> held;

 private:
  std::unique_ptr<tracking::Tracker> tracker_;
};

// Warns if the depth of a frame seems to be along each pixel's ray; without the interpreter's lock it may
// only be found out.
// levels: of the stack, from here to the caller of `start`.
void warn_of_ray_length(int levels);

}  // namespace sdftrack::bindings
