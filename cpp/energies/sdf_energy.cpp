// SPDX-License-Identifier: MIT
#include "energies/sdf_energy.h"

#include <algorithm>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "base/robust.h"
#include "energies/add_sums.h"
#include "energies/cuda_work.h"
#include "energies/pose_fits.h"
#include "energies/reduce_cpu.h"
#include "energies/term_ops.h"

namespace sdftrack::energies {

namespace {

enum class Pair {
#define SDFTRACK_PAIR(name, field, penalty) name,
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
};

Pair pair_of_union(const SdfEnergyOptions& options, int objects) {
  constexpr Pair kPairs[kMaxJoined - 1][3] = {{Pair::kTwo, Pair::kTwoColorOdds, Pair::kTwoColorPrinted},
                                              {Pair::kThree, Pair::kThreeColorOdds, Pair::kThreeColorPrinted},
                                              {Pair::kFour, Pair::kFourColorOdds, Pair::kFourColorPrinted}};
  if (options.scale || options.intrinsics)
    throw std::invalid_argument(
        "unknowns: with several objects only their poses are supported; expected neither scale nor "
        "intrinsics");
  const int penalty = !options.color ? 0 : options.color_likelihood == ColorLikelihood::kOdds ? 1 : 2;
  return kPairs[objects - 2][penalty];
}

Pair pair_of(const SdfEnergyOptions& options, int objects) {
  if (objects > 1) return pair_of_union(options, objects);
  if (options.scale && options.intrinsics)
    throw std::invalid_argument(
        "unknowns: pose, scale and intrinsics together are not supported; expected at most two of them");
  if (options.color) {
    if (options.scale || options.intrinsics)
      throw std::invalid_argument(
          "unknowns: with colour only the pose is supported; expected neither scale nor intrinsics");
    return options.color_likelihood == ColorLikelihood::kOdds ? Pair::kPoseColorOdds
                                                              : Pair::kPoseColorPrinted;
  }
  return options.scale ? Pair::kPoseAndScale : (options.intrinsics ? Pair::kPoseAndIntrinsics : Pair::kPose);
}

void make(const SdfView* sdf, const optim::State& x, const SdfEnergyOptions&, SingleObject<float>* field) {
  *field = {*sdf, x.T_obj_cam[0].cast<float>()};
}
void make(const SdfView* sdf, const optim::State& x, const SdfEnergyOptions&, ScaledObject<float>* field) {
  *field = {*sdf, x.T_obj_cam[0].cast<float>(), float(std::exp(x.log_scale.at(0)))};
}
template <class Inner>
void make(const SdfView* sdf, const optim::State& x, const SdfEnergyOptions& options,
          WithIntrinsics<Inner>* field) {
  make(sdf, x, options, &field->field);
  field->K = x.K.cast<float>();
}
template <int K>
void make(const SdfView* sdfs, const optim::State& x, const SdfEnergyOptions& options,
          SoftMin<K, float>* field) {
  constexpr int kAll[kMaxJoined] = {0, 1, 2, 3};
  for (std::size_t k = 0; k < K; ++k) field->object[k] = {sdfs[k], x.T_obj_cam[k].cast<float>()};
  field->sharpness_per_m = sharpness_per_m(options, sdfs, kAll, K);
}

// Sums of the depth cost where the colour is the object's, and of the posteriors on the surface.
struct ColorSums {
  double cost = 0, weight = 0, foreground = 0;
  int on_surface = 0;

  // Adds a pixel. Returns whether its residual belongs to the object.
  bool add(const SdfEnergyOptions& o, float residual_m, const PixelsView<float>& pixels, int i) {
    if (!o.color) return true;
    const float share = std::min(1.0f, pixels.foreground[i] / o.color_prior), per_noise = pixels.per_noise[i];
    const DepthLogistic<float> depth{o.scale_m, o.outlier_floor};
    cost += double(share * depth(residual_m, per_noise).cost);
    weight += double(share);
    if (std::abs(residual_m) < 2 * o.scale_m / per_noise)
      foreground += double(pixels.foreground[i]), ++on_surface;
    return share > 0.5f;
  }
  void finish(EnergySummary* out) const {
    out->cost = weight > 0 ? cost / weight : 0;
    out->foreground = on_surface > 0 ? foreground / on_surface : -1;
  }
};

void start_hits(PixelSet* pixels) {
  for (std::size_t i = 0; i < pixels->depth_m.size(); ++i)
    pixels->hit_m[i] = pixels->depth_m[i] - float(kHitLead_m);
}

}  // namespace

SdfEnergy::SdfEnergy(const SdfView* sdfs, int objects, PixelSet* pixels, const SdfEnergyOptions& options)
    : objects_(objects), pixels_(pixels), options_(options) {
  if (objects < 1 || objects > kMaxJoined)
    throw std::invalid_argument("objects: expected 1 to " + std::to_string(kMaxJoined) + " in a union, got " +
                                std::to_string(objects));
  std::copy_n(sdfs, objects, sdfs_.begin());
}

template <class Loop>
struct CudaOpsOfTerm;
template <class Field, class Penalty>
struct CudaOpsOfTerm<Term<Field, Penalty>> {
  using type = CudaOps<Field, Penalty>;
};
template <class Loop>
using CudaOpsOf = typename CudaOpsOfTerm<std::decay_t<Loop>>::type;

template <class Visit>
void SdfEnergy::with_term(const optim::State& x, bool reclassify, const Visit& visit) {
  const auto run = [&]<class Field, class Penalty>(std::type_identity<std::pair<Field, Penalty>>) {
    Term<Field, Penalty> term{{},
                              {},
                              x.K.cast<float>(),
                              device_ ? device_pixels_ : pixels_->view(),
                              options_.residual,
                              reclassify,
                              options_.warm_hits ? 1 : 8};
    make((device_ ? device_sdfs_ : sdfs_).data(), x, options_, &term.field);
    make(options_, &term.penalty);
    visit(term, ops_for<Field, Penalty>(used_isa()));
  };
  switch (pair_of(options_, objects_)) {
#define SDFTRACK_PAIR(name, field, penalty)               \
  case Pair::name:                                        \
    run(std::type_identity<std::pair<field, penalty>>{}); \
    break;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
  }
}

void SdfEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  with_term(x, options_.warm_hits && std::exchange(undecided_, false),
            [&](const auto& term, const auto& ops) {
              using Sum = Sums<double, std::decay_t<decltype(term)>::P>;
              if (device_) return add_to(CudaOpsOf<decltype(term)>::linearize(device_, term), out);
              add_to(reduce_cpu<Sum>(term.pixels.count, options_.threads,
                                     [&](int begin, int end) { return ops.linearize(term, begin, end); }),
                     out);
            });
}

double SdfEnergy::cost(const optim::State& x) {
  double cost = 0;
  with_term(x, false, [&](const auto& term, const auto& ops) {
    cost = device_ ? CudaOpsOf<decltype(term)>::cost(device_, term)
                   : reduce_cpu<double>(term.pixels.count, options_.threads,
                                        [&](int begin, int end) { return ops.cost(term, begin, end); });
  });
  return cost;
}

const float* SdfEnergy::distances(const optim::State& x) {
  float* const phi = pixels_->gain.data();  // not in use until the rays are classified
  with_term(x, false,
            [&](const auto& term, const auto& ops) { ops.distances(term, 0, term.pixels.count, phi); });
  return phi;
}

int SdfEnergy::count_near(const optim::State& x, double reach_m) {
  const auto reach = float(reach_m);
  const float* const phi = distances(x);
  return int(std::count_if(phi, phi + pixels_->count(), [&](float d) { return std::abs(d) < reach; }));
}

void SdfEnergy::enter_device(CudaWork* device) {
  leave_device();
  device_pixels_ = device->upload(*pixels_);
  for (std::size_t k = 0; k < std::size_t(objects_); ++k) device_sdfs_[k] = device->volume(sdfs_[k]);
  device_ = device;
}

namespace {

template <class Field>
constexpr bool kOneObject =
    std::is_same_v<Field, SingleObject<float>> || std::is_same_v<Field, ScaledObject<float>>;

void take(const optim::LmStep* steps, const auto& search, optim::LmResult* out) {
  out->x.T_obj_cam[0] = search.at.T_obj_cam[0];
  if (!out->x.log_scale.empty()) out->x.log_scale[0] = search.at.log_scale;
  out->cost = search.cost, out->count = search.count, out->damping = search.damping;
  out->stop = search.stop, out->steps.assign(steps, steps + search.tried);
}

template <class Field, class Penalty>
void search_one(CudaWork* device, const Term<Field, Penalty>& term, int settle_steps,
                const optim::LmOptions& options, const Beside& beside, PixelSet* pixels,
                optim::LmResult* out) {
  using Fits = CudaPoseFits<Field, Penalty>;
  std::vector<typename Fits::Problem> problems{{term, nullptr, settle_steps, options, beside}};
  std::vector<typename Fits::Fit> fits(1);
  fits[0].search.at = {{out->x.T_obj_cam[0]}, out->x.log_scale.empty() ? 0.0 : out->x.log_scale[0]};
  std::vector<optim::LmStep> steps;
  Fits::run(device, &problems, &fits, &steps, 1, pixels);
  take(steps.data(), fits[0].search, out);
}

}  // namespace

void SdfEnergy::search(CudaWork* device, int settle_steps, const optim::LmOptions& options,
                       const Beside& beside, optim::LmResult* out) {
  if (!can_search() || !options.fixed.empty())
    throw std::logic_error("SdfEnergy: only the pose and size of one object are searched on a device");
  if (options_.residual != Residual::kRayHit) settle_steps = 0;
  enter_device(device);
  try {
    with_term(out->x, false, [&]<class Field, class Penalty>(const Term<Field, Penalty>& term, const auto&) {
      if constexpr (kOneObject<Field>) search_one(device, term, settle_steps, options, beside, pixels_, out);
    });
  } catch (...) {
    device_ = nullptr;
    throw;
  }
  device_ = nullptr;  // the host already has what leave_device() would bring
  undecided_ = false;
}

void SdfEnergy::leave_device() {
  if (CudaWork* const device = std::exchange(device_, nullptr)) device->download(pixels_);
}

void SdfEnergy::keep_near(const float* phi, double reach_m) {
  const auto reach = float(reach_m);
  const int n = pixels_->count();
  int kept = 0;
  while (kept < n && std::abs(phi[kept]) < reach) ++kept;  // often all: these pixels stay in place
  for (int i = kept + 1; i < n; ++i)
    if (std::abs(phi[i]) < reach) pixels_->copy(*pixels_, i, kept++);
  pixels_->resize(kept);
  pixels_->start_afresh();
}

void SdfEnergy::settle(const optim::State& x, int steps, CudaWork* device) {
  start_hits(pixels_);
  undecided_ = true;
  if (device) enter_device(device);
  with_term(x, false, [&](auto& term, const auto& ops) {
    term.newton_steps = 1;
    if (device_) return CudaOpsOf<decltype(term)>::settle(device_, term, steps);
    for (int step = 0; step < steps; ++step) ops.settle(term, 0, term.pixels.count);
  });
}

void SdfEnergy::follow_hits(const optim::State& x) {
  with_term(x, false, [&](const auto& term, const auto& ops) { ops.settle(term, 0, term.pixels.count); });
}

void SdfEnergy::classify(const optim::State& x, int steps) {
  start_hits(pixels_);
  undecided_ = false;
  if (options_.residual != Residual::kRayHit || !options_.warm_hits) steps = 1;  // else each step continues
  with_term(x, true, [&](const auto& term, const auto& ops) {
    for (int k = 0; k < steps; ++k) ops.classify(term, 0, term.pixels.count);
  });
}

EnergySummary SdfEnergy::summarize(const optim::State& x, int pixel_budget, SummaryScratch* scratch) {
  if (objects_ > 1) throw std::logic_error("SdfEnergy: a union is not summarised, its objects are");
  EnergySummary out;
  const int budget = whole_lanes(pixel_budget);
  scratch->residuals.resize(budget);
  scratch->places.resize(budget);
  scratch->noises.clear();
  with_term(x, false, [&](const auto& term, const auto& ops) {
    const bool ray_hit = term.residual == Residual::kRayHit;
    const auto sums = ops.summarize(term, budget, sdfs_[0].voxel_m, ray_hit, scratch->residuals.data(),
                                    scratch->places.data());
    ColorSums colors;
    for (std::size_t k = 0; k < std::size_t(sums.count); ++k) {
      const int i = scratch->places[k];
      const bool added = colors.add(options_, scratch->residuals[k], term.pixels, i);
      if (added && (term.pixels.gain[i] == 0.0f || !ray_hit))
        scratch->noises.push_back(std::abs(scratch->residuals[k]) * term.pixels.per_noise[i]);
    }
    if constexpr (std::decay_t<decltype(term)>::P <= kMaxUnknowns) out = summary_of(sums, term.pixels.count);
    colors.finish(&out);
  });
  out.noise_m = robust_sd(&scratch->noises);
  return out;
}

void SdfEnergy::read(const optim::State& x, PixelReadings* out) {
  const auto n = std::size_t(pixels_->count());
  out->residual_m.resize(n), out->weight.resize(n), out->hit.resize(n);
  CudaWork* const device = std::exchange(device_, nullptr);  // the host's copy is used
  with_term(x, false, [&](const auto& term, const auto&) {
    for (int i = 0; i < term.pixels.count; ++i) {
      FieldRow<float, std::decay_t<decltype(term)>::P> row;
      const auto reading = term.read(i, 1, &row);
      const auto j = std::size_t(i);
      out->residual_m[j] = reading.residual_m;
      out->weight[j] = term.curve(i, 1, reading.residual_m).curvature;
      out->hit[j] = term.pixels.gain[i] == 0.0f;
    }
  });
  device_ = device;
}

}  // namespace sdftrack::energies
