// SPDX-License-Identifier: MIT
// What a tracker remembers of one object.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame/symmetry.h"
#include "tracking/fit/fit.h"
#include "tracking/motion.h"
#include "tracking/pose_hint.h"
#include "tracking/size/size_test.h"
#include "tracking/trust/color_delay.h"
#include "tracking/trust/open_directions.h"

namespace sdftrack::tracking {

// Another pose that explained the object's start equally well.
struct Alternative {
  Rigidd motion;        // from the object's pose to it, in the centred object frame
  double log_odds = 0;  // of the object's pose against it, over the frames since

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [T, odds] = self;
    archive(T, odds);
  }
};

constexpr int kDeterminedFrames = 5;  // after which a growing shape's direction is determined again
constexpr int kProvingFrames = 15;    // needed to confirm the turn in which a growing shape was found again

struct TrackedObject {
  std::shared_ptr<const frame::Shape> shape;  // objects of the same volume share it
  Rigidd T_cam_obj;                           // centred frame; the last that was not lost
  FitMemory memory;
  ConstantVelocity motion;
  appearance::ColorModel colors;
  appearance::LocalColors outline_colors;
  bool colors_by_outline = false;  // learnt inside the silhouette, for lack of depth
  double usual_share = 0;          // of agreeing surface points, lately; 0: not known yet
  double usual_cost = 0;           // mean per pixel, lately
  ColorDelay color_delay;          // of what it shows, since the start of the sequence
  OpenDirections open;             // directions of its pose, in the last frame that showed it
  // Consecutive frames with nothing open: a growing shape shows some directions by chance only.
  int determined_frames = kDeterminedFrames;
  int unproven_frames = 0;            // consecutive sure frames needed before a turn after a loss is accepted
  SizeTest size;                      // since the start
  bool free_scale = false;            // the model has the object's form, not its size
  double log_scale = 0;               // of shape over the model as it was given
  bool unread = false;                // by the depth sensor, in the last frame: followed by its outline
  PredictionErrors errors;            // 0 for a given pose, which is assumed to be right
  bool given = false;                 // the caller vouches for its pose; until a frame has shown the object
  bool by_mask_alone = false;         // found in a mask or box although the residuals contradict it
  bool weak = false;                  // in the last frame
  bool unlikely = false;              // more likely wrong than right, lately: see doubt_unlikely
  int sure_frames = 0;                // since the start
  int weak_frames = 0;                // in a row
  double prior_log_odds = 0;          // see evidence_share; until a frame has shown that it is the object
  int lost_frames = 0;                // in a row, up to the last frame
  int hidden_frames = 0;              // in a row: placed by its neighbours and its motion alone
  std::optional<Matrix6d> prior;      // information about T_cam_obj, for the next frame alone
  std::optional<PoseHint> requested;  // to be searched for in the next frame
  bool to_search = false;             // in this frame, once all others have been followed
  int doubtful_frames = 0;  // remaining frames in which it is unclear which of two look-alikes this is
  int double_of = -1;       // the other look-alike
  std::vector<Alternative> alternatives;  // to its pose, not yet refuted
  frame::Symmetry symmetry;               // declared, in the caller's object frame
  std::vector<Rigidd> symmetries;         // its motions in the centred frame, but for the identity
  std::optional<Rigidd> reported;         // the last pose, of equivalent ones, in the caller's object frame
  // The pose to return to while a recovery has not been confirmed by a later frame.
  std::optional<Rigidd> before_found;
  int trial_frames = 0;  // since the recovery
  // For a placeholder of a primitive that has not been found yet: its kind. Empty: an ordinary shape.
  std::string unfound;
  bool primitive = false;  // turns about the primitive's own axes have no meaning

  // Observes T_cam_obj as a reliable pose. Along directions that the frame does not show, two poses differ
  // only by errors, so no velocity is taken from them.
  void observe_motion(double time_s);

  // Whether the pose is held where the frame does not show how the object moves: for known shapes only. A
  // growing shape may show its motion by features too small to tell from noise.
  bool holds_open_directions() const { return !open.empty() && !shape->seen.amount; }

  // Whether T_cam_obj is the pose in the last frame.
  bool followed() const { return lost_frames == 0 && !requested; }

  // Whether it is reliable enough to keep other objects off its measurements.
  bool holds_its_place() const { return followed() && (!weak || before_found); }

  // Whether this frame need not search the image for it.
  bool placed() const { return requested ? requested->T_cam_obj.has_value() : lost_frames == 0; }

  void forget(const TrackerOptions& options) {
    memory = {};
    memory.systematic_m = options.systematic_m;
    motion.reset(), errors = {}, open = {}, determined_frames = kDeterminedFrames, size = {}, unread = false,
                    sure_frames = unproven_frames = 0;
    usual_share = usual_cost = prior_log_odds = 0, weak = unlikely = given = by_mask_alone = false,
    lost_frames = hidden_frames = weak_frames = 0;
    prior.reset(), requested.reset(), before_found.reset();
    doubtful_frames = 0, double_of = -1;
    alternatives.clear();
  }

  // All but the shape, which belongs to the caller.
  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [surface, pose, fit, moves, whole, outline, by_outline, share, cost, delay, undetermined,
           determined, unproven, scale, is_free, log_scale, without_depth, off, vouched, by_mask, unsure,
           dubious, sure_count, weak_count, odds, lost_count, hidden_count, information, hint, search,
           doubtful_count, twin, others, declared, turns, told, before, trial_count, kind, solid] = self;
    archive(pose, fit, moves, whole, outline, by_outline, share, cost, delay, undetermined, determined,
            unproven, scale, is_free, log_scale, without_depth, off, vouched, by_mask, unsure, dubious,
            sure_count, weak_count, odds, lost_count, hidden_count, information, hint, search, doubtful_count,
            twin, others, declared, turns, told, before, trial_count, kind, solid);
  }
};

// Whether no further attempt is needed. A followed object is compared with its own usual values; at a start
// only the unoccluded surface can be judged.
bool convincing(const Fitted& fitted, const TrackedObject& object, const TrackerOptions& options);

// The caller's object frame and the centred one.
inline Rigidd centred(const Rigidd& T_cam_obj, const frame::Shape& shape) {
  return {T_cam_obj.R, T_cam_obj * shape.centre_obj};
}
inline Rigidd uncentred(const Rigidd& T_cam_centre, const frame::Shape& shape) {
  return {T_cam_centre.R, T_cam_centre * -shape.centre_obj};
}

}  // namespace sdftrack::tracking
