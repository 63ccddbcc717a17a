// SPDX-License-Identifier: MIT
#include "reconstruction/bodies.h"

#include <algorithm>

namespace sdftrack::reconstruction {

namespace {

int root_of(std::vector<BodyRun>* runs, int i) {
  const auto parent = [&](int k) -> int& { return (*runs)[k].body; };
  while (parent(i) != i) i = parent(i) = parent(parent(i));
  return i;
}

// Joins the runs [a, a_end) and [b, b_end) of two neighbouring rows where they overlap.
void join_rows(int a, int a_end, int b, int b_end, std::vector<BodyRun>* runs) {
  while (a < a_end && b < b_end) {
    const BodyRun &first = (*runs)[a], &other = (*runs)[b];
    const bool first_ends = first.x1 < other.x1;
    if (first.x0 < other.x1 && other.x0 < first.x1) {
      const int one = root_of(runs, a), two = root_of(runs, b);
      (*runs)[std::max(one, two)].body = std::min(one, two);
    }
    ++(first_ends ? a : b);
  }
}

}  // namespace

Bodies bodies_of(int nx, int ny, int nz, const float* phi) {
  Bodies out;
  std::vector<int> first;  // run of each row
  const auto count = [&] { return int(out.runs.size()); };
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y, phi += nx) {
      const int begin = count();
      first.push_back(begin);
      for (int x = 0; x < nx; ++x) {
        if (!(phi[x] < 0)) continue;
        const int x0 = x;
        while (x < nx && phi[x] < 0) ++x;
        out.runs.push_back({x0, x, y, z, count()});
      }
      const std::size_t row = first.size() - 1;
      const auto join = [&](std::size_t back) {
        join_rows(first[row - back], first[row - back + 1], begin, count(), &out.runs);
      };
      if (y > 0) join(1);
      if (z > 0) join(std::size_t(ny));
    }
  std::vector<long> voxels(out.runs.size(), 0);
  for (int i = 0; i < count(); ++i) {
    BodyRun& run = out.runs[i];
    run.body = root_of(&out.runs, i);
    voxels[run.body] += run.x1 - run.x0;
  }
  if (!voxels.empty()) out.largest = int(std::max_element(voxels.begin(), voxels.end()) - voxels.begin());
  return out;
}

}  // namespace sdftrack::reconstruction
