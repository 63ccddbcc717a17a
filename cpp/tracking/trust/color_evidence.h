// SPDX-License-Identifier: MIT
// The colours of depth pixels: for the energy's pixels, and for the histograms of object and background.
#pragma once

#include "appearance/color_model.h"
#include "appearance/color_sight.h"
#include "energies/photometric.h"
#include "energies/pixel_set.h"
#include "frame/region.h"
#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

// The colour of depth pixels in one region of one frame. `open` enters the region's measurements into the
// colour camera's z-buffer; the work is that of the region (an even subset of a large one), not of the image.
class ColorReader {
 public:
  // range: depths whose colours will be requested.
  void open(const frame::DepthFrame& frame, const Camera& camera, frame::Rect region,
            frame::DepthRange range);
  // Histogram bin of the colour of depth pixel `at`, by its ideal pixel and depth; -1: not seen in colour.
  int bin(int at, Vec2f ideal_px, float depth_m) const {
    if (color_->map.aligned) return appearance::color_bin(color_->rgb + 3 * std::size_t(at));
    int x, y;
    float depth;
    return find(at, ideal_px, depth_m, &x, &y, &depth) ? appearance::color_bin(color_->at(x, y)) : -1;
  }
  // Interpolated brightness of a pixel, 0..1; -1: the colour camera does not see it.
  float grey(int at, Vec2f ideal_px, float depth_m) const;

 private:
  Vec2f mapped_from(int at, Vec2f ideal_px) const {
    return color_->map.raw_pixel ? Vec2f{float(at % width_), float(at / width_)} : ideal_px;
  }
  bool find(int at, Vec2f ideal_px, float depth_m, int* x, int* y, float* depth) const {
    return color_->map.find(mapped_from(at, ideal_px), depth_m, x, y, depth) && sight_.sees(*x, *y, *depth);
  }

  const appearance::ColorImage* color_ = nullptr;
  int width_ = 1;
  appearance::ColorSight sight_;
};

// Fetches about `requested` of the pixels, evenly, with their brightness.
void fetch_grey(const ColorReader& reader, const energies::PixelSet& pixels, int requested,
                energies::GreyPixels* out);

// Posterior of every pixel from an open reader; the prior where there is no colour.
void fetch_foreground(const appearance::ColorModel& model, const ColorReader& reader,
                      energies::PixelSet* pixels);

// Colours at a pose. The object's are those of measurements on the surface, away from depth steps, weighted
// by what is known so far. The background's are those of measurements clearly off it and off the other
// objects, around it and in front. Visits about `budget` pixels, evenly. `plain`: the object's are all within
// three voxels of the surface, with a weight of 1, and the background's all that are farther (thesis, 4.4.3).
void count_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                  const Rigidd& T_cam_obj, double padding_m, int budget, const appearance::ColorModel& known,
                  ColorReader* reader, appearance::ColorCounts* counts, const Neighbors& others = {},
                  bool plain = false);

// Colours in and around a mask (0: not the object): the object's inside, the background's in a ring as wide
// as 30 % of its box. std::invalid_argument for an empty mask, or one without a coloured measurement.
void count_mask_colors(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                       ColorReader* reader, appearance::ColorCounts* counts);

}  // namespace sdftrack::tracking
