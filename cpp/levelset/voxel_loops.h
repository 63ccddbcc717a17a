// SPDX-License-Identifier: MIT
// The loops of voxel_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "energies/block.h"
#include "levelset/voxel_ops.h"

namespace sdftrack {
namespace {

template <class L>
struct VoxelLoops {
  static RowChange fuse(const EvidenceTerm<float>& given, Vec3f p_cam, Vec3f step_cam, int count,
                        float most_weight, float* log_ratio, float* weight, float* distance_m) {
    const auto term = given.template cast<L>();
    const Vec3<L> first{L(p_cam.x), L(p_cam.y), L(p_cam.z)};
    const L sx(step_cam.x), sy(step_cam.y), sz(step_cam.z), limit(most_weight);
    RowChange change{false, false, false};
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE {
      const L k = real<L>(indices<L>(i, n));
      const Evidence<L> said = term.at({first.x + k * sx, first.y + k * sy, first.z + k * sz});
      const L before = load<L>(weight + i, n);
      // Where anything else has spoken, faint carving would gnaw at rims that are seldom seen.
      const auto idle = (said.weight < L(2 * kFaint * kCarvedWeight)) & (before > L(kUnknownWeight));
      const L more = select(idle, L(0), said.weight), sum = before + more;
      // What was guessed counts until something is seen.
      const L known = select((before == L(0)) & (more > L(0)), L(0), load<L>(log_ratio + i, n));
      const L kept = select(sum > limit, limit / sum, L(1));
      const L now = kept * (known + select(idle, L(0), said.log_ratio)), own = load<L>(log_ratio + i, n);
      store(now, log_ratio + i, n);
      const L one = select(own > L(0), L(1), L(0)), other = select(now > L(0), L(1), L(0));
      change.turned |= any(one != other) || any((before == L(0)) & (more > L(0)));
      change.inside |= any(now > L(0));
      change.near |= any(said.distance_m < L(kNoSurface_m));
      store(kept * sum, weight + i, n);
      store(said.distance_m, distance_m + i, n);
    });
    return change;
  }

  static void relax(const EikonalTerm<float>& given, const RowAt& at, int x0, int x1) {
    const EikonalTerm<L> term{given.voxel_m, given.most_m};
    // As the row was: what a voxel becomes does not hang on how many are done at once.
    float row[kMostRelaxed + 2];
    for (int x = x0 - 1; x <= x1; ++x) row[x - x0 + 1] = at.phi[x];
    each_pack<L>(x0, x1, [&](int x, int n) SDFTRACK_INLINE {
      store(term.relax(at, row + 1 - x0, x, n), at.phi + x, n);
    });
  }

  static int crossed(const float* log_ratio, const RowAt& at, float voxel_m, int x0, int x1, int* out) {
    int found = 0;
    each_pack<L>(x0, x1, [&](int x, int n) SDFTRACK_INLINE {
      const float* p = log_ratio + x;
      const L own = load<L>(p, n);
      const L a = load<L>(p - 1, n), b = load<L>(p + 1, n), c = load<L>(p - at.row, n),
              d = load<L>(p + at.row, n), e = load<L>(p - at.slice, n), f = load<L>(p + at.slice, n);
      const L low = least(least(least(a, b), least(c, d)), least(e, f)),
              high = most(most(most(a, b), most(c, d)), most(e, f));
      const auto inside = own > L(0);
      const auto yes = (select(inside, L(0) - low, high) > L(0)) | (select(inside, low, L(1)) == L(0));
      const L phi = load<L>(at.phi + x, n), size = abs(phi);
      const auto turned = select(inside, phi, L(-1) * phi) > L(0);
      const L kept = select(turned, most(size, L(voxel_m)), size);
      store(select(inside, L(-1) * kept, kept), at.phi + x, n);
      const auto chosen = yes & among_first<L>(n);
      if (any(chosen)) found += keep(chosen, x, out + found);
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

}  // namespace sdftrack
