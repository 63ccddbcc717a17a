// SPDX-License-Identifier: MIT
// Tracks an object of a BOP scene from its mask in the first image, or from its pose there without a mask:
//   track_bop SCENE OBJECT
#include <sdftrack/sequence.h>
#include <sdftrack/tracker.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

int main(int argc, char** argv) try {
  if (argc != 3) return std::puts("track_bop SCENE OBJECT"), 2;
  sdftrack::Sequence sequence(argv[1]);
  const int object = std::atoi(argv[2]);
  sdftrack::ShapeOptions in_mm;
  in_mm.unit_m = 0.001;
  sdftrack::Tracker tracker(sdftrack::Shape::from_mesh_file(sequence.model_file(object), in_mm),
                            sequence.camera());

  sdftrack::Place place;  // nothing: the object is searched for in the whole image
  std::vector<std::uint8_t> mask;
  const auto& first = sequence.instances(0);
  for (std::size_t k = 0; k < first.size(); ++k)
    if (first[k].object == object) {
      mask = sequence.mask(0, int(k));
      if (mask.empty())
        place.T_cam_obj = first[k].T_cam_obj;
      else
        place.mask = mask.data();
      break;
    }

  for (int i = 0; i < sequence.size(); ++i) {
    const sdftrack::Frame frame = sequence.frame(i);
    const sdftrack::TrackedPose& pose =
        (i == 0 ? tracker.start(frame, place) : tracker.track(frame)).objects.front();
    const Eigen::Vector3d t = pose.T_cam_obj.translation();
    const Eigen::Quaterniond q(pose.T_cam_obj.linear());
    std::printf("%d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %s\n", sequence.id(i),
                int(pose.status), pose.confidence, t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z(),
                pose.reason.c_str());
  }
  return 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
