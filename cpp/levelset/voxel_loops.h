// SPDX-License-Identifier: MIT
// The loops of voxel_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include <algorithm>

#include "energies/block.h"
#include "levelset/voxel_ops.h"

namespace sdftrack::levelset {
namespace {

using namespace energies;  // each_pack, Block, Row, PartialSums

template <class L>
struct VoxelLoops {
  static BlockChange fuse(const EvidenceTerm<float>& given, const BlockPlace& place, const BlockRows& rows,
                          float max_weight, float* log_ratio, float* weight, float* distance_m) {
    const auto term = given.template cast<L>();
    const Vec3f step = place.x.cast<float>();
    const L sx(step.x), sy(step.y), sz(step.z), limit(max_weight);
    BlockChange change{0, false, false, true};
    for (int row = 0; row < rows.ny * rows.nz; ++row) {
      const Vec3f p = place.at(rows, row);
      const Vec3<L> first{L(p.x), L(p.y), L(p.z)};
      float* const ratios = log_ratio + rows.offset(row);
      float* const weights = weight + rows.offset(row);
      each_pack<L>(0, rows.nx, [&](int i, int n) SDFTRACK_INLINE {
        const L k = real<L>(indices<L>(i, n));
        const Evidence<L> evidence = term.at({first.x + k * sx, first.y + k * sy, first.z + k * sz});
        const L before = load<L>(weights + i, n), own = load<L>(ratios + i, n);
        const FusedVoxel<L> now = fused(evidence, own, before, limit, given.form.printed);
        store(now.log_ratio, ratios + i, n);
        store(now.weight, weights + i, n);
        const auto here = among_first<L>(n);
        change.turned |= any(now.turned & here);
        change.inside |= any(now.inside & here);
        change.empty &= !any(now.unsure & here);
        if (!any(evidence.distance_m < L(kNoSurface_m))) return;
        if (!(change.near >> row & 1)) std::fill_n(distance_m + kBlockSide * row, kBlockSide, kNoSurface_m);
        change.near |= std::uint64_t{1} << row;
        store(evidence.distance_m, distance_m + kBlockSide * row + i, n);
      });
    }
    change.empty &= change.near == 0;
    return change;
  }

  static bool relax(const EikonalTerm<float>& given, const BlockRows& rows, bool forward, float settled_m,
                    float band_m, float* phi) {
    const EikonalTerm<L> term{given.voxel_m, given.max_m};
    const int count = rows.ny * rows.nz;
    bool changed = false;
    for (int k = 0; k < count; ++k) {
      const RowAt at{phi + rows.offset(forward ? k : count - 1 - k), rows.row, rows.slice};
      // The whole row is computed before it changes, so that values do not depend on the width of a pack.
      L now[kBlockSide / kWidth<L>];
      each_pack<L>(0, rows.nx,
                   [&](int x, int n) SDFTRACK_INLINE { now[x / kWidth<L>] = term.relax(at, x, n); });
      each_pack<L>(0, rows.nx, [&](int x, int n) SDFTRACK_INLINE {
        const L after = now[x / kWidth<L>], moved = abs(after - load<L>(at.phi + x, n));
        changed |= any((moved > L(settled_m)) & (abs(after) < L(band_m)) & among_first<L>(n));
        store(after, at.phi + x, n);
      });
    }
    return changed;
  }

  static int crossed(const float* log_ratio, const BlockRows& rows, float voxel_m, float* phi, int* out) {
    int found = 0;
    for (int row = 0; row < rows.ny * rows.nz; ++row)
      each_pack<L>(0, rows.nx, [&](int x, int n) SDFTRACK_INLINE {
        const std::size_t first = rows.offset(row) + std::size_t(x);
        const float* const p = log_ratio + first;
        const L own = load<L>(p, n);
        const L a = load<L>(p - 1, n), b = load<L>(p + 1, n), c = load<L>(p - rows.row, n),
                d = load<L>(p + rows.row, n), e = load<L>(p - rows.slice, n), f = load<L>(p + rows.slice, n);
        const Sided<L> now =
            sided(own, least(least(least(a, b), least(c, d)), least(e, f)),
                  most(most(most(a, b), most(c, d)), most(e, f)), load<L>(phi + first, n), L(voxel_m));
        store(now.phi, phi + first, n);
        const auto chosen = now.crossed & among_first<L>(n);
        if (any(chosen)) found += keep(chosen, int(first), out + found);
      });
    return found;
  }

  static void flux(const EvolveTerm<float>& given, const Neighbours* at, const float* phi, int count,
                   float* const* flux) {
    const EvolveTerm<L> term{given.inv_sigma_h, given.mu, given.dt, given.printed};
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE {
      L out[3];
      term.flux(at, phi + i, n, out);
      for (int k = 0; k < 3; ++k) store(out[k], flux[k] + i, n);
    });
  }

  static void step(const EvolveTerm<float>& given, const Neighbours* at, const float* phi,
                   const float* log_ratio, const float* const* flux, int count, float* out) {
    const EvolveTerm<L> term{given.inv_sigma_h, given.mu, given.dt, given.printed};
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE {
      const float* const from[3] = {flux[0] + i, flux[1] + i, flux[2] + i};
      store(term.step(at, phi + i, log_ratio + i, from, n), out + i, n);
    });
  }
};

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of VoxelOps that it serves.
const VoxelOps VoxelOps::SDFTRACK_SET = {VoxelLoops<SDFTRACK_LANES>::fuse, VoxelLoops<SDFTRACK_LANES>::relax,
                                         VoxelLoops<SDFTRACK_LANES>::crossed,
                                         VoxelLoops<SDFTRACK_LANES>::flux, VoxelLoops<SDFTRACK_LANES>::step};

}  // namespace sdftrack::levelset
