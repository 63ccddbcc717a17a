// SPDX-License-Identifier: MIT
// Fusion of a frame into a volume on a GPU.
#include "levelset/device_work.cuh"
#include "levelset/image_kernels.cuh"

namespace sdftrack::levelset {

void DeviceVolume::send(const FrameEvidence& frame) {
  const DeviceScope scope(impl_->device);
  impl_->readings.send(frame, impl_->stream);
}

// Makes the image of the sent measurements, whose roles are known.
void DeviceVolume::make_image(const Camera& camera, const EvidenceImageOptions& options, float reach_m) {
  Impl& v = *impl_;
  DeviceFrame& f = v.readings;
  const PixelRect rect = f.readings().rect;
  const int w = rect.width(), h = rect.height();
  const unsigned blocks = blocks_of(rect.count(), kThreadsPerPixels);
  launch(v.stream, blocks,
         ReadPixels{LensRays(camera), rect, f.readings().depth_m, f.role.data(), f.pixels.data(),
                    f.source.data(), f.image_role.data()});
  const bool near_too = options.border_px > 1;
  const ImagePlanes planes{
      f.pixels.data(), f.image_role.data(), f.edge.data(), near_too ? f.border.data() : f.edge.data(), w, h};
  if (!options.printed) {
    launch(v.stream, blocks, FindEdges{planes, options.jump_m, f.edge.data()});
    const int reach = options.border_px - 1;
    if (near_too) {
      launch(v.stream, blocks, SpreadEdges{w, h, reach, 1, f.edge.data(), f.spread.data()});
      launch(v.stream, blocks, SpreadEdges{w, h, reach, w, f.spread.data(), f.border.data()});
    }
  }
  launch(v.stream, blocks, JudgePixels{planes, rect, camera.K.cast<float>(), options});
  launch(v.stream, blocks_of(tiles_along(w) * tiles_along(h), kThreadsPerPixels),
         FindTiles{f.pixels.data(), w, h, reach_m, f.tiles.data()});
}

void DeviceVolume::fuse(const Camera& camera, const Rigidd& T_cam_obj,
                        const EvidenceImageOptions& image_options, const EvidenceOptions& options) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  make_image(camera, image_options, evidence_reach_m(options));
  const DeviceFrame& f = v.readings;
  const PixelRect rect = f.readings().rect;
  const BlockSight sight{v.blocks,
                         T_cam_obj,
                         camera.K,
                         rect.x0,
                         rect.y0,
                         tiles_along(rect.width()),
                         tiles_along(rect.height()),
                         f.tiles.data(),
                         v.frame,
                         options.known_every};
  const DeviceBlocks of = v.of_blocks();
  launch(v.stream, v.for_each_block(), ChooseBlocks{sight, of});
  v.make_lists(IsMarked{of.marked});
  launch(v.stream, v.for_listed(),
         FuseBlocks{evidence_term(rect, reinterpret_cast<const float*>(f.pixels.data()), camera, options),
                    sight, v.of_voxels(), of, v.list(0), f.readings().rgb, f.source.data(),
                    options.max_weight, options.color_reach_voxels * float(v.blocks.grid.voxel_m)});
  v.older |= kColorNotShown;
  ++v.frame;
}

}  // namespace sdftrack::levelset
