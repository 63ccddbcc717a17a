// SPDX-License-Identifier: MIT
#include "contour/memory/silhouette_library.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "contour/memory/mask_ops.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr float kReach_px = 4;              // distances are clamped here: farther away only the sign matters
constexpr float kStepsPerPx = 16;           // distances are stored as whole numbers of steps, one byte each
constexpr int kSquare = 2;                  // pixels per sample of the small pictures that are compared
constexpr std::size_t kCompared = 32;       // compared by small pictures, after preselection by the harmonics
constexpr double kSoftness_px = 2;          // silhouettes are averaged if their excess differs by about
constexpr double kSoftness = 0.1;           // this, in pixels and as a share
constexpr float kMinRelativeWeight = 0.1f;  // of the best: less likely ones are left out of the average
constexpr double kSmoothing = 4;            // px of blur per px of excess: a new pose is uncertain
constexpr double kMinBlur_px = 0.5;         // a smaller blur has no effect
constexpr float kExplained_px = 2;          // a contour pixel nearer to the expected contour is explained
constexpr int kOccludersEdge_px = 2;        // next to a hidden part: there the outline is the occluder's
constexpr float kDeep_px = 1.5f;            // a deeper pixel is inside in every likely pose
constexpr double kWellKnown_px = 0.4;       // excess per contour pixel, up to which slivers are thin
constexpr float kUnknown = std::numeric_limits<float>::infinity();

// Number of pixels inside each square; a last odd row or column is left out.
std::vector<std::int16_t> small_picture(const Mask& mask) {
  const int side = mask.width / kSquare;
  std::vector<std::int16_t> out;
  out.reserve(side * side);
  for (int y = 0; y < side; ++y) {
    const unsigned char *above = mask.row(kSquare * y), *below = mask.row(kSquare * y + 1);
    for (int x = 0; x < 2 * side; x += 2)
      out.push_back(static_cast<std::int16_t>(above[x] + above[x + 1] + below[x] + below[x + 1]));
  }
  return out;
}

double share(int part, int whole) { return double(part) / std::max(1, whole); }

}  // namespace

Completion with_hidden(const Mask& seen, const Mask& expected, double off_px) {
  Mask hidden = thick_parts(without(expected, seen), off_px < kWellKnown_px ? 1 : 2);
  return {union_of(seen, hidden), std::move(hidden)};
}

Completion with_hidden(const Mask& seen, const Mask& expected) {
  return with_hidden(seen, expected, share(area_of(without(seen, expected)), area_of(edge_of(seen))));
}

double Explanation::doubt() const {
  const double known_px = area_of(hidden) * explained * explained;
  return known_px > 0 ? beyond_px / known_px : std::numeric_limits<double>::infinity();
}

SilhouetteLibrary::SilhouetteLibrary(const Options& options)
    : options_(options), series_(options.n_harmonics, options.order, options.size) {}

Mask SilhouetteLibrary::mask(int place) const {
  Mask out(options_.size, options_.size);
  std::transform(at(place).phi.begin(), at(place).phi.end(), out.values.begin(),
                 [](signed char steps) { return steps < 0; });
  return out;
}

SilhouetteLibrary::Shape SilhouetteLibrary::shape_of(const Mask& mask) const {
  Shape out;
  for (const double c : series_.coefficients(mask)) out.code.push_back(float(c));
  out.small = small_picture(mask);
  out.area = float(area_of(mask));
  Picture phi = signed_distances(mask, kReach_px);
  for (const float distance : phi.values)
    out.phi.push_back(static_cast<signed char>(std::nearbyint(kStepsPerPx * distance)));
  for (std::size_t k = 0; k < out.templates.size(); ++k)
    out.templates[k] = template_of(phi, stored_stages()[k]);
  return out;
}

// Number of pixels by which each stored silhouette differs from a mask, over the mask's area.
std::vector<float> SilhouetteLibrary::differences(const Mask& mask) const {
  const double area = area_of(mask);
  std::vector<float> out;
  for (const Shape& shape : shapes_) {
    int differ = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) differ += (shape.phi[i] < 0) != mask.values[i];
    out.push_back(float(differ / area));
  }
  return out;
}

void SilhouetteLibrary::add(const Mask& mask) {
  if (area_of(mask) == 0) return;  // no comparison is possible
  std::vector<float> unlike = differences(mask);
  ++clock_;
  const auto nearest = std::min_element(unlike.begin(), unlike.end());
  if (nearest != unlike.end() && *nearest < float(options_.spacing)) {
    shapes_[nearest - unlike.begin()].age = clock_;  // still in use
    return;
  }
  std::size_t place = shapes_.size();
  if (place < std::size_t(options_.capacity)) {
    for (Shape& shape : shapes_) shape.unlike.push_back(kUnknown);
    shapes_.emplace_back();
    unlike.push_back(kUnknown);
  } else {
    place = place_to_reuse();
  }
  Shape& shape = shapes_[place];
  shape = shape_of(mask);
  shape.age = clock_;
  unlike[place] = kUnknown;
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (k != place) shapes_[k].unlike[place] = unlike[k];
  shape.unlike = std::move(unlike);
}

// The older of the two most similar silhouettes.
std::size_t SilhouetteLibrary::place_to_reuse() const {
  std::size_t a = 0, b = 0;
  float least = kUnknown;
  for (std::size_t i = 0; i < shapes_.size(); ++i)
    for (std::size_t j = i + 1; j < shapes_.size(); ++j)
      if (shapes_[i].unlike[j] < least) least = shapes_[i].unlike[j], a = i, b = j;
  return shapes_[b].age < shapes_[a].age ? b : a;
}

Explanation SilhouetteLibrary::explain(const Mask& mask) const {
  Expected expected;
  std::vector<float> beyond_px;
  const std::vector<int> near = nearest(mask, &beyond_px);
  expected.beyond_px = double(*std::min_element(beyond_px.begin(), beyond_px.end()));
  const auto softness = float(kSoftness_px + kSoftness * expected.beyond_px);
  float sum = 0;
  for (std::size_t k = 0; k < near.size(); ++k) {
    const float weight = std::exp((float(expected.beyond_px) - beyond_px[k]) / softness);
    if (weight < kMinRelativeWeight) continue;
    expected.weights.push_back(weight), expected.finalists.push_back(near[k]);
    sum += weight;
  }
  for (float& weight : expected.weights) weight /= sum;
  expected.phi = average(expected.weights, expected.finalists);
  return explain_by(mask, expected);
}

Explanation SilhouetteLibrary::explain_by(const Mask& mask, const Expected& expected, bool own_edge) const {
  const Mask edge = edge_of(mask);
  const double off_px = expected.beyond_px / area_of(edge);
  const double blur_px = kSmoothing * off_px;
  const Picture phi =
      blur_px < kMinBlur_px ? expected.phi : blurred(expected.phi, blur_px, Border::kRepeated);
  const Mask whole = inside_of(phi);
  Completion found = with_hidden(mask, whole, off_px);
  const int lacking = area_of(thick_parts(without(whole, mask), 1));
  const Mask deep = each<unsigned char>(phi, [](float distance) { return distance < -kDeep_px; });
  const Mask near = each<unsigned char>(
      edge, phi, [](unsigned char on, float distance) { return on && std::abs(distance) < kExplained_px; });
  const Mask theirs = own_edge ? grown(found.hidden, kOccludersEdge_px) : Mask(mask.width, mask.height);
  Explanation out;
  out.missing = share(lacking, lacking + area_of(mask));
  out.riddled = share(area_of(without(deep, found.completed)), area_of(deep));
  out.beyond_px = expected.beyond_px, out.off_px = off_px;
  out.explained = share(area_of(without(near, theirs)), area_of(without(edge, theirs)));
  out.outline = share(area_of(near), area_of(edge_of(whole)));
  out.completed = std::move(found.completed), out.hidden = std::move(found.hidden);
  out.weights = expected.weights, out.finalists = expected.finalists;
  return out;
}

Picture SilhouetteLibrary::average(const std::vector<float>& weights, const std::vector<int>& places) const {
  Picture out(options_.size, options_.size);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (weights[k] == 0) continue;
    const float weight = weights[k] / kStepsPerPx;
    const std::vector<signed char>& phi = at(places[k]).phi;
    for (std::size_t i = 0; i < out.size(); ++i) out.values[i] += weight * float(phi[i]);
  }
  return out;
}

std::vector<float> SilhouetteLibrary::dissimilarity(const Mask& mask) const {
  const std::vector<std::int16_t> small = small_picture(mask);
  const auto inside = float(std::accumulate(small.begin(), small.end(), 0));
  std::vector<float> out;
  for (const Shape& shape : shapes_) {
    int products = 0;
    for (std::size_t i = 0; i < small.size(); ++i) products += shape.small[i] * small[i];
    const float common = float(products) / (kSquare * kSquare);
    out.push_back((shape.area + inside - 2 * common) / std::max(1.0f, inside));
  }
  return out;
}

// The silhouettes that the observed one exceeds least, and the excess of each in pixels. With f = +1 inside
// and -1 outside, the product of two pictures over all pixels is that of their series, and 4 |a and b| = f_a
// . f_b + 2 |a| + 2 |b| - size^2: the harmonics preselect, the small pictures decide.
std::vector<int> SilhouetteLibrary::nearest(const Mask& mask, std::vector<float>* beyond_px) const {
  std::vector<int> near(shapes_.size());
  std::iota(near.begin(), near.end(), 0);
  if (near.size() > kCompared) {
    const std::vector<double> code = series_.coefficients(mask);
    std::vector<float> in_common;
    for (const Shape& shape : shapes_) {
      double sum = 2 * double(shape.area);
      for (std::size_t i = 0; i < code.size(); ++i) sum += code[i] * double(shape.code[i]);
      in_common.push_back(float(sum));
    }
    const auto more = [&](int a, int b) {
      const float x = in_common[a], y = in_common[b];
      return x > y || (x == y && a < b);
    };
    std::partial_sort(near.begin(), near.begin() + kCompared, near.end(), more);
    near.resize(kCompared);
  }
  const std::vector<std::int16_t> small = small_picture(mask);
  for (const int k : near) {
    int excess = 0;
    for (std::size_t i = 0; i < small.size(); ++i) excess += std::max(0, small[i] - at(k).small[i]);
    beyond_px->push_back(float(excess));
  }
  return near;
}

SilhouetteLibrary::State SilhouetteLibrary::state() const {
  State out;
  for (int k = 0; k < count(); ++k) {
    out.masks.push_back(mask(k));
    out.ages.push_back(at(k).age);
    out.unlike.insert(out.unlike.end(), at(k).unlike.begin(), at(k).unlike.end());
  }
  out.clock = clock_;
  return out;
}

void SilhouetteLibrary::restore(const State& state) {
  if (state.masks.size() > std::size_t(options_.capacity))
    throw std::invalid_argument("kept: expected no more silhouettes than the capacity, " +
                                std::to_string(options_.capacity) + ", got " +
                                std::to_string(state.masks.size()));
  std::vector<Shape> shapes;
  const std::size_t n = state.masks.size();
  for (std::size_t k = 0; k < n; ++k) {
    Shape& shape = shapes.emplace_back(shape_of(state.masks[k]));
    const auto row = state.unlike.begin() + std::ptrdiff_t(k * n);
    shape.unlike.assign(row, row + n);
    shape.age = state.ages[k];
  }
  shapes_ = std::move(shapes), clock_ = state.clock;
}

}  // namespace sdftrack::contour
