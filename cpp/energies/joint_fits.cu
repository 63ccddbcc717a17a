// SPDX-License-Identifier: MIT
#include "energies/contacts_cuda.cuh"
#include "energies/joint_fits.h"
#include "energies/search_parts.cuh"

namespace sdftrack::energies {

namespace {

constexpr int kMostBlocks = 24;  // per part

template <int K>
struct FieldOf {
  using type = SoftMin<K, float>;
};
template <>
struct FieldOf<1> {
  using type = SingleObject<float>;
};

struct PartOnDevice {
  int of[kMaxJoined];
  int objects, first_block, blocks;
  float sharpness_per_m;
  PixelsView<float> pixels;

  // Index of the first unknown of the group's object among the part's unknowns; -1: not in the part.
  __device__ int place_of(int object) const {
    for (int k = 0; k < objects; ++k)
      if (of[k] == object) return k;
    return -1;
  }
  // Index of the part's sum that belongs to this sum of the group; -1: there is none.
  template <int P>
  __device__ int entry_of(const SummedEntry& entry) const {
    const int mine = 6 * objects;
    if (entry.kind == SummedEntry::kCost) return 0;
    const int a = place_of(entry.a / 6);
    if (a < 0) return -1;
    if (entry.kind == SummedEntry::kGradient) return 1 + 6 * a + entry.a % 6;
    const int b = place_of(entry.b / 6);
    return b < 0 ? -1 : 1 + mine + optim::lower_at(6 * a + entry.a % 6, 6 * b + entry.b % 6);
  }
};

template <class Penalty>
struct JointProblem {
  int objects, parts, pixels, blocks, settle_steps;
  Residual residual;
  Penalty penalty;
  Intrinsics<float> K;
  SdfView sdf[kMaxJoined];
  PartOnDevice part[JointTask::kParts];
  optim::LmRules rules;
  Beside beside[kMaxJoined];
  Contacts contacts;
};

template <int P>
struct JointFit {
  optim::PoseSearch<P> search;
  optim::Quadratic<P> found;
  unsigned arrived = 0;
};

// One evaluation of the search and the next step. Each block has pixels of one part.
template <int K, class Penalty>
struct LookTogether {
  static constexpr const char* kName = "look together";
  static constexpr int kThreads = kBlockThreads;
  static constexpr int P = 6 * K, N = kSummed<P>;
  template <int J>
  using LoopOf = Term<typename FieldOf<J>::type, Penalty>;
  // The block's memory: the numbers that lanes share, and in the last block the sums and the contacts.
  using Held = typename SumsOfLanes<LoopOf<K>>::Held;
  static constexpr std::size_t kSums = N * sizeof(double), kTile = kContactTile * sizeof(ContactRow);
  static constexpr std::size_t kRoom = sizeof(Held) > kSums + kTile ? sizeof(Held) : kSums + kTile;

  JointProblem<Penalty>* problem;  // with the state that its terms keep between evaluations
  JointFit<P>* fit;
  double* partial;
  bool begins;

  __device__ void operator()() const {
    SDFTRACK_SHARED(double[kRoom / sizeof(double)], room);
    if (!begins && !fit->search.searching) return;
    sum_part(part_of(int(blockIdx.x)), room);
    if (!is_last_block(&fit->arrived, problem->blocks)) return;
    add_parts(room);
    __syncthreads();
    const Rigidd* const T_obj_cam = point().T_obj_cam;
    for (int m = 0; m < K; ++m)
      add_beside(&problem->beside[m], T_obj_cam[m], begins, {room, room + 1, room + 1 + P, 6 * m});
    __syncthreads();
    add_contacts<P>(problem->contacts, problem->sdf, T_obj_cam, reinterpret_cast<ContactRow*>(room + N),
                    room);
    __syncthreads();
    decide(room);
  }

 private:
  __device__ const optim::PosePoint<P>& point() const { return begins ? fit->search.at : fit->search.to; }
  __device__ const PartOnDevice& part_of(int block) const {
    int k = 0;
    while (k + 1 < problem->parts && problem->part[k + 1].first_block <= block) ++k;
    return problem->part[k];
  }

  __device__ void sum_part(const PartOnDevice& part, double* room) const {
    if (part.objects == 1) return sum<1>(part, room);
    if (part.objects == 2) return sum<2>(part, room);
    if constexpr (K > 2)
      if (part.objects == 3) return sum<3>(part, room);
    if constexpr (K > 3) return sum<4>(part, room);
  }

  __device__ void put(const PartOnDevice& part, SingleObject<float>* field) const {
    *field = {problem->sdf[part.of[0]], point().T_obj_cam[part.of[0]].template cast<float>()};
  }
  template <int J>
  __device__ void put(const PartOnDevice& part, SoftMin<J, float>* field) const {
    for (int k = 0; k < J; ++k)
      field->object[k] = {problem->sdf[part.of[k]], point().T_obj_cam[part.of[k]].template cast<float>()};
    field->sharpness_per_m = part.sharpness_per_m;
  }

  template <int J>
  __device__ void sum(const PartOnDevice& part, double* room) const {
    using Loop = LoopOf<J>;
    Loop term{{}, problem->penalty, problem->K, part.pixels, problem->residual, begins, 1};
    put(part, &term.field);
    const int first = (int(blockIdx.x) - part.first_block) * kBlockThreads;
    const int stride = part.blocks * kBlockThreads, count = part.pixels.count;
    const int settle_steps = begins ? problem->settle_steps : 0;
    for (int i = first + int(threadIdx.x); settle_steps > 0 && i < count; i += stride) {
      term.pixels.hit_m[i] = term.pixels.depth_m[i] - float(kHitLead_m);
      for (int step = 0; step < settle_steps; ++step) term.settle(i, 1);
    }
    double* const sums_of_block = of_this_block<N>(partial);
    if constexpr ((kSummed < 6 * J >> kMostInRegisters)) {
      using Sums = SumsOfLanes<Loop>;
      auto& held = *reinterpret_cast<typename Sums::Held*>(room);
      Sums::add(term, first, stride, held, *reinterpret_cast<typename Sums::OfWarp*>(room), sums_of_block);
    } else {
      float sums[kSummed<6 * J>] = {};
      for (int i = first + int(threadIdx.x); i < count; i += stride)
        add_contribution(term.linearize(i), sums);
      add_over_block(sums, sums_of_block);
    }
  }

  // Adds the sums of all blocks in their order. `volatile` avoids a multiprocessor's cache, which the sums of
  // other multiprocessors do not reach.
  __device__ void add_parts(double* total) const {
    const volatile double* const of_blocks = partial;
    for (int k = int(threadIdx.x); k < N; k += kBlockThreads) {
      const SummedEntry entry = SummedEntry::of<P>(k);
      double sum = 0;
      for (int p = 0; p < problem->parts; ++p) {
        const PartOnDevice& part = problem->part[p];
        const int at = part.entry_of<P>(entry);
        for (int b = part.first_block; at >= 0 && b < part.first_block + part.blocks; ++b)
          sum += of_blocks[std::size_t(b) * N + at];
      }
      total[k] = sum;
    }
  }

  __device__ void decide(const double* total) const {
    optim::Quadratic<P>& found = fit->found;
    for (int k = int(threadIdx.x); k < N; k += kBlockThreads)
      *(k == 0 ? &found.cost : (k <= P ? &found.gradient[k - 1] : &found.hessian[k - 1 - P])) = total[k];
    __syncthreads();
    if (threadIdx.x != 0) return;
    found.count = problem->pixels;
    for (int m = 0; m < K; ++m) found.count += problem->beside[m].lines.count;
    fit->arrived = 0;
    fit->search.looked(found, problem->rules, begins);
  }
};

// A search on the device: [fit | steps | problem | its Beside, contacts].
template <int K, class Penalty>
class JointSearch {
 public:
  using Fit = JointFit<6 * K>;
  using Problem = JointProblem<Penalty>;

  JointSearch(CudaWork* work, const JointTask& task) : w_(work->impl()), task_(task) {
    room_ = std::size_t(task.rules.max_steps);
    fit_at_ = places_.add<Fit>(1);
    steps_at_ = places_.add<optim::LmStep>(room_);
    results_end_ = places_.end();
    problem_at_ = places_.add<Problem>(1);
    for (int m = 0; m < K; ++m) beside_.emplace_back(&places_, task.beside[m]);
    points_.emplace_back(&places_, task.contacts.points, std::size_t(task.contacts.point_count));
    near_.emplace_back(&places_, task.contacts.near_pairs, std::size_t(task.contacts.near_count));
    make_problem(work);
  }

  void upload() {
    w_.take_turn(CudaWork::Impl::kProblems);
    if (w_.problems.size() < places_.end()) w_.problems.room(2 * places_.end());
    if (w_.problems_here.size() < places_.end()) w_.problems_here.room(2 * places_.end());
    std::byte *const here = w_.problems_here.data(), *const there = w_.problems.data();
    Fit fit;
    std::copy_n(task_.T_obj_cam, K, fit.search.at.T_obj_cam);
    fit.search.kept = reinterpret_cast<optim::LmStep*>(there + steps_at_);
    put(&fit, 1, here + fit_at_);
    for (std::size_t m = 0; m < K; ++m) beside_[m].put_to(here, there, &problem_.beside[m]);
    problem_.contacts.points = points_[0].put_to(here, there);
    problem_.contacts.near_pairs = near_[0].put_to(here, there);
    put(&problem_, 1, here + problem_at_);
    w_.stream.upload(here, places_.end(), there);
  }

  void launch_all() {
    const std::size_t sums = std::size_t(problem_.blocks) * kSummed<6 * K>;
    if (w_.search_partial.size() < sums) w_.search_partial.room(sums);
    std::byte* const there = w_.problems.data();
    LookTogether<K, Penalty> kernel{reinterpret_cast<Problem*>(there + problem_at_),
                                    reinterpret_cast<Fit*>(there + fit_at_), w_.search_partial.data(), true};
    for (std::size_t k = 0; k <= room_; ++k, kernel.begins = false)
      launch(w_.stream, static_cast<unsigned>(problem_.blocks), kernel);
    w_.stream.download(there, results_end_, w_.problems_here.data());
  }

  void take_results(JointFound* found) const {
    const std::byte* const here = w_.problems_here.data();
    Fit fit;
    std::memcpy(static_cast<void*>(&fit), here + fit_at_, sizeof(Fit));
    const auto& search = fit.search;
    std::copy_n(search.at.T_obj_cam, K, found->T_obj_cam);
    found->cost = search.cost, found->count = search.count, found->damping = search.damping;
    found->stop = search.stop;
    found->steps.resize(search.tried);
    if (search.tried > 0)
      std::memcpy(static_cast<void*>(found->steps.data()), here + steps_at_,
                  found->steps.size() * sizeof(optim::LmStep));
  }

 private:
  void make_problem(CudaWork* work) {
    Problem& p = problem_;
    p.objects = K, p.parts = task_.parts, p.settle_steps = task_.settle_steps;
    p.residual = task_.options.residual, p.K = task_.K.template cast<float>(), p.rules = task_.rules;
    p.contacts = task_.contacts;
    make(task_.options, &p.penalty);
    const PixelsView<float> all = work->upload(*task_.pixels);
    for (int m = 0; m < K; ++m) {
      p.sdf[m] = work->volume(task_.sdf[m]);
      p.beside[m] = task_.beside[m];
      bring_volumes(work, &p.beside[m]);
    }
    p.pixels = 0, p.blocks = 0;
    for (int k = 0; k < task_.parts; ++k) {
      const JointPart& given = task_.part[k];
      PartOnDevice& part = p.part[k];
      std::copy_n(given.of, kMaxJoined, part.of);
      part.objects = given.objects;
      part.sharpness_per_m = sharpness_per_m(task_.options, task_.sdf, given.of, given.objects);
      part.pixels = part_of(all, p.pixels, given.pixels);
      part.first_block = p.blocks;
      part.blocks = int(blocks_of(given.pixels, kBlockThreads, kMostBlocks));
      p.pixels += given.pixels, p.blocks += part.blocks;
    }
  }

  static PixelsView<float> part_of(const PixelsView<float>& all, int first, int count) {
    return {count,
            all.u_px + first,
            all.v_px + first,
            all.depth_m + first,
            all.per_noise + first,
            all.hit_m + first,
            all.gain + first,
            all.foreground + first};
  }

  CudaWork::Impl& w_;
  const JointTask& task_;
  Problem problem_{};
  Places places_;
  std::size_t room_, fit_at_, steps_at_, results_end_, problem_at_;
  std::vector<SentBeside> beside_;
  std::vector<SentPart<ContactPoint>> points_;
  std::vector<SentPart<int>> near_;
};

template <int K, class Penalty>
void run(CudaWork* work, const JointTask& task, JointFound* found) {
  CudaWork::Impl& w = work->impl();
  const DeviceScope scope(w.device);
  JointSearch<K, Penalty> search(work, task);
  search.upload();
  search.launch_all();
  w.wait();
  search.take_results(found);
}

template <class Penalty>
void run(CudaWork* work, const JointTask& task, JointFound* found) {
  if (task.objects == 2) return run<2, Penalty>(work, task, found);
  if (task.objects == 3) return run<3, Penalty>(work, task, found);
  if (task.objects == 4) return run<4, Penalty>(work, task, found);
  throw std::logic_error("fit_together: expected two to four objects");
}

}  // namespace

void fit_together(CudaWork* work, const JointTask& task, JointFound* found) {
  if (!task.options.color) return run<DepthLogistic<float>>(work, task, found);
  if (task.options.color_likelihood == ColorLikelihood::kOdds)
    return run<ColorOdds<float>>(work, task, found);
  return run<ColorPrinted<float>>(work, task, found);
}

}  // namespace sdftrack::energies
