// SPDX-License-Identifier: MIT
// The per-frame recipe: pixels -> energies -> minimize, coarse to fine -> covariance and trust.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "energies/free_space.h"
#include "optim/lm.h"
#include "optim/prior.h"
#include "tracking/plane.h"
#include "tracking/trust.h"

namespace sdftrack {

struct TrackStep {
  LmStep step;
  double scale_m;
  int pixels;
};

struct ObjectResult {
  Rigidd T_cam_obj;     // of the caller's object frame; the last good one when lost
  Matrix6d covariance;  // NaN when lost
  Trust trust;
  double cost = 0;  // mean per pixel of the last stage
  std::vector<TrackStep> steps;
};

// Tracks shapes one by one, each from its own last pose.
class Tracker {
 public:
  // The volumes behind the shapes' views belong to the caller and outlive the tracker.
  Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
          int threads);

  int object_count() const { return static_cast<int>(objects_.size()); }
  const Camera& camera() const { return camera_; }
  void set_camera(const Camera& camera);  // of the frames to come

  // Forgets all history and fits from the given poses (caller's object frames).
  std::vector<ObjectResult> start(const ImageView<float>& depth_m, const unsigned char* mask,
                                  const std::vector<Rigidd>& T_cam_obj);
  std::vector<ObjectResult> track(const ImageView<float>& depth_m, const unsigned char* mask);
  void set_pose(int k, const Rigidd& T_cam_obj);

 private:
  // Measured over stated sensor noise.
  struct Noise {
    double factor = 1;
    bool known = false;
  };
  struct Object {
    std::shared_ptr<const Shape> shape;  // objects of the same volume share it
    Rigidd T_cam_obj;                    // centred frame
    Noise noise;
    Rigidd last_motion;      // of the last two accepted poses: T_cam_obj <- last_motion T_cam_obj
    double usual_share = 0;  // of agreeing surface points, lately
    double damping = 0;
  };

  std::vector<ObjectResult> track_all(const DepthFrame& frame);
  // One search about the last pose: how far away its first stage looks, and where from.
  struct Attempt {
    double scale_m, padding_m;
    int coarse_steps;
    std::vector<Rigidd> starts;  // T_cam_obj, centred; the best after the coarse stages goes on
  };
  struct Fitted {
    ObjectResult result;
    Rigidd T_cam_obj;  // centred frame
    Visibility seen;
    Noise noise;
  };
  void follow_plane(const DepthFrame& frame);
  ObjectResult track_one(const DepthFrame& frame, Object* object);
  Fitted polished(const DepthFrame& frame, Object* object, const Fitted& wide);
  static void keep(const Fitted& fitted, Object* object);
  Attempt wide_attempt(const Object& object) const;
  std::optional<Fitted> try_fit(const DepthFrame& frame, Object* object, const Attempt& attempt);
  void run_stage(Object* object, PixelSet* pixels, const SdfEnergyOptions& energy, int steps, State* x,
                 ObjectResult* result);
  State best_coarse_fit(const DepthFrame& frame, Object* object, const Attempt& attempt, Fitted* fitted);
  void fit_coarse(Object* object, const Attempt& attempt, State* x, Fitted* fitted);
  void choose_fine_pixels(Object* object, double scale_m, const State& x);
  void fit_fine(Object* object, double stated_noise_m, State* x, Fitted* fitted);
  double last_scale(const Noise& noise, double stated_noise_m) const;
  static Noise updated(const Noise& noise, double measured_m, double stated_m);
  ObjectResult lost(const Object& object, std::string reason, Status status) const;
  DepthFrame make_frame(const ImageView<float>& depth_m, const unsigned char* mask) const;

  std::vector<Object> objects_;
  Camera camera_;
  TrackerOptions options_;
  int threads_;
  std::vector<float> rays_;  // empty without distortion
  PlaneFollower plane_;

  // Working memory, kept from frame to frame.
  PixelSet pixels_, coarse_, scratch_;
  FreeSpaceScratch free_scratch_;
  DistanceGrid free_grid_;
  std::vector<Vec3f> free_points_;
};

}  // namespace sdftrack
