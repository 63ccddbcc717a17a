// SPDX-License-Identifier: MIT
#include "base/union_find.cuh"
#include "levelset/device_blocks.cuh"
#include "levelset/device_frame.cuh"
#include "levelset/device_work.cuh"
#include "levelset/free_space_terms.h"
#include "reconstruction/device_roles.h"
#include "reconstruction/first_view_terms.h"
#include "reconstruction/role_terms.h"

namespace sdftrack::reconstruction {

// The roles of measurements on the GPU, one thread per pixel. Connected measurements form a region; a region
// with a measurement on the current surface is the object's (roles.cpp visits the same ones from there).

using levelset::DeviceReadings;
using levelset::global_thread;
using levelset::PixelRole;

enum ReadingState : unsigned char { kMayBe = 1, kOnSurface = 2 };

struct MaskRoles {
  static constexpr const char* kName = "roles: mask";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  DeviceReadings readings;
  PixelRole* role;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i < readings.rect.count()) role[i] = masked_role(readings.depth_m[i], readings.mask[i]);
  }
};

// Which measurements may be the object's, and which of these are on its current surface.
struct StartRoles {
  static constexpr const char* kName = "roles: start";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  DeviceReadings readings;
  ReadingTerm term;
  sdf::Grid grid;
  SdfView sdf;
  levelset::DeviceVoxels voxels;
  FirstViewTerm view;  // without from_m: no view
  RoleOptions options;
  PixelRole* role;
  unsigned char* state;
  int* reached;
  __device__ void operator()() const {
    const int i = global_thread(kThreads), w = readings.rect.width();
    if (i >= readings.rect.count()) return;
    state[i] = 0, reached[i] = 0;
    role[i] = PixelRole::kUnknown;
    const float z = readings.depth_m[i];
    if (!levelset::readable(z)) return;
    const Vec3f p_obj = term.at(readings.rect.x0 + i % w, readings.rect.y0 + i / w, z);
    float distance_m;
    Vec3f unused;
    sample(sdf, p_obj, &distance_m, &unused);
    role[i] = PixelRole::kBeyond;
    if (!options.may_be(readings.foreground, i) || !has_room(p_obj.cast<double>())) return;
    state[i] = options.starts(distance_m) ? kMayBe | kOnSurface : kMayBe;
  }

 private:
  // Not where the recording's first frame leaves no room, nor where other frames have seen free space.
  __device__ bool has_room(Vec3d p_obj) const {
    return !(view.from_m && !view.may_hold(p_obj)) &&
           !levelset::looked_past(grid, voxels.phi, voxels.log_ratio, voxels.weight, p_obj, options.near_m);
  }
};

// Connected measurements.
struct Joined {
  DeviceReadings readings;
  RoleOptions options;
  const unsigned char* state;
  int* parent;
  __device__ bool may_be(int i) const { return state[i] & kMayBe; }
  __device__ bool operator()(int i, int j) const {
    return may_be(i) && may_be(j) && options.joins(readings.depth_m[i], readings.depth_m[j]);
  }
};

// One block of threads per row: the parent of a measurement is the first one of its run.
struct JoinAlongRows {
  static constexpr const char* kName = "roles: join along rows";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  Joined joined;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kThreads], first);
    const int w = joined.readings.rect.width(), row = int(blockIdx.x) * w, t = int(threadIdx.x);
    int before = -1;  // the first pixel of the run that reaches the last pixel so far
    for (int x0 = 0; x0 < w; x0 += kThreads) {
      const int x = x0 + t, i = row + x;
      const bool begins = x < w && (x == 0 || !joined(i - 1, i));
      first[t] = begins ? i : -1;
      __syncthreads();
      for (int step = 1; step < kThreads; step *= 2) {
        const int earlier = t >= step ? first[t - step] : -1;
        __syncthreads();
        first[t] = levelset::most(first[t], earlier);
        __syncthreads();
      }
      if (x < w) joined.parent[i] = first[t] < 0 ? before : first[t];
      before = first[kThreads - 1] < 0 ? before : first[kThreads - 1];
      __syncthreads();
    }
  }
};

struct JoinRows {
  static constexpr const char* kName = "roles: join rows";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  Joined joined;
  __device__ void operator()() const {
    const int i = global_thread(kThreads), w = joined.readings.rect.width(), above = i - w;
    if (i >= joined.readings.rect.count() || above < 0 || !joined(above, i)) return;
    // If the pixels to the left are connected in the same way, they have already joined the rows.
    const bool joined_before =
        i % w > 0 && joined(i - 1, i) && joined(above - 1, above) && joined(above - 1, i - 1);
    if (!joined_before) unite(joined.parent, i, above);
  }
};

struct ReachRegions {
  static constexpr const char* kName = "roles: reach";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  Joined joined;
  int* reached;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i >= joined.readings.rect.count() || !(joined.state[i] & kOnSurface)) return;
    int* const root = reached + root_of(joined.parent, i);
    if (*const_cast<const volatile int*>(root) == 0) atomicOr(root, 1);
  }
};

struct NameRoles {
  static constexpr const char* kName = "roles: name";
  static constexpr int kThreads = levelset::kThreadsPerPixels;
  Joined joined;
  const int* reached;
  PixelRole* role;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i >= joined.readings.rect.count() || !joined.may_be(i)) return;
    if (reached[root_of(joined.parent, i)]) role[i] = PixelRole::kObject;
  }
};

struct DeviceRoles::Impl {
  levelset::DeviceVolume* volume;
  FirstViewTerm view;
  DeviceBuffer<float> from_m;
  DeviceBuffer<PlaneBelow> planes;
};

DeviceRoles::DeviceRoles(levelset::DeviceVolume* volume, const FirstView* view) {
  const levelset::DeviceVolume::Impl& v = volume->impl();
  const DeviceScope scope(v.device);
  const FirstViewTerm none{LensRays(Camera{}), 0, 0, {}, {}, nullptr, nullptr, 0};
  impl_ = std::make_unique<Impl>(Impl{volume, view ? view->term() : none,
                                      DeviceBuffer<float>(view ? view->from_m().size() : 0),
                                      DeviceBuffer<PlaneBelow>(view ? view->planes().size() : 0)});
  if (!view) return;
  v.stream.upload(view->from_m().data(), view->from_m().size(), impl_->from_m.data());
  v.stream.upload(view->planes().data(), view->planes().size(), impl_->planes.data());
  v.stream.wait();  // the view is the caller's
  impl_->view.from_m = impl_->from_m.data(), impl_->view.planes = impl_->planes.data();
}
DeviceRoles::~DeviceRoles() = default;

void DeviceRoles::find(const Camera& camera, const Rigidd& T_cam_obj, const RoleOptions& options) {
  levelset::DeviceVolume::Impl& v = impl_->volume->impl();
  const DeviceScope scope(v.device);
  levelset::DeviceFrame& f = v.readings;
  const DeviceReadings readings = f.readings();
  const unsigned blocks = blocks_of(readings.rect.count(), levelset::kThreadsPerPixels);
  if (readings.mask) {
    launch(v.stream, blocks, MaskRoles{readings, f.role.data()});
    return;
  }
  const sdf::Grid& grid = v.blocks.grid;
  launch(v.stream, blocks,
         StartRoles{readings, ReadingTerm{LensRays(camera), inverse(T_cam_obj).cast<float>()}, grid,
                    grid.view(v.phi.data()), v.of_voxels(), impl_->view, options, f.role.data(),
                    f.state.data(), f.reached.data()});
  const Joined joined{readings, options, f.state.data(), f.parent.data()};
  launch(v.stream, static_cast<unsigned>(readings.rect.height()), JoinAlongRows{joined});
  launch(v.stream, blocks, JoinRows{joined});
  launch(v.stream, blocks, ReachRegions{joined, f.reached.data()});
  launch(v.stream, blocks, NameRoles{joined, f.reached.data(), f.role.data()});
}

}  // namespace sdftrack::reconstruction
