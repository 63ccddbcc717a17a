// SPDX-License-Identifier: MIT
// Reconstructs an object in depth images of 16 bits, in millimetres, one after the other in a file. MASK is
// an image of bytes that are not 0 on the object in the first one. The poses are printed; the mesh is written
// to PLY, whose vertices have the property `seen`: the number of frontal views of each, 0 where it is
// guessed.
//   reconstruct IMAGES MASK PLY WIDTH HEIGHT FX FY CX CY [VOXELS]
#include <sdftrack/reconstructor.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <vector>

namespace {

template <class T>
void write(std::ofstream* file, const T* values, Eigen::Index count) {
  file->write(reinterpret_cast<const char*>(values), static_cast<std::streamsize>(count * sizeof(T)));
}

void save(const sdftrack::ReconstructedMesh& mesh, const char* path) {
  std::ofstream file(path, std::ios::binary);
  const bool colored = mesh.rgb.cols() > 0;
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.cols()
       << "\nproperty double x\nproperty double y\nproperty double z\nproperty float seen\n"
       << (colored ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "")
       << "element face " << mesh.faces.cols() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i) {
    write(&file, mesh.vertices.col(i).data(), 3);
    write(&file, &mesh.seen[i], 1);
    if (colored) write(&file, mesh.rgb.col(i).data(), 3);
  }
  for (Eigen::Index i = 0; i < mesh.faces.cols(); ++i) {
    file.put(3);
    write(&file, mesh.faces.col(i).data(), 3);
  }
}

std::vector<std::uint8_t> bytes_of(const char* path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 10) return std::puts("reconstruct IMAGES MASK PLY WIDTH HEIGHT FX FY CX CY [VOXELS]"), 2;
  const auto number = [&](int i) { return std::atof(argv[i]); };
  const sdftrack::DepthCamera camera{int(number(4)), int(number(5)), number(6), number(7),
                                     number(8),      number(9),      {}};
  sdftrack::ReconstructorSetup setup;
  if (argc > 10) setup.voxels = int(number(10));
  sdftrack::Reconstructor reconstructor(camera, setup);
  const std::vector<std::uint8_t> mask = bytes_of(argv[2]);
  sdftrack::Place place;
  place.mask = mask.data();

  std::ifstream images(argv[1], std::ios::binary);
  std::vector<std::uint16_t> depth(std::size_t(camera.width) * camera.height);
  if (mask.size() != depth.size()) return std::puts("MASK: expected one byte for each pixel"), 2;
  const auto bytes = static_cast<std::streamsize>(2 * depth.size());
  for (int i = 0; images.read(reinterpret_cast<char*>(depth.data()), bytes); ++i) {
    sdftrack::Frame frame;
    frame.depth = depth.data(), frame.depth_unit_m = 0.001;
    const sdftrack::ReconstructionResult& found =
        i == 0 ? reconstructor.start(frame, place) : reconstructor.track(frame);
    const Eigen::Matrix<double, 3, 4> T = found.pose.T_cam_obj.matrix().topRows<3>();
    std::printf("%d %d %.17g", found.index, int(found.pose.status), found.shape_change_m);
    for (int k = 0; k < 12; ++k) std::printf(" %.17g", T(k / 4, k % 4));
    std::printf(" %s\n", found.pose.reason.c_str());
  }
  save(reconstructor.mesh(), argv[3]);
  return 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
