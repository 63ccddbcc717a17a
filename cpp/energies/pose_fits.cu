// SPDX-License-Identifier: MIT
#include "energies/pose_fits.h"
#include "energies/search_parts.cuh"

namespace sdftrack::energies {

namespace {

constexpr int kMostBlocks = 64;  // per object
constexpr int kAllBlocks = 264;  // of all objects, about: two per multiprocessor of a large GPU

template <int P>
constexpr int kLookSums = kSummed<P> + 1;  // the last: rays that meet the model

__device__ void put_at(const optim::PosePoint<6>& at, SingleObject<float>* field) {
  field->T_obj_cam = at.T_obj_cam[0].cast<float>();
}
__device__ void put_at(const optim::PosePoint<7>& at, ScaledObject<float>* field) {
  field->T_obj_cam = at.T_obj_cam[0].cast<float>();
  field->scale = float(std::exp(at.log_scale));
}

// One evaluation of every search and its next step, or several in turn if an object has one block.
template <class Field, class Penalty>
struct LookAndGoOn {
  using Problem = PoseProblem<Field, Penalty>;
  using Loop = Term<Field, Penalty>;
  static constexpr const char* kName = "look and go on";
  static constexpr int kThreads = kBlockThreads;
  static constexpr int P = Field::P, N = kLookSums<P>;

  Problem* problems;  // each with the state that its terms keep between evaluations
  PoseFit<P>* fits;
  double* partial;
  int blocks, looks;  // per object; in turn
  bool begins;

  __device__ void operator()() const {
    const int problem = int(blockIdx.x) / blocks;
    for (int k = 0; k < looks; ++k) {
      if (!(begins && k == 0) && !fits[problem].search.searching) return;
      look(problem, begins && k == 0);
      __syncthreads();
    }
  }

 private:
  __device__ void look(int problem, bool first) const {
    Problem& given = problems[problem];
    PoseFit<P>& fit = fits[problem];
    const int share = int(blockIdx.x) % blocks;
    double* const of_problem = partial + std::size_t(problem) * blocks * N;
    sum_pixels(given, fit, share, first, of_problem + std::size_t(share) * N);
    if (!is_last_block(&fit.arrived, blocks)) return;
    SDFTRACK_SHARED(double[N], total);
    add_blocks(of_problem, blocks, N, total);
    __syncthreads();
    add_beside(&given.beside, point_of(fit, first).T_obj_cam[0], first, {total, total + 1, total + 1 + P, 0});
    if (threadIdx.x == 0) decide(given, first, total, &fit);
  }

  // The point to evaluate. A search that starts again does so at the end of the last one.
  __device__ static const optim::PosePoint<P>& point_of(const PoseFit<P>& fit, bool first) {
    return first ? fit.search.at : fit.search.to;
  }
  __device__ static int count_of(const Problem& given) {
    return given.pixel_count ? *given.pixel_count : given.term.pixels.count;
  }

  __device__ void sum_pixels(const Problem& given, const PoseFit<P>& fit, int share, bool first,
                             double* sums_of_block) const {
    Loop term = given.term;
    const int count = count_of(given), settle_steps = first ? given.settle_steps : 0;
    put_at(point_of(fit, first), &term.field);
    term.reclassify = first;
    float sums[N] = {};
    for (int i = share * kBlockThreads + int(threadIdx.x); i < count; i += blocks * kBlockThreads) {
      if (settle_steps > 0) term.pixels.hit_m[i] = term.pixels.depth_m[i] - float(kHitLead_m);
      for (int step = 0; step < settle_steps; ++step) term.settle(i, 1);
      add_contribution(term.linearize(i), sums);
      sums[N - 1] += term.pixels.gain[i] == 0.0f ? 1.0f : 0.0f;
    }
    add_over_block(sums, sums_of_block);
  }

  __device__ static void decide(const Problem& given, bool first, const double* total, PoseFit<P>* fit) {
    optim::Quadratic<P> found;
    found.cost = total[0], found.count = count_of(given) + given.beside.lines.count;
    for (int a = 0; a < P; ++a) found.gradient[a] = total[1 + a];
    for (int k = 0; k < P * (P + 1) / 2; ++k) found.hessian[k] = total[1 + P + k];
    if (first) fit->hits = int(total[N - 1]), fit->pixels = count_of(given);
    fit->arrived = 0;
    fit->search.looked(found, given.rules, first);
  }
};

// Searches on the device: [fits | steps | problems | their Besides].
template <class Field, class Penalty>
class Batch {
 public:
  using Problem = PoseProblem<Field, Penalty>;
  using Fit = PoseFit<Field::P>;

  Batch(CudaWork::Impl* work, std::vector<Problem>* problems, std::vector<Fit>* fits)
      : w_(*work), problems_(*problems), fits_(*fits), n_(problems->size()) {
    for (const Problem& p : problems_) {
      room_ = std::max(room_, p.rules.max_steps);
      most_pixels_ = std::max(most_pixels_, p.term.pixels.count);
    }
    fits_at_ = places_.add<Fit>(n_);
    steps_at_ = places_.add<optim::LmStep>(n_ * std::size_t(room_));
    results_end_ = places_.end();
    problems_at_ = places_.add<Problem>(n_);
    for (const Problem& p : problems_) beside_.emplace_back(&places_, p.beside);
  }

  int room() const { return room_; }

  void upload() {
    w_.take_turn(CudaWork::Impl::kProblems);
    if (w_.problems.size() < places_.end()) w_.problems.room(2 * places_.end());
    if (w_.problems_here.size() < places_.end()) w_.problems_here.room(2 * places_.end());
    std::byte* const here = w_.problems_here.data();
    for (std::size_t k = 0; k < n_; ++k) {
      Fit fit = fits_[k];
      fit.arrived = 0;
      fit.search.kept = there<optim::LmStep>(steps_at_) + k * std::size_t(room_);
      put(&fit, 1, here + fits_at_ + k * sizeof(Fit));
      Problem problem = problems_[k];
      beside_[k].put_to(here, w_.problems.data(), &problem.beside);
      put(&problem, 1, here + problems_at_ + k * sizeof(Problem));
    }
    w_.stream.upload(here, places_.end(), w_.problems.data());
  }

  void launch_all(int rounds) {
    const int all = int(n_), requested = int(blocks_of(most_pixels_, kBlockThreads));
    const int blocks = std::clamp(kAllBlocks / all, 1, std::min(requested, kMostBlocks));
    const std::size_t sums = n_ * std::size_t(blocks) * kLookSums<Field::P>;
    if (w_.search_partial.size() < sums) w_.search_partial.room(sums);
    LookAndGoOn<Field, Penalty> kernel{there<Problem>(problems_at_), there<Fit>(fits_at_),
                                       w_.search_partial.data(),     blocks,
                                       blocks == 1 ? room_ + 1 : 1,  true};
    for (int round = 0; round < rounds; ++round)
      for (int k = 0; k <= room_; k += kernel.looks) {
        kernel.begins = k == 0;
        launch(w_.stream, static_cast<unsigned>(all * blocks), kernel);
      }
  }

  void queue_results() { w_.stream.download(w_.problems.data(), results_end_, w_.problems_here.data()); }

  void take_results(std::vector<optim::LmStep>* steps) {
    const std::byte* const here = w_.problems_here.data();
    std::memcpy(static_cast<void*>(fits_.data()), here + fits_at_, n_ * sizeof(Fit));
    for (Fit& fit : fits_) fit.search.kept = nullptr;
    steps->resize(n_ * std::size_t(room_));
    if (!steps->empty())
      std::memcpy(static_cast<void*>(steps->data()), here + steps_at_, steps->size() * sizeof(optim::LmStep));
  }

 private:
  template <class T>
  T* there(std::size_t at) {
    return reinterpret_cast<T*>(w_.problems.data() + at);
  }

  CudaWork::Impl& w_;
  std::vector<Problem>& problems_;
  std::vector<Fit>& fits_;
  std::size_t n_;
  int room_ = 0, most_pixels_ = 0;
  Places places_;
  std::size_t fits_at_ = 0, steps_at_ = 0, results_end_ = 0, problems_at_ = 0;
  std::vector<SentBeside> beside_;
};

}  // namespace

template <class Field, class Penalty>
int CudaPoseFits<Field, Penalty>::run(CudaWork* work, std::vector<Problem>* problems, std::vector<Fit>* fits,
                                      std::vector<optim::LmStep>* steps, int rounds, PixelSet* back) {
  if (problems->empty()) return 0;
  CudaWork::Impl& w = work->impl();
  const DeviceScope scope(w.device);
  if (back) work->check_uploaded(*back);
  for (Problem& problem : *problems) bring_volumes(work, &problem.beside);
  Batch<Field, Penalty> batch(&w, problems, fits);
  batch.upload();
  batch.launch_all(rounds);
  batch.queue_results();
  if (back) w.queue_hits();
  w.wait();
  batch.take_results(steps);
  if (back) w.take_hits(back);
  return batch.room();
}

template struct CudaPoseFits<SingleObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<ScaledObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorOdds<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorPrinted<float>>;

}  // namespace sdftrack::energies
