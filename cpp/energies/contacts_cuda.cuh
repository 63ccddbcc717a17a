// SPDX-License-Identifier: MIT
// The contact term on the GPU, summed by one block as CollisionEnergy does.
#pragma once

#include "energies/contact_term.h"
#include "energies/reduce_cuda.cuh"
#include "optim/pose_search.h"

namespace sdftrack::energies {

// The row of a point that lies in another object, over the unknowns of both.
struct ContactRow {
  double own[6], other[6];
  double weight, phi_m;
  int object, other_object;

  __device__ double at(int unknown) const {
    const int k = unknown / 6, i = unknown % 6;
    return k == object ? own[i] : (k == other_object ? other[i] : 0.0);
  }
};
constexpr int kContactTile = 128;  // points per pass

// An entry of the sums over P unknowns, in the order of kSummed.
struct SummedEntry {
  enum Kind { kCost, kGradient, kHessian } kind;
  int a, b;  // b <= a

  template <int P>
  __device__ static SummedEntry of(int entry) {
    if (entry == 0) return {kCost, 0, 0};
    if (entry <= P) return {kGradient, entry - 1, 0};
    int a = 0, rest = entry - 1 - P;
    while (rest > a) rest -= ++a;
    return {kHessian, a, rest};
  }
};

// Adds the contacts to `total`, in the order of kSummed. tile: kContactTile rows in the block's memory.
template <int P>
__device__ void add_contacts(const Contacts& given, const SdfView* sdfs, const Rigidd* T_obj_cam,
                             ContactRow* tile, double* total) {
  static_assert(std::is_trivially_copyable_v<Rigidd> && alignof(Rigidd) == alignof(double));
  SDFTRACK_SHARED(double[Contacts::kPairs * sizeof(Rigidd) / sizeof(double)], memory);
  auto* const T_other_object = reinterpret_cast<Rigidd*>(memory);
  SDFTRACK_SHARED(int, touching);
  const int thread = int(threadIdx.x);
  if (thread < given.pair_count)
    T_other_object[thread] =
        T_obj_cam[given.pairs[thread].other] * inverse(T_obj_cam[given.pairs[thread].object]);
  for (int first = 0; first < given.point_count; first += kContactTile) {
    if (thread == 0) touching = 0;
    __syncthreads();
    if (thread < kContactTile) {
      ContactRow& row = tile[thread];
      row.weight = 0;
      if (first + thread < given.point_count) {
        const ContactPoint point = given.points[first + thread];
        const Contact contact = nearest_contact(point, given.near_pairs, given.pairs, T_other_object,
                                                [&](int object) { return sdfs[object]; });
        if (contact.phi_m < 0) {
          row.object = given.pairs[contact.pair].object, row.other_object = given.pairs[contact.pair].other;
          row.weight = given.weight[row.object], row.phi_m = contact.phi_m;
          contact_rows(T_other_object[contact.pair], point.p_obj, contact.grad_other, row.own, row.other);
          atomicExch(&touching, 1);
        }
      }
    }
    __syncthreads();
    for (int k = thread; touching && k < kSummed<P>; k += kBlockThreads) {
      const SummedEntry entry = SummedEntry::of<P>(k);
      double sum = 0;
      for (int i = 0; i < kContactTile; ++i) {
        const ContactRow& row = tile[i];
        if (row.weight == 0) continue;
        if (entry.kind == SummedEntry::kCost)
          sum += 0.5 * row.weight * row.phi_m * row.phi_m;
        else if (entry.kind == SummedEntry::kGradient)
          sum += row.weight * row.phi_m * row.at(entry.a);
        else
          sum += row.weight * row.at(entry.a) * row.at(entry.b);
      }
      total[k] += sum;
    }
    __syncthreads();
  }
}

}  // namespace sdftrack::energies
