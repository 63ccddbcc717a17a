// SPDX-License-Identifier: MIT
#include "levelset/device_work.cuh"
#include "reconstruction/device_roles.h"
#include "reconstruction/role_kernels.cuh"

namespace sdftrack::reconstruction {

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
