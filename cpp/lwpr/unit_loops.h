// SPDX-License-Identifier: MIT
// The loops of unit_ops.h for the instruction set of the file that includes this. Eight doubles are one pack
// in each set; where registers are narrower the compiler splits it into two or four.
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

using Eight = double __attribute__((vector_size(64)));
using EightBits = long long __attribute__((vector_size(64)));

HD int bits_of_mask(EightBits mask) {
#if defined(__AVX512DQ__)
  return _mm512_movepi64_mask((__m512i)mask);
#elif defined(__AVX2__)
  __m256d half[2];
  __builtin_memcpy(half, &mask, sizeof(half));
  return _mm256_movemask_pd(half[0]) | _mm256_movemask_pd(half[1]) << 4;
#elif defined(__SSE2__)
  __m128d part[4];
  __builtin_memcpy(part, &mask, sizeof(part));
  return _mm_movemask_pd(part[0]) | _mm_movemask_pd(part[1]) << 2 | _mm_movemask_pd(part[2]) << 4 |
         _mm_movemask_pd(part[3]) << 6;
#else
  int bits = 0;
  for (int k = 0; k < kFieldLanes; ++k) bits |= (mask[k] != 0) << k;
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
    for (int first = 0; first < fields.count; first += kFieldLanes) {
      const LanesAt<Eight> read{fields.blocks + static_cast<long>(first / kFieldLanes) * size};
      const Eight q = field_distance2<N>(at, read, x);
      for (int bits = bits_of_mask(q < q_max); bits != 0; bits &= bits - 1, ++found) {
        const int lane = __builtin_ctz(static_cast<unsigned>(bits));
        out.index[found] = first + lane, out.w[found] = q[lane];
      }
    }
    return found;
  }

  static int active(const FieldLayout& at, const FieldList& fields, const double* x, double q_max,
                    const ActiveFields& out) {
    const int found = fields.list ? near(at, fields, x, q_max, out) : among_all(at, fields, x, q_max, out);
    for (int i = 0; i < found; i += kFieldLanes) {
      Eight q;
      __builtin_memcpy(&q, out.w + i, sizeof(q));
      q = exp_of<EightBits>(-0.5 * q);
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
