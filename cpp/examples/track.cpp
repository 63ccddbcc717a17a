// SPDX-License-Identifier: MIT
// Tracks an object of known shape in depth images of 16 bits, in millimetres, one after the other in a file:
//   track MESH IMAGES WIDTH HEIGHT FX FY CX CY [click X Y | mask FILE | scaled FILE]
// The last words say where the object is in the first image: a pixel of it, or a byte for each pixel.
// "scaled": the mesh has the object's form but not its size.
#include <sdftrack/tracker.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

int main(int argc, char** argv) try {
  const std::string how = argc > 9 ? argv[9] : "";
  const bool masked = how == "mask" || how == "scaled";
  if (argc != (how == "click" ? 12 : masked ? 11 : 9)) {
    std::puts("track MESH IMAGES WIDTH HEIGHT FX FY CX CY [click X Y | mask FILE | scaled FILE]");
    return 2;
  }
  const auto number = [&](int i) { return std::atof(argv[i]); };
  const sdftrack::DepthCamera camera{int(number(3)), int(number(4)), number(5), number(6),
                                     number(7),      number(8),      {}};
  sdftrack::Tracker tracker(sdftrack::Shape::from_mesh_file(argv[1]), camera);

  std::ifstream images(argv[2], std::ios::binary);
  std::vector<std::uint16_t> depth(std::size_t(camera.width) * camera.height);
  std::vector<std::uint8_t> mask(depth.size());
  sdftrack::Place place;
  if (how == "click") place.click_px = {number(10), number(11)};
  if (how == "scaled") tracker.estimate_scale(0);
  if (masked) {
    std::ifstream(argv[10], std::ios::binary)
        .read(reinterpret_cast<char*>(mask.data()), static_cast<std::streamsize>(mask.size()));
    place.mask = mask.data();
  }
  const auto bytes = static_cast<std::streamsize>(2 * depth.size());
  for (int i = 0; images.read(reinterpret_cast<char*>(depth.data()), bytes); ++i) {
    sdftrack::Frame frame;
    frame.depth = depth.data(), frame.depth_unit_m = 0.001;
    const sdftrack::TrackedPose& pose =
        (i == 0 ? tracker.start(frame, place) : tracker.track(frame)).objects.front();
    const Eigen::Vector3d t = pose.T_cam_obj.translation();
    const Eigen::Quaterniond q(pose.T_cam_obj.linear());
    std::printf("%d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %s\n", i, int(pose.status),
                pose.confidence, t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z(), pose.reason.c_str());
  }
  return 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
