// SPDX-License-Identifier: MIT
#include "contour/cues/evidence.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr int kBits = 3;         // of each colour channel, for the comparison
constexpr double kMemory = 0.8;  // weight of the past in the mean disagreement with the flow

// One for each term of the regression.
constexpr const char* kReasons[] = {
    "the outline does not move as the image inside it does",
    "the outline has not moved as the image inside it did in the last frames",
    "the colours inside the outline differ from those at the start",
    "the first mask changes with the box; draw the box as tight as possible, or start from a mask"};
constexpr std::size_t kFirstTerm = 3;

std::array<double, 4> terms(const Evidence& e) {
  std::array<double, 4> out = {e.disagreement, e.mean_disagreement, e.strangeness, e.first_instability};
  for (std::size_t k = 0; k < out.size(); ++k) out[k] *= kEvidenceWeights[k];
  return out;
}

}  // namespace

double certainty(const Evidence& evidence) {
  double log_odds = kEvidenceBias;
  for (const double term : terms(evidence)) log_odds += term;
  double chance = 1 / (1 + std::exp(-log_odds));
  if (evidence.first_instability > kMaxInstability) chance *= kSure;
  return evidence.shared <= kMaxShared ? chance : std::min(chance, 1 - evidence.shared);
}

EvidenceVerdict verdict(const Evidence& evidence, ContourStatus status, const std::string& reason) {
  const double confidence = certainty(evidence);
  if (status != ContourStatus::kOk || confidence >= kSure) return {status, reason, confidence};
  const bool unstable = evidence.first_instability > kMaxInstability;
  if (!unstable && evidence.shared > kMaxShared)
    return {ContourStatus::kWeak,
            "the object has the colours of its surroundings along " +
                std::to_string(to_int(std::nearbyint(100 * evidence.shared))) + " % of the outline",
            confidence};
  const std::array<double, 4> each = terms(evidence);
  const auto worst = std::size_t(std::min_element(each.begin(), each.end()) - each.begin());
  return {ContourStatus::kWeak, kReasons[unstable ? kFirstTerm : worst], confidence};
}

EvidenceGatherer::EvidenceGatherer(const RgbView& image, const unsigned char* mask, double first_instability)
    : mask_(image.width, image.height),
      first_(colors_inside(image, mask)),
      first_instability_(first_instability) {
  keep(mask);
}

void EvidenceGatherer::keep(const unsigned char* mask) {
  std::copy_n(mask, mask_.size(), mask_.values.begin());
}

Evidence EvidenceGatherer::gather(const RgbView& image, const unsigned char* mask, const FlowView* flow,
                                  double shared) {
  if (image.width != mask_.width || image.height != mask_.height || first_.empty())
    throw std::invalid_argument("image: expected one of the size at the start");
  const Mask expected = flow ? moved_mask(mask_, *flow) : mask_;
  keep(mask);
  int in_both = 0, in_either = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    in_both += expected.values[i] & mask[i], in_either += expected.values[i] | mask[i];
  Evidence out;
  out.disagreement = 1 - (in_either > 0 ? double(in_both) / in_either : 0);
  mean_ = kMemory * mean_ + (1 - kMemory) * out.disagreement;
  out.mean_disagreement = mean_;
  const std::vector<double> colors = colors_inside(image, mask);
  double affinity = 0;
  for (std::size_t i = 0; i < colors.size() && i < first_.size(); ++i)
    affinity += std::sqrt(colors[i] * first_[i]);
  out.strangeness = 1 - affinity;
  out.first_instability = first_instability_, out.shared = shared;
  return out;
}

std::vector<double> colors_inside(const RgbView& image, const unsigned char* mask) {
  std::vector<double> out(std::size_t{1} << (3 * kBits));
  int inside = 0;
  const std::ptrdiff_t pixels = std::ptrdiff_t(image.width) * image.height;
  for (std::ptrdiff_t i = 0; i < pixels; ++i) {
    if (!mask[i]) continue;
    std::size_t bin = 0;
    for (int channel = 0; channel < 3; ++channel)
      bin = (bin << kBits) + (image.rgb[3 * i + channel] >> (8 - kBits));
    ++out[bin], ++inside;
  }
  for (double& share : out) share /= std::max(1, inside);
  return out;
}

Mask moved_mask(const Mask& mask, const FlowView& flow) {
  const ImagePart& part = flow.part;
  const auto left = float(part.x0), above = float(part.y0);
  const float most_x = part.x1 - 1.0f, most_y = part.y1 - 1.0f;
  Mask out = mask;
  for (int y = part.y0; y < part.y1; ++y)
    for (int x = part.x0; x < part.x1; ++x) {
      const float* const back = flow.at(x, y);
      // NaN becomes the first pixel of the part: no read outside.
      const float u = std::min(std::max(left, float(x) + back[0]), most_x);
      const float v = std::min(std::max(above, float(y) + back[1]), most_y);
      const int ix = int(u), iy = int(v);
      const int right = ix + 1 < part.x1 ? 1 : 0, below = iy + 1 < part.y1 ? mask.width : 0;
      const unsigned char *a = mask.row(iy) + ix, *b = a + below;
      const int corners = a[0] + a[right] + b[0] + b[right];
      if (corners == 0 || corners == 4) {
        out.row(y)[x] = corners != 0;
        continue;
      }
      const float fx = u - float(ix), fy = v - float(iy);
      const float top = (1 - fx) * a[0] + fx * a[right], bottom = (1 - fx) * b[0] + fx * b[right];
      out.row(y)[x] = (1 - fy) * top + fy * bottom >= 0.5f;
    }
  return out;
}

}  // namespace sdftrack::contour
