// SPDX-License-Identifier: MIT
// The kernel of updates on the GPU: a block for each output takes the samples in order, its threads share the
// fields. The formulas are the CPU's code, compiled without fused multiply-add for bitwise equal results.
#pragma once

#define SDFTRACK_NO_PACKS  // of the CPU's headers

#include "base/launch.cuh"
#include "lwpr/exponential.h"
#include "lwpr/field_life.h"
#include "lwpr/field_terms.h"
#include "lwpr/receptive_field.h"
#include "lwpr/unit.h"

namespace sdftrack::lwpr {
namespace {

// The progress of an output.
struct Progress {
  long long next;  // sample
  int fields;
  int wants;  // 1: a field needs a projection for which there is no room
};

// The two fields with the largest activation for a sample; of equals the older one comes first. The result
// does not depend on the order in which they are added.
struct TwoFields {
  double w[2] = {-1, -1};
  int field[2] = {-1, -1};

  __device__ void add(double activation, int k) {
    if (k < 0) return;
    if (before(activation, k, 0)) {
      w[1] = w[0], field[1] = field[0];
      w[0] = activation, field[0] = k;
    } else if (before(activation, k, 1)) {
      w[1] = activation, field[1] = k;
    }
  }

 private:
  __device__ bool before(double activation, int k, int place) const {
    return activation > w[place] || (activation == w[place] && k < field[place]);
  }
};

// Room for this number of fields and projections in each output.
struct UnitRoom {
  int fields = 0, projections = 0;
};

template <int N>
struct LearnSamples {
  static constexpr const char* kName = "LWPR update";
  static constexpr int kThreads = 128;
  FieldLayout at;
  UnitSettings settings;
  UnitRoom room;
  Progress* progress;
  double *blocks, *records, *scratch;  // scratch: for each thread
  const double *first_M, *x, *y;       // x: rows; y: of one output after the other
  long long count;
  unsigned first_output;

  __device__ void operator()() const {
    SDFTRACK_SHARED(int, found);
    SDFTRACK_SHARED(int, full);
    SDFTRACK_SHARED(TwoFields[kThreads], most);
    const int thread = int(threadIdx.x);
    const unsigned output = first_output + blockIdx.x;
    const double* const values = y + output * count;
    int fields = progress[output].fields;
    long long i = progress[output].next;
    if (thread == 0) full = 0;
    __syncthreads();
    for (int k = thread; k < fields; k += kThreads) more_projections(output, k, &full);
    for (; i < count; ++i) {
      __syncthreads();
      if (full || fields == room.fields) break;
      if (thread == 0) found = 0;
      __syncthreads();
      const double* const sample = x + i * at.row;
      const TwoFields mine = learn(output, fields, sample, values[i], &full);
      if (mine.field[0] >= 0) most[atomicAdd(&found, 1)] = mine;
      __syncthreads();
      TwoFields both;
      for (int j = 0; j < found; ++j)
        for (int k = 0; k < 2; ++k) both.add(most[j].w[k], most[j].field[k]);
      if (both.w[0] < settings.w_gen) {
        if (thread == 0) begin(output, fields, sample, values[i]);
        ++fields;
      } else if (both.w[1] > settings.w_prune) {
        --fields;
        if (thread == 0) remove_one(output, both, fields);
      }
    }
    __syncthreads();
    if (thread == 0) progress[output] = {i, fields, full};
  }

 private:
  __device__ double* lane(unsigned output, int k) const {
    const std::size_t block = output * std::size_t(room.fields / kFieldLanes) + std::size_t(k / kFieldLanes);
    return blocks + block * std::size_t(at.block_size()) + k % kFieldLanes;
  }
  __device__ double* record(unsigned output, int k) const {
    const std::size_t before = output * std::size_t(room.fields) + std::size_t(k);
    return records + before * std::size_t(at.record_size(room.projections));
  }

  // Updates this thread's fields, which no other thread reads or writes.
  __device__ TwoFields learn(unsigned output, int fields, const double* sample, double value,
                             int* full) const {
    TwoFields mine;
    for (int k = int(threadIdx.x); k < fields; k += kThreads) {
      const double q = field_distance2<N>(at, LanesAt<double>{lane(output, k)}, sample);
      if (!(q < settings.q_max)) continue;
      const double w = exp_of<long long>(-0.5 * q);
      learn_field(output, k, sample, value, w);
      more_projections(output, k, full);
      mine.add(w, k);
    }
    return mine;
  }

  __device__ void learn_field(unsigned output, int k, const double* sample, double value, double w) const {
    double small[N > 0 ? 5 * N : 1];
    double* own = small;
    if constexpr (N == 0)
      own = scratch + (std::size_t(blockIdx.x) * kThreads + threadIdx.x) * scratch_size(at);
    FieldUpdate<N>(at, settings.field, lane(output, k), record(output, k), own).learn(sample, value, w);
  }

  __device__ void more_projections(unsigned output, int k, int* full) const {
    double* const head = record(output, k);
    if (!(head[FieldLayout::kWanted] > 0)) return;
    if (head[FieldLayout::kProjections] < room.projections)
      begin_projection(at, head);
    else
      atomicExch(full, 1);
  }

  __device__ void begin(unsigned output, int k, const double* sample, double value) const {
    begin_field(at, settings.start, first_M, sample, lane(output, k), record(output, k));
    for (int r = 0; r < first_projections(at); ++r) begin_projection(at, record(output, k));
    learn_field(output, k, sample, value, 1);
  }

  __device__ void remove_one(unsigned output, const TwoFields& both, int last) const {
    const int a = both.field[0] < both.field[1] ? both.field[0] : both.field[1];
    const int b = both.field[0] < both.field[1] ? both.field[1] : both.field[0];
    const int k = older_goes(at, record(output, a), record(output, b)) ? a : b;
    move_field(at, lane(output, last), record(output, last), at.record_size(room.projections),
               lane(output, k), record(output, k));
  }
};

}  // namespace
}  // namespace sdftrack::lwpr
