// SPDX-License-Identifier: MIT
// What is known of an outline beside its colours: the flow, the colours at the start, the place in a box.
#include <gtest/gtest.h>

#include <cmath>

#include "contour/cues/box_start.h"
#include "contour/cues/evidence.h"
#include "contour/memory/mask_ops.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {
namespace {

Mask box_mask(int width, int height, const ImagePart& box) {
  Mask out(width, height);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) out.row(y)[x] = 1;
  return out;
}

TEST(EdgeAwareMean, does_not_cross_an_edge) {
  Picture gray(40, 20);
  for (int y = 0; y < 20; ++y)
    for (int x = 20; x < 40; ++x) gray.row(y)[x] = 1;
  const Picture kept = edge_aware_mean(gray, gray, 3), crossed = box_mean(gray, 3);
  EXPECT_NEAR(kept.row(10)[19], 0, 0.15f);
  EXPECT_NEAR(kept.row(10)[20], 1, 0.15f);
  EXPECT_GT(crossed.row(10)[19], 0.4f);
}

TEST(MovedMask, goes_where_the_flow_takes_it_and_stays_beside_the_flow) {
  const Mask mask = box_mask(30, 20, {8, 5, 14, 15});
  const ImagePart part{0, 0, 30, 10};
  std::vector<float> back;
  for (int i = 0; i < part.width() * part.height(); ++i) back.insert(back.end(), {-3.0f, 0.25f});
  const Mask moved = moved_mask(mask, {back.data(), part});
  EXPECT_EQ(both(moved, box_mask(30, 20, {0, 0, 30, 10})), box_mask(30, 20, {11, 5, 17, 10}));
  EXPECT_EQ(both(moved, box_mask(30, 20, {0, 10, 30, 20})), box_mask(30, 20, {8, 10, 14, 15}));
}

TEST(Evidence, says_how_far_flow_and_colours_disagree) {
  const Mask mask = box_mask(20, 10, {4, 2, 12, 8}), half = box_mask(20, 10, {8, 2, 12, 8});
  std::vector<unsigned char> rgb(3 * mask.size(), 10);
  for (std::size_t i = 0; i < rgb.size() / 2; ++i) rgb[i] = 200;  // the upper rows
  const RgbView image{rgb.data(), 20, 10};
  const std::vector<double> shares = colors_inside(image, mask.values.data());
  EXPECT_DOUBLE_EQ(shares.front(), 0.5);
  EXPECT_DOUBLE_EQ(shares[(6 << 6) + (6 << 3) + 6], 0.5);
  EXPECT_EQ(colors_inside(image, Mask(20, 10).values.data()), std::vector<double>(512));
  EvidenceGatherer gatherer(image, mask.values.data(), 0.1);
  Evidence found = gatherer.gather(image, half.values.data(), nullptr, 0.2);
  EXPECT_DOUBLE_EQ(found.disagreement, 0.5);
  EXPECT_DOUBLE_EQ(found.mean_disagreement, 0.1);
  EXPECT_NEAR(found.strangeness, 0, 1e-12);
  EXPECT_EQ(found.first_instability, 0.1);
  const Mask upper = box_mask(20, 10, {4, 2, 12, 5});
  found = gatherer.gather(image, upper.values.data(), nullptr, 0.2);
  EXPECT_NEAR(found.strangeness, 1 - std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(certainty({0.1, 0.2, 0.3, 0, 0}),
              1 / (1 + std::exp(-(4.23 - 0.1 * 2.21 - 0.2 * 8.91 - 0.3 * 4.23))), 1e-12);
  EXPECT_EQ(verdict({0, 1, 0, 0, 0}, ContourStatus::kOk, "").status, ContourStatus::kWeak);
  EXPECT_EQ(verdict({0, 1, 0, 0, 0}, ContourStatus::kLost, "why").reason, "why");
}

}  // namespace
}  // namespace sdftrack::contour
