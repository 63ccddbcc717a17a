// SPDX-License-Identifier: MIT
// Simple linear iterative clustering (appendix A): k-means in colour and place, where each pixel is compared
// with the 9 centres around its own cell (docs/math/superpixels.md).
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "base/device_array.h"
#include "superpixels/center.h"
#include "superpixels/connect.h"
#include "superpixels/row_ops.h"

namespace sdftrack::superpixels {

struct SlicOptions {
  int n_segments = 100;
  double compactness = 10;  // m
  int max_iterations = 5;
  ColorSpace space = ColorSpace::kLab;
  SlicDistance distance = SlicDistance::kSquared;
  bool connected = true;
  double min_size = 0.25;  // smallest piece, as a part of the mean segment
  int first_label = 1;
  double depth_weight = 0;  // units of colour per metre
};

// Rows without gaps; uint8, or float in 0..1.
struct SlicImage {
  const std::uint8_t* bytes = nullptr;
  const float* floats = nullptr;  // one of the two
  int height = 0, width = 0, channels = 3;
  const std::uint8_t* mask = nullptr;   // may be null: the whole image
  const float* depth_m = nullptr;       // may be null: colour alone
  const ForeignArray* there = nullptr;  // for slic_cuda: bytes on the device, in place of `bytes`
};

struct SlicResult {
  int segments = 0, iterations = 0;
  double residual = 0;  // of the last iteration: mean motion of a centre, L1, in units of colour
  double connect_s = std::numeric_limits<double>::quiet_NaN();  // time for regions; unknown on a GPU
};

// Holds the working memory, 5 bytes a pixel, from call to call, and the centres of the last image.
class Slic {
 public:
  // `labels`: height x width; also used as working memory. resume: starts from the centres of the last image;
  // throws std::invalid_argument if that image had another size or other options. Throws
  // std::invalid_argument for arguments out of range.
  SlicResult run(const SlicImage& image, const SlicOptions& options, bool resume, int threads, int* labels);

  const CellGrid& grid() const { return grid_; }
  const std::vector<Center>& centers() const { return centers_; }
  std::size_t bytes() const;

 private:
  struct Band;
  void prepare(const SlicImage& image, const SlicOptions& options);
  void convert_rows(const SlicImage& image, const SlicOptions& options, int band, int* c2x);
  void remember(const SlicImage& image, int band, const int* c2x);
  void place_centers(const SlicImage& image, int band, const int* c2x, bool resume);
  void sum_home(int i, int band, const CellRows& cell, int x, int y, bool masked);
  void assign(int band, const SlicOptions& options, const int* c2x, bool first);
  std::int64_t update(int band);
  int center_of(int x, int y) const;

  CellGrid grid_;
  std::int64_t inside_ = 0;  // pixels to divide
  SlicOptions made_with_;
  float light_[256] = {};  // for each byte value
  ColorSpace light_of_ = ColorSpace::kXyz;
  bool light_made_ = false;
  std::vector<int> c01_, z_;
  std::vector<std::uint8_t> codes_;           // the code of each pixel's centre, kOutside outside the mask
  static constexpr std::size_t kMargin = 64;  // that can be read on either side of codes_
  std::uint8_t* codes() { return codes_.data() + kMargin; }
  std::vector<int> x_place_, y_place_;
  std::vector<Center> centers_;
  std::vector<CenterSums> sums_;  // of a band of cells: 3 rows of centres
  Connect connect_;
};

// The same on a CUDA device. The labels are copied to the
// host, or stay on the device in `labels_there`, 4 bytes a pixel.
SlicResult slic_cuda(const SlicImage& image, const SlicOptions& options, int device, int* labels,
                     DeviceArray* labels_there = nullptr);

// Throws std::invalid_argument that names an option out of range.
void check_slic(const SlicImage& image, const SlicOptions& options);

}  // namespace sdftrack::superpixels
