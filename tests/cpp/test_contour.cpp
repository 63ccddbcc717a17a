// SPDX-License-Identifier: MIT
// The contour's formulas in double, its sums on all instruction sets, pieces and distances.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <stdexcept>

#include "contour/registration.h"
#include "contour/shared_colors.h"
#include "contour/steps_cuda.h"
#include "contour/tracker.h"

namespace sdftrack {
namespace {

contour::ContourGrid disc(int nx, int ny, double x0, double y0, double radius) {
  contour::ContourGrid grid;
  grid.nx = nx, grid.ny = ny;
  grid.warp = {{1, 0, 0, 1}, {grid.mid_x(), grid.mid_y()}};
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) grid.phi.push_back(static_cast<float>(std::hypot(x - x0, y - y0) - radius));
  grid.inside = grid.all();
  return grid;
}

// Numbers of [0.02, 0.98], the same on every run.
std::vector<float> posteriors(std::size_t n) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> share(0.02f, 0.98f);
  std::vector<float> out(n);
  for (float& p : out) p = share(random);
  return out;
}

TEST(PosteriorCost, its_slope_is_the_derivative_of_its_cost) {
  const double h = 1e-6;
  for (const double phi : {-7.0, -1.5, -0.1, 0.0, 0.8, 5.0})
    for (const double p : {0.02, 0.4, 0.5, 0.98}) {
      const double slope = (contour::posterior_cost(phi + h, p, 1 / 1.5).cost -
                            contour::posterior_cost(phi - h, p, 1 / 1.5).cost) /
                           (2 * h);
      EXPECT_NEAR(contour::posterior_cost(phi, p, 1 / 1.5).slope, slope, 1e-8) << phi << " " << p;
      EXPECT_GE(contour::posterior_cost(phi, p, 1 / 1.5).curvature, 0);
    }
}

TEST(ContourOps,
     a_posterior_is_that_of_the_windows_around_a_pixel_to_the_same_bits_in_every_instruction_set) {
  constexpr int kWindows = 3, kColours = 4, kStride = 2 * kWindows * kWindows, kPixels = 37;
  std::vector<float> shares = posteriors(static_cast<std::size_t>(kColours * kStride)), x, y;
  for (float& share : shares) share += 0.01f;
  std::vector<int> colour;
  for (int i = 0; i < kPixels; ++i) {
    x.push_back(2.0f * static_cast<float>(i) / (kPixels - 1)), y.push_back(2 - 0.04f * static_cast<float>(i));
    colour.push_back(i % 5 == 4 ? -1 : i % 5 * kStride);  // every fifth was never seen
  }
  colour.resize(kPixels + 16);
  const auto share = [&](int i, int side) {
    const auto px = static_cast<double>(x[static_cast<std::size_t>(i)]),
               py = static_cast<double>(y[static_cast<std::size_t>(i)]);
    double sum = 0;
    for (int wy = 0; wy < kWindows; ++wy)
      for (int wx = 0; wx < kWindows; ++wx)
        sum += std::max(0.0, 1 - std::abs(px - wx)) * std::max(0.0, 1 - std::abs(py - wy)) *
               static_cast<double>(shares[static_cast<std::size_t>(colour[static_cast<std::size_t>(i)] +
                                                                   2 * (wy * kWindows + wx) + side)]);
    return sum;
  };
  std::vector<float> first;
  for (const Isa isa : supported_isas()) {
    std::vector<float> out(kPixels);
    for_isa<contour::ContourOps>(isa).posterior(
        {x.data(), y.data(), colour.data(), shares.data(), kWindows, 0.2f}, kPixels, out.data());
    for (int i = 0; i < kPixels; ++i) {
      const double own = i % 5 == 4 ? 1 : share(i, 0), other = i % 5 == 4 ? 1 : share(i, 1);
      EXPECT_NEAR(static_cast<double>(out[static_cast<std::size_t>(i)]),
                  std::clamp(own / (own + other), 0.2, 0.8), 1e-6)
          << i << isa_name(isa);
    }
    if (first.empty()) first = out;
    EXPECT_EQ(out, first) << isa_name(isa);
  }
}

TEST(ContourOps, samples_are_summed_at_every_place_to_the_same_bits_in_every_instruction_set) {
  constexpr int kWidth = 19, kHeight = 13;
  const std::vector<float> posterior = posteriors(kWidth * kHeight);
  const std::vector<float> x{-2, 0.5f, 3, 1}, y{1, -0.25f, 2, 0};
  std::vector<float> u0, v0;
  for (int k = 0; k < 37; ++k)  // some of them beside the image, one nowhere
    u0.push_back(static_cast<float>(k - 6)), v0.push_back(static_cast<float>(k) * 0.4f - 1);
  u0.push_back(std::numeric_limits<float>::quiet_NaN()), v0.push_back(3);
  u0.push_back(1e20f), v0.push_back(3);
  const contour::PlacedSamples samples{x.data(),         y.data(), 4,      {1.5f, 0.2f, -0.3f, 1.1f},
                                       posterior.data(), kWidth,   kHeight};
  std::vector<float> first;
  for (const Isa isa : supported_isas()) {
    std::vector<float> sums(u0.size());
    for_isa<contour::ContourOps>(isa).sums_at(samples, u0.data(), v0.data(), static_cast<int>(u0.size()),
                                              sums.data());
    for (std::size_t k = 0; k < u0.size(); ++k) {
      float sum = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const float u = std::floor(u0[k] + 1.5f * x[i] + 0.2f * y[i]) - 1,
                    v = std::floor(v0[k] + -0.3f * x[i] + 1.1f * y[i]) - 1;
        const bool there = u >= 0 && v >= 0 && u < kWidth && v < kHeight;
        sum += there ? posterior[static_cast<std::size_t>(static_cast<int>(v) * kWidth + static_cast<int>(u))]
                     : 0.5f;
      }
      EXPECT_EQ(sums[k], sum) << k << isa_name(isa);
    }
    if (first.empty()) first = sums;
    EXPECT_EQ(sums, first) << isa_name(isa);
  }
}

TEST(ContourOps, products_of_rows_have_the_same_bits_in_every_instruction_set) {
  constexpr std::size_t kRows = 6, kLength = 48;
  const std::vector<float> rows = posteriors(kRows * kLength), b = posteriors(kLength);
  std::vector<float> first;
  for (const Isa isa : supported_isas()) {
    std::vector<float> out(2 * kRows);
    for_isa<contour::ContourOps>(isa).products(rows.data(), kRows, b.data(), kLength, out.data(), 2);
    for (std::size_t i = 0; i < kRows; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < kLength; ++k)
        sum += static_cast<double>(rows[i * kLength + k]) * static_cast<double>(b[k]);
      EXPECT_NEAR(static_cast<double>(out[2 * i]), sum, 1e-5 * sum);  // of float sums
    }
    if (first.empty()) first = out;
    EXPECT_EQ(out, first) << isa_name(isa);
  }
}

TEST(Pieces, a_speck_goes_and_a_ring_stays_one) {
  contour::ContourGrid grid = disc(60, 40, 20, 20, 12);
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x) {
      float& phi = grid.phi[static_cast<std::size_t>(y * grid.nx + x)];
      if (std::hypot(x - 20, y - 20) < 9) phi = 1;                // a hole: the ring is one piece
      if (std::abs(x - 50) < 2 && std::abs(y - 6) < 2) phi = -1;  // a speck
    }
  int ring = 0;
  for (const float phi : grid.phi) ring += phi < 0;
  contour::EvolutionWork work;
  EXPECT_EQ(contour::drop_small_pieces(0.1f, 100, &work, &grid), ring - 9);
  EXPECT_GT(grid.phi[6 * 60 + 50], 0);
  EXPECT_LT(grid.phi[20 * 60 + 9], 0);
}

TEST(RegionModel, squares_are_means_of_pixels_and_stay_in_the_part) {
  constexpr int kWidth = 53, kHeight = 37;
  std::vector<unsigned char> rgb(3 * kWidth * kHeight);
  std::mt19937 random(3);
  for (unsigned char& c : rgb) c = static_cast<unsigned char>(random() % 4 * 60);
  const contour::RgbView image{rgb.data(), kWidth, kHeight};
  contour::RegionModel model{contour::ContourOptions{}};
  ASSERT_TRUE(model.learn(image, disc(41, 31, 20, 15, 8), 1, 1));
  contour::PosteriorImage pixels, squares;
  const contour::ImagePart part{3, 2, 50, 36};
  model.posterior_anywhere(image, part, &pixels);
  model.posterior_of_squares(image, part, 1, &squares);
  EXPECT_EQ(squares.foreground, pixels.foreground);
  model.posterior_of_squares(image, part, 2, &squares);
  ASSERT_EQ(squares.rect.width(), 24);
  ASSERT_EQ(squares.rect.height(), 17);
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 23; ++x) {
      const int u = 3 + 2 * x, v = 2 + 2 * y;
      const float mean =
          0.25f * (pixels.at(u, v) + pixels.at(u + 1, v) + pixels.at(u, v + 1) + pixels.at(u + 1, v + 1));
      EXPECT_NEAR(squares.at(x, y), mean, 1e-6) << x << " " << y;
    }
}

// Under a turn of 1e-9 a row beside the cells meets them farther away than an int holds.
TEST(Region, rows_stay_in_the_picture_under_a_turn_of_next_to_nothing) {
  const contour::ImagePart rect{0, 0, 41, 31};
  for (const double turn : {0.0, 1e-15, 2e-9, 1.1e-9, 1e-7, -1e-9, -3e-9, -1e-5}) {
    contour::ContourGrid grid = disc(21, 15, 10, 7, 5);
    grid.warp = {{1, -turn, turn, 1}, {20, 15}};
    int pixels = 0;
    contour::each_row_on(grid, grid.all(), rect,
                         [&](int y, int xa, int xb, double gx, double gy, double, double) {
                           ASSERT_GE(xa, rect.x0);
                           ASSERT_LE(xb, rect.x1);
                           ASSERT_TRUE(gx >= 0 && gx <= 20 && gy >= 0 && gy <= 14) << y;
                           pixels += xb - xa;
                         });
    EXPECT_NEAR(pixels, 20 * 14, 40) << turn;
  }
}

TEST(FlatDistance, of_an_empty_grid_is_as_far_as_it_goes) {
  contour::ContourGrid grid = disc(20, 16, -90, -90, 1);
  contour::FlatDistanceWork work;
  contour::redistance(12, &work, &grid);
  for (const float phi : grid.phi) EXPECT_EQ(phi, 12);
}

// A red disc on grey, at `x`.
struct DiscImage {
  static constexpr int kWidth = 96, kHeight = 72;
  std::vector<unsigned char> rgb, mask;

  explicit DiscImage(double x) {
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const bool inside = std::hypot(u - x, v - 36) < 18;
        mask.push_back(inside);
        rgb.push_back(static_cast<unsigned char>(inside ? 190 + u % 9 : 90 + v % 7));
        for (const int grey : {100, 110}) rgb.push_back(static_cast<unsigned char>(inside ? 50 : grey));
      }
  }
  contour::RgbView view() const { return {rgb.data(), kWidth, kHeight}; }
};

std::vector<float> copy_of(std::span<const float> values) { return {values.begin(), values.end()}; }

TEST(ContourPhases, an_occluded_or_a_novel_shape_changes_no_colours) {
  const DiscImage first(48);
  DiscImage dark(48);
  for (std::size_t i = 0; i < dark.rgb.size(); i += 12)  // every fourth pixel, in another bin
    dark.rgb[i] = static_cast<unsigned char>(dark.rgb[i] * 9 / 10);
  using contour::ShapeJudgement;
  std::vector<float> after[4];
  for (const auto judgement : {ShapeJudgement::kNone, ShapeJudgement::kUnoccluded, ShapeJudgement::kOccluded,
                               ShapeJudgement::kNovel}) {
    contour::ContourTracker tracker{contour::ContourOptions{}};
    tracker.start(first.view(), first.mask.data());
    ASSERT_EQ(tracker.observe(dark.view()).report.status, contour::ContourStatus::kOk);
    tracker.finish(judgement);
    after[static_cast<int>(judgement)] = copy_of(tracker.posterior_on_grid(dark.view()));
  }
  EXPECT_EQ(after[0], after[1]);
  EXPECT_EQ(after[2], after[3]);
  EXPECT_NE(after[1], after[2]);
}

TEST(FlatDistance, is_that_to_the_nearest_cell_of_the_other_side_away_from_the_outline) {
  contour::ContourGrid grid = disc(44, 40, -90, -90, 1);
  std::mt19937 random(5);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 44; ++x)
      grid.phi[std::size_t(y) * 44 + x] =
          x >= 10 && x < 35 && y >= 8 && y < 30 && random() % 50 > 0 ? -0.5f : 0.5f;
  const std::vector<float> side = grid.phi;
  contour::FlatDistanceWork work;
  contour::redistance(12, &work, &grid);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 44; ++x) {
      const float own = side[std::size_t(y) * 44 + x], got = grid.phi[std::size_t(y) * 44 + x];
      double nearest = 12.5;
      for (int v = 0; v < 40; ++v)
        for (int u = 0; u < 44; ++u)
          if (side[std::size_t(v) * 44 + u] != own) nearest = std::min(nearest, std::hypot(u - x, v - y));
      EXPECT_EQ(got < 0, own < 0);
      if (nearest - 0.5 > 1.2) EXPECT_NEAR(std::abs(got), nearest - 0.5, 1e-5);
    }
}

TEST(FlatDistance, stays_what_it_is) {
  contour::ContourGrid grid = disc(61, 51, 30, 25, 14);
  const std::vector<float> before = grid.phi;
  contour::FlatDistanceWork work;
  contour::redistance(12, &work, &grid);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const float off = std::abs(grid.phi[i] - before[i]);
    if (std::abs(before[i]) < 1) EXPECT_LT(off, 0.1);    // the slope of a disc's distance by differences
    if (std::abs(before[i]) < 10) EXPECT_LT(off, 0.75);  // whole cells beyond
  }
}

// phi at pixel (u, v), bilinear, in double; beyond the grid the border goes on.
double phi_at(const contour::ContourGrid& grid, const contour::GridWarp& warp, double u, double v) {
  double x, y;
  warp.inverse().to_image(u, v, &x, &y);
  x = std::clamp(x + grid.mid_x(), 0.0, grid.nx - 1.0), y = std::clamp(y + grid.mid_y(), 0.0, grid.ny - 1.0);
  const int ix = std::min(int(x), grid.nx - 2), iy = std::min(int(y), grid.ny - 2);
  const float* const a = &grid.phi[std::size_t(iy) * std::size_t(grid.nx) + std::size_t(ix)];
  const double fx = x - ix, fy = y - iy, top = double(a[0]) + fx * double(a[1] - a[0]),
               bottom = double(a[grid.nx]) + fx * double(a[grid.nx + 1] - a[grid.nx]);
  return top + fy * (bottom - top);
}

// The sums with a row of differences for each pixel.
template <int P>
void expect_the_sums_of_the_twin() {
  contour::ContourGrid grid = disc(61, 51, 30, 25, 14);
  grid.warp = {{0.95, -0.2, 0.25, 1.05}, {41.3, 29.2}};
  contour::RegistrationWork work;
  std::mt19937 random(1);
  work.foreground = posteriors(3000);
  for (int i = 0; i < 3000; ++i)
    work.u.push_back(float(12 + random() % 57)), work.v.push_back(float(8 + random() % 45));
  const energies::Sums<double, P> sums = contour::registration_sums<P>(grid, work, 1.5);
  double cost = 0;
  Eigen::Matrix<double, P, 1> g = Eigen::Matrix<double, P, 1>::Zero();
  Eigen::Matrix<double, P, P> H = Eigen::Matrix<double, P, P>::Zero();
  for (std::size_t i = 0; i < work.u.size(); ++i) {
    const double u = double(work.u[i]), v = double(work.v[i]);
    const auto at =
        contour::posterior_cost(phi_at(grid, grid.warp, u, v), double(work.foreground[i]), 1 / 1.5);
    Eigen::Matrix<double, P, 1> row;
    for (int k = 0; k < P; ++k) {
      double up[P] = {}, down[P] = {};
      up[k] = 1e-6, down[k] = -1e-6;
      row[k] = (phi_at(grid, contour::moved<P>(grid.warp, up), u, v) -
                phi_at(grid, contour::moved<P>(grid.warp, down), u, v)) /
               2e-6;
    }
    cost += at.cost, g += at.slope * row, H += at.curvature * row * row.transpose();
  }
  EXPECT_NEAR(sums.cost, cost, 1e-4 * cost);
  // What falls beside a cell's border in float has its neighbour's slope.
  for (int a = 0, n = 0; a < P; ++a) {
    EXPECT_NEAR(sums.gradient[a], g[a], 2e-3 * g.cwiseAbs().maxCoeff());
    for (int b = 0; b <= a; ++b, ++n) EXPECT_NEAR(sums.hessian[n], H(a, b), 2e-3 * H.cwiseAbs().maxCoeff());
  }
}

TEST(Registration, the_sums_of_a_similarity_are_those_of_the_twin) { expect_the_sums_of_the_twin<4>(); }
TEST(Registration, the_sums_of_an_affinity_are_those_of_the_twin) { expect_the_sums_of_the_twin<6>(); }

// A disc before a ground that has its colours in a sector of `share` of the outline.
TEST(SharedColors, the_share_of_the_outline_beside_the_objects_own_colours_is_measured) {
  constexpr int kWidth = 240, kHeight = 180;
  for (const double share : {0.0, 0.3, 0.7, 1.0}) {
    std::mt19937 random(0);
    std::normal_distribution<double> texture(0, 8);
    std::vector<unsigned char> rgb;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const bool own =
            std::hypot(x - 120, y - 90) < 45 || std::atan2(y - 90, x - 120) < 3.14159 * (2 * share - 1);
        for (const int c : own ? std::array{110, 108, 100} : std::array{60, 130, 70})
          rgb.push_back(static_cast<unsigned char>(std::clamp(c + texture(random), 0.0, 255.0)));
      }
    contour::ContourGrid grid = disc(120, 120, 60, 60, 45);
    grid.warp = {{1, 0.02, -0.02, 1}, {119.5, 89.5}};
    contour::SharedColorsWork work;
    EXPECT_NEAR(contour::shared_outline({rgb.data(), kWidth, kHeight}, grid, &work), share, 0.15);
  }
}

}  // namespace
}  // namespace sdftrack
