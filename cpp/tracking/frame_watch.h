// SPDX-License-Identifier: MIT
// Detects frames that do not show the moment they claim to: a repeated depth image, timestamps that do not
// advance, a colour image of another exposure.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "frame/region.h"
#include "tracking/trust/reason.h"

namespace sdftrack::tracking {

// Compares each frame of a sequence with the one before on a fixed sparse set of pixels. Takes some
// microseconds for an image of any size.
class FrameWatch {
 public:
  void forget() { *this = {}; }
  // The fault of the next frame of the sequence; kNone: no fault. regions: of the depth image, where the
  // objects were last; depth_m: their approximate distance.
  ReasonCode look(const frame::DepthFrame& frame, const std::vector<frame::Rect>& regions, float depth_m);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [depths, seen, time_s, usual_step_s, steps, brightness] = self;
    archive(depths, seen, time_s, usual_step_s, steps, brightness);
  }

 private:
  static constexpr int kRows = 24, kRuns = 12,
                       kRun = 16;  // runs of neighbouring pixels, side by side in rows
  static constexpr int kColorRows = 12, kColorColumns = 16;
  using Depths = std::array<float, kRows * kRuns * kRun>;

  struct Brightness {
    double image = -1, objects = -1;  // means of 0..255; below 0: not known

    template <class Archive, class Self>
    static void visit(Archive& archive, Self& self) {
      auto& [whole, regions] = self;
      archive(whole, regions);
    }
  };

  bool repeats(const ImageView<float>& depth_m);
  ReasonCode check_time(double time_s);
  bool exposure_jumps(const Brightness& now) const;
  static Brightness brightness(const frame::DepthFrame& frame, const std::vector<frame::Rect>& regions,
                               float depth_m);

  Depths depths_{};
  bool seen_ = false;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
  double usual_step_s_ = 0;
  int steps_ = 0;
  Brightness brightness_;
};

// The status of a pose that was measured in a faulty frame: weak at best.
void doubt_frame(ReasonCode fault, Status* status, Reason* reason, double* confidence);

}  // namespace sdftrack::tracking
