// SPDX-License-Identifier: MIT
// Parts of the kernels of complete searches: one block of sent data, and the test for the last block.
#pragma once

#include "energies/beside_cuda.cuh"
#include "energies/cuda_work.cuh"

namespace sdftrack::energies {

// Whether all other blocks, counted in `arrived`, have written their sums; called by all threads.
__device__ inline bool is_last_block(unsigned* arrived, int blocks) {
  SDFTRACK_SHARED(int, last);
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(arrived, 1u) == static_cast<unsigned>(blocks - 1);
  __syncthreads();
  __threadfence();
  return last != 0;
}

inline void bring_volumes(CudaWork* work, Beside* given) {
  PhotometricTerm& term = given->brightness.term;
  if (given->brightness.count == 0) return;
  term.colors = work->colors(term.sdf, term.colors);
  term.sdf = work->volume(term.sdf);
}

// Places of parts in one block of memory, each at a multiple of 16 bytes.
class Places {
 public:
  template <class T>
  std::size_t add(std::size_t count) {
    const std::size_t at = (end_ + 15) / 16 * 16;
    end_ = at + count * sizeof(T);
    return at;
  }
  std::size_t end() const { return end_; }

 private:
  std::size_t end_ = 0;
};

template <class T>
void put(const T* from, std::size_t count, std::byte* to) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (count > 0) std::memcpy(to, from, count * sizeof(T));
}

// A part of the host's memory that is sent, and its place on the device.
template <class T>
class SentPart {
 public:
  SentPart(Places* places, const T* from, std::size_t count)
      : from_(from), count_(count), at_(places->add<T>(count)) {}
  T* put_to(std::byte* here, std::byte* there) const {
    put(from_, count_, here + at_);
    return reinterpret_cast<T*>(there + at_);
  }

 private:
  const T* from_;
  std::size_t count_, at_;
};

// The arrays of a Beside.
class SentBeside {
 public:
  SentBeside(Places* places, const Beside& given)
      : points_(places, given.outline.points_obj.points, std::size_t(given.outline.points_obj.n)),
        grid_(places, given.outline.grid.distance_px, grid_size(given.outline)),
        hits_(places, given.brightness.hits, std::size_t(given.brightness.count)),
        lines_(places, given.lines.lines, std::size_t(given.lines.count)) {}
  void put_to(std::byte* here, std::byte* there, Beside* given) const {
    given->outline.points_obj.points = points_.put_to(here, there);
    given->outline.grid.distance_px = grid_.put_to(here, there);
    given->brightness.hits = hits_.put_to(here, there);
    given->lines.lines = lines_.put_to(here, there);
  }

 private:
  static std::size_t grid_size(const OutlineTerm<float>& term) {
    return term.points_obj.n > 0 ? std::size_t(term.grid.width) * term.grid.height : 0;
  }
  SentPart<Vec3f> points_;
  SentPart<float> grid_;
  SentPart<PhotometricHit> hits_;
  SentPart<OutlineLine> lines_;
};

}  // namespace sdftrack::energies
