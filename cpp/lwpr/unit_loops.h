// SPDX-License-Identifier: MIT
// The loops of unit_ops.h for the instruction set of the file that includes this.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include "lwpr/exponential.h"
#include "lwpr/field_terms.h"
#include "lwpr/receptive_field.h"
#include "lwpr/unit_ops.h"

namespace sdftrack::lwpr {
namespace {

// As wide as a register: of wider vectors a compiler keeps the parts in memory.
#if defined(__AVX512DQ__)
constexpr int kPack = 8;
#elif defined(__AVX2__)
constexpr int kPack = 4;
#else
constexpr int kPack = 2;
#endif
static_assert(kFieldLanes % kPack == 0);
using Pack = double __attribute__((vector_size(8 * kPack)));
using PackBits = long long __attribute__((vector_size(8 * kPack)));

HD unsigned bits_of_mask(PackBits mask) {
#if defined(__AVX512DQ__)
  return _mm512_movepi64_mask((__m512i)mask);
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_pd((__m256d)mask));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd((__m128d)mask));
#else
  unsigned bits = 0;
  for (int k = 0; k < kPack; ++k) bits |= static_cast<unsigned>(mask[k] != 0) << k;
  return bits;
#endif
}

template <int N>
struct UnitLoops {
  static const double* lane_of(const FieldLayout& at, const double* blocks, int field) {
    return blocks + static_cast<long>(field / kFieldLanes) * at.block_size() + field % kFieldLanes;
  }

  // Visits a list one field at a time, since the list is short.
  static int near(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                  const ActiveFields& out) {
    int found = 0;
    for (int i = 0; i < fields.count; ++i) {
      const int k = fields.list[i];
      const double q = field_distance2<N>(at, LanesAt<double>{lane_of(at, fields.blocks, k)}, x);
      out.index[found] = k, out.w[found] = q;
      found += q < q_max;
    }
    return found;
  }

  // Visits all fields, block by block.
  static int among_all(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                       const ActiveFields& out) {
    const int size = at.block_size();
    int found = 0;
    for (int first = 0; first < fields.count; first += kPack) {
      const double* block = fields.blocks + static_cast<long>(first / kFieldLanes) * size;
      const LanesAt<Pack> read{block + first % kFieldLanes};
      const Pack q = field_distance2<N>(at, read, x);
      for (unsigned bits = bits_of_mask(q < q_max); bits != 0; bits &= bits - 1, ++found) {
        const int lane = __builtin_ctz(bits);
        out.index[found] = first + lane, out.w[found] = q[lane];
      }
    }
    return found;
  }

  static int active(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                    const ActiveFields& out) {
    const int found = fields.list ? near(at, fields, x, q_max, out) : among_all(at, fields, x, q_max, out);
    for (int i = 0; i < found; i += kPack) {
      Pack q;
      __builtin_memcpy(&q, out.w + i, sizeof(q));
      q = exp_of<PackBits>(-0.5 * q);
      __builtin_memcpy(out.w + i, &q, sizeof(q));
    }
    return found;
  }

  static FieldSums predict(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                           const ActiveFields& out) {
    const int found = active(at, fields, x, q_max, out);
    FieldSums sums{0, 0};
    for (int i = 0; i < found; ++i) {
      const LanesAt<double> read{lane_of(at, fields.blocks, out.index[i])};
      const double w = out.w[i] * read(at.ready());
      sums.w += w;
      sums.wy += w * field_value<N>(at, read, x);
    }
    return sums;
  }

  static bool learn(const FieldLayout& at, const FieldSettings& o, double* blocks, double* records,
                    long stride, double* scratch, const double* x, double y, const ActiveFields& active,
                    int count) {
    double small[N > 0 ? 5 * N : 1];
    bool requested = false;
    for (int i = 0; i < count; ++i) {
      const int k = active.index[i];
      double* const lane = const_cast<double*>(lane_of(at, blocks, k));
      requested |=
          FieldUpdate<N>(at, o, lane, records + k * stride, N > 0 ? small : scratch).learn(x, y, active.w[i]);
    }
    return requested;
  }
};

int active_fields(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                  const ActiveFields& out) {
  return for_inputs(at.n, [&](auto n) { return UnitLoops<n()>::active(at, fields, x, q_max, out); });
}

FieldSums predicted_sums(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                         const ActiveFields& out) {
  return for_inputs(at.n, [&](auto n) { return UnitLoops<n()>::predict(at, fields, x, q_max, out); });
}

bool learn_sample(const FieldLayout& at, const FieldSettings& o, double* blocks, double* records, long stride,
                  double* scratch, const double* x, double y, const ActiveFields& active, int count) {
  return for_inputs(at.n, [&](auto n) {
    return UnitLoops<n()>::learn(at, o, blocks, records, stride, scratch, x, y, active, count);
  });
}

}  // namespace

// SDFTRACK_SET: the member of UnitOps that the file defines.
const UnitOps UnitOps::SDFTRACK_SET = {active_fields, predicted_sums, learn_sample};

}  // namespace sdftrack::lwpr
