// SPDX-License-Identifier: MIT
// The public headers, as a user's program includes them.
#include <gtest/gtest.h>
#include <sdftrack/reconstructor.h>
#include <sdftrack/tracker.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using sdftrack::Shape;

// A wedge, no two of whose sides are alike: faces outwards.
const double kCorners[6][3] = {{0, 0, 0},    {0.12, 0, 0},    {0, 0.08, 0},
                               {0, 0, 0.05}, {0.12, 0, 0.05}, {0, 0.08, 0.05}};
const int kFaces[8][3] = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                          {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};

Shape::Vertices vertices() {
  Shape::Vertices out(3, 6);
  for (int i = 0; i < 6; ++i) out.col(i) << kCorners[i][0], kCorners[i][1], kCorners[i][2];
  return out;
}

Shape::Faces faces() {
  Shape::Faces out(3, 8);
  for (int i = 0; i < 8; ++i) out.col(i) << kFaces[i][0], kFaces[i][1], kFaces[i][2];
  return out;
}

sdftrack::ShapeOptions coarse() {
  sdftrack::ShapeOptions options;
  options.voxels = 60;
  return options;
}

std::string refusal_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was refused";
}

std::string text_of(const char* format, double a, double b, double c) {
  char text[128];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

template <class Value>
void append(std::string* to, Value value) {
  to->append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string ply(bool binary) {
  std::string out =
      std::string("ply\nformat ") + (binary ? "binary_little_endian" : "ascii") +
      " 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n"
      "property uchar red\nelement face 8\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& p : kCorners) {
    if (!binary) out += text_of("%.17g %.17g %.17g 7\n", p[0], p[1], p[2]);
    for (int i = 0; binary && i < 3; ++i) append(&out, p[i]);
    if (binary) append(&out, static_cast<unsigned char>(7));
  }
  for (const auto& f : kFaces) {
    if (!binary) out += text_of("3 %.0f %.0f %.0f\n", f[0], f[1], f[2]);
    if (binary) append(&out, static_cast<unsigned char>(3));
    for (int i = 0; binary && i < 3; ++i) append(&out, f[i]);
  }
  return out;
}

std::string obj() {
  std::string out = "# a wedge\r\n";
  for (const auto& p : kCorners) out += text_of("v %.17g %.17g %.17g\n", p[0], p[1], p[2]);
  for (const auto& f : kFaces) out += text_of("f %.0f/1/1 %.0f//2 %.0f\n", f[0] + 1, f[1] + 1, f[2] - 6);
  return out;
}

std::string stl(bool binary) {
  std::string out = binary ? std::string(80, ' ') : "solid wedge\n";
  if (binary) append(&out, std::uint32_t{8});
  for (const auto& f : kFaces) {
    for (int i = 0; binary && i < 3; ++i) append(&out, 0.0f);
    for (const int v : f) {
      for (int i = 0; binary && i < 3; ++i) append(&out, static_cast<float>(kCorners[v][i]));
      if (!binary)
        out += text_of("vertex %.17g %.17g %.17g\n", kCorners[v][0], kCorners[v][1], kCorners[v][2]);
    }
    if (binary) append(&out, std::uint16_t{0});
  }
  return out;
}

std::string written(const std::string& name, const std::string& bytes) {
  const std::string path = (std::filesystem::temp_directory_path() / ("sdftrack_face_" + name)).string();
  std::FILE* file = std::fopen(path.c_str(), "wb");
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  std::fclose(file);
  return path;
}

const sdftrack::DepthCamera kCamera{160, 120, 150, 150, 79.5, 59.5, {}};

// The wedge's depth, by steps along each ray until the distance is 0.
std::vector<std::uint16_t> image_mm(const Shape& shape, const Eigen::Isometry3d& T_cam_obj) {
  std::vector<std::uint16_t> out;
  const Eigen::Isometry3d T_obj_cam = T_cam_obj.inverse();
  for (int y = 0; y < kCamera.height; ++y)
    for (int x = 0; x < kCamera.width; ++x) {
      const Eigen::Vector3d ray((x - kCamera.cx) / kCamera.fx, (y - kCamera.cy) / kCamera.fy, 1);
      double z = 0.3, phi = 1;
      while (z < 0.7 && phi > 1e-4)
        phi = shape.distance_m(T_obj_cam * (z * ray)), z += 0.5 * std::max(phi, 1e-4);
      out.push_back(z < 0.7 ? static_cast<std::uint16_t>(std::lround(1000 * z)) : 0);
    }
  return out;
}

Eigen::Isometry3d pose() {
  Eigen::Isometry3d T(Eigen::Translation3d(-0.03, -0.02, 0.5));
  T.rotate(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, 0.5).normalized()));
  return T;
}

TEST(Face, every_format_of_a_mesh_gives_the_same_shape) {
  const Shape given = Shape::from_mesh(vertices(), faces(), coarse());
  const std::pair<const char*, std::string> files[] = {{"text.ply", ply(false)},
                                                       {"binary.PLY", ply(true)},
                                                       {"a.obj", obj()},
                                                       {"text.stl", stl(false)},
                                                       {"binary.stl", stl(true)}};
  for (const auto& [name, bytes] : files) {
    const Shape read = Shape::from_mesh_file(written(name, bytes), coarse());
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.03, 0.02, 0.02), Eigen::Vector3d(0.1, 0.06, -0.01)})
      EXPECT_NEAR(read.distance_m(p), given.distance_m(p), 1e-6) << name;
  }
  Shape::Faces flipped = faces();
  flipped.col(3).reverseInPlace();
  EXPECT_NE(Shape::from_mesh(vertices(), flipped, coarse()).warnings().front().find("oriented against"),
            std::string::npos);
  EXPECT_NEAR(given.distance_m({0.03, 0.02, 0.01}), -0.01, 1e-4);
}

TEST(Face, a_damaged_mesh_file_is_refused_with_its_name_and_the_fault) {
  const auto fault = [](const char* name, const std::string& bytes) {
    const std::string path = written(name, bytes);
    const std::string said = refusal_of([&] { Shape::from_mesh_file(path, coarse()); });
    EXPECT_NE(said.find(path), std::string::npos) << said;
    return said;
  };
  for (const bool binary : {false, true}) {
    const std::string whole = ply(binary);
    EXPECT_NE(fault("cut.ply", whole.substr(0, whole.size() - 9)).find("truncated"), std::string::npos);
  }
  EXPECT_NE(fault("cut.stl", stl(true).substr(0, 300)).find("truncated"), std::string::npos);
  EXPECT_NE(fault("head.ply", ply(true).substr(0, 60)).find("truncated"), std::string::npos);
  EXPECT_NE(fault("far.obj", obj() + "f 1 2 9\n").find("vertex 8"), std::string::npos);
  EXPECT_NE(fault("nan.obj", obj() + "f 1 nan 2\n").find("vertex nan"), std::string::npos);
  EXPECT_NE(fault("part.obj", obj() + "f 1 2.5 2\n").find("vertex 1.5"), std::string::npos);
  std::string endless = ply(false);
  endless.insert(endless.find("element face"), "element nothing 1e18\n");
  EXPECT_GT(Shape::from_mesh_file(written("endless.ply", endless), coarse()).voxel_m(), 0);
  EXPECT_NE(fault("word.obj", "v 1 2 x\n").find("got 'x'"), std::string::npos);
  EXPECT_NE(fault("a.xyz", "1 2 3").find(".ply, .obj or .stl"), std::string::npos);
  EXPECT_NE(refusal_of([] { Shape::from_mesh_file("/no/such.ply"); }).find("no such file"),
            std::string::npos);
  EXPECT_NE(refusal_of([] { Shape::from_mesh(1000 * vertices(), faces()); }).find("is it in mm?"),
            std::string::npos);
  sdftrack::ShapeOptions mm = coarse();
  mm.unit_m = 0.001;
  EXPECT_NEAR(Shape::from_mesh(1000 * vertices(), faces(), mm).distance_m({0.03, 0.02, 0.01}), -0.01, 1e-4);
  Shape::Faces outside = faces();
  outside(0, 0) = 6;
  EXPECT_NE(refusal_of([&] { Shape::from_mesh(vertices(), outside); }).find("0..5"), std::string::npos);
}

TEST(Face, millimetres_and_metres_give_the_same_pose_which_is_right) {
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  const std::vector<std::uint16_t> image = image_mm(shape, pose());
  std::vector<float> depth_m;
  for (const std::uint16_t z : image) depth_m.push_back(static_cast<float>(z) / 1000);
  sdftrack::Frame steps, metres;
  steps.depth = image.data(), metres.depth_m = depth_m.data();
  sdftrack::TrackerSetup setup;
  setup.sensor = "kinect_v1";
  setup.options = {{"max_pixels", 2000}, {"residual", "slope"}, {"fine_first", true}, {"lateral_px", 0.5}};
  sdftrack::Tracker one(shape, kCamera, setup), other(shape, kCamera, setup);
  Eigen::Isometry3d guess = pose();
  guess.translation().x() += 0.004;
  const sdftrack::TrackedPose a = one.start(steps, guess).objects.front();
  const sdftrack::TrackedPose b = other.start(metres, guess).objects.front();
  EXPECT_NE(a.status, sdftrack::Status::kLost) << a.reason;
  EXPECT_LT((a.T_cam_obj.translation() - pose().translation()).norm(), 0.002);
  EXPECT_EQ(a.T_cam_obj.matrix(), b.T_cam_obj.matrix());
  EXPECT_EQ(one.track(steps).index, 1);
}

TEST(Face, a_colour_camera_beside_the_depth_camera_shows_the_object_where_it_projects) {
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  const std::vector<std::uint16_t> image = image_mm(shape, pose());
  // Twice the pixels, 30 mm to the side: red where a point of the object projects to, else blue.
  sdftrack::ColorCamera color{{2 * kCamera.width,
                               2 * kCamera.height,
                               2 * kCamera.fx,
                               2 * kCamera.fy,
                               2 * kCamera.cx,
                               2 * kCamera.cy,
                               {}},
                              Eigen::Isometry3d::Identity()};
  color.T_color_depth.translation().x() = -0.03;
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(3 * color.width * color.height), 0);
  for (std::size_t i = 2; i < rgb.size(); i += 3) rgb[i] = 200;
  const auto paint = [&](int x, int y, double z_m) {
    const Eigen::Vector3d p = color.T_color_depth * (z_m * Eigen::Vector3d((x - kCamera.cx) / kCamera.fx,
                                                                           (y - kCamera.cy) / kCamera.fy, 1));
    const int u = static_cast<int>(color.fx * p.x() / p.z() + color.cx);
    const int v = static_cast<int>(color.fy * p.y() / p.z() + color.cy);
    for (int dv = -2; dv <= 2; ++dv)
      for (int du = -2; du <= 2; ++du) {
        if (u + du < 0 || v + dv < 0 || u + du >= color.width || v + dv >= color.height) continue;
        std::uint8_t* const c = &rgb[static_cast<std::size_t>(3 * ((v + dv) * color.width + u + du))];
        c[0] = 200, c[2] = 0;
      }
  };
  for (int y = 0, i = 0; y < kCamera.height; ++y)
    for (int x = 0; x < kCamera.width; ++x, ++i)
      if (image[static_cast<std::size_t>(i)]) paint(x, y, 0.001 * image[static_cast<std::size_t>(i)]);
  sdftrack::TrackerSetup setup;
  setup.color = color;
  sdftrack::Frame frame;
  frame.depth = image.data(), frame.rgb = rgb.data();
  sdftrack::Tracker tracker(shape, kCamera, setup);
  tracker.start(frame, pose());
  for (int i = 0; i < 3; ++i) {
    const sdftrack::TrackedPose found = tracker.track(frame).objects.front();
    EXPECT_NE(found.status, sdftrack::Status::kLost) << found.reason;
    EXPECT_LT((found.T_cam_obj.translation() - pose().translation()).norm(), 0.002);
  }
  setup.color->fx = 0;
  EXPECT_NE(refusal_of([&] { sdftrack::Tracker(shape, kCamera, setup); }).find("color: expected a width"),
            std::string::npos);
  setup.color = color;
  setup.color->T_color_depth.linear() *= 2;
  EXPECT_NE(refusal_of([&] { sdftrack::Tracker(shape, kCamera, setup); }).find("T_color_depth"),
            std::string::npos);
}

TEST(Face, a_click_on_the_object_finds_it_and_one_beside_it_says_what_is_there) {
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  const std::vector<std::uint16_t> image = image_mm(shape, pose());
  sdftrack::Frame frame;
  frame.depth = image.data();
  sdftrack::Tracker tracker(shape, kCamera);
  const Eigen::Vector3d middle = pose() * Eigen::Vector3d(0.03, 0.02, 0.025);
  sdftrack::Place on, beside, outside;
  on.click_px = {kCamera.fx * middle.x() / middle.z() + kCamera.cx,
                 kCamera.fy * middle.y() / middle.z() + kCamera.cy};
  const sdftrack::TrackedPose found = tracker.start(frame, on).objects.front();
  ASSERT_NE(found.status, sdftrack::Status::kLost) << found.reason;
  EXPECT_LT((found.T_cam_obj.translation() - pose().translation()).norm(), 0.003);
  beside.click_px = {3, 3}, outside.click_px = {kCamera.width, 3};
  EXPECT_NE(refusal_of([&] { tracker.start(frame, beside); }).find("clicks[0]: expected a depth measurement"),
            std::string::npos);
  EXPECT_NE(refusal_of([&] { tracker.start(frame, outside); }).find("160 x 120 depth image"),
            std::string::npos);
}

TEST(Face, a_mask_of_another_size_than_the_mesh_names_the_unit) {
  sdftrack::ShapeOptions mm = coarse();
  mm.unit_m = 0.2;
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  const Shape small = Shape::from_mesh(vertices(), faces(), mm);
  const std::vector<std::uint16_t> image = image_mm(shape, pose());
  std::vector<std::uint8_t> mask;
  for (const std::uint16_t z : image) mask.push_back(z != 0);
  sdftrack::Frame frame, metres;
  frame.depth = metres.depth = image.data(), metres.depth_unit_m = 1;
  sdftrack::Place place;
  place.mask = mask.data();
  const std::string said = sdftrack::Tracker(small, kCamera).start(frame, place).objects.front().reason;
  EXPECT_NE(said.find("is the depth in 1/5000 m"), std::string::npos) << said;
  sdftrack::Tracker tracker(shape, kCamera);
  EXPECT_NE(refusal_of([&] { tracker.start(metres, place); }).find("masks[0]: expected the object, "),
            std::string::npos);
}

TEST(Face, of_equivalent_poses_the_one_nearest_to_the_cameras_axes_is_found) {
  Shape::Vertices corners(3, 8);
  for (int i = 0; i < 8; ++i)
    corners.col(i) << (i & 1 ? 0.06 : -0.06), (i & 2 ? 0.03 : -0.03), (i & 4 ? 0.02 : -0.02);
  Shape::Faces sides(3, 12);
  sides << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,       //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  const Shape box = Shape::from_mesh(corners, sides, coarse());
  Eigen::Isometry3d T(Eigen::Translation3d(0.01, 0, 0.5));
  T.rotate(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 0.4, 0).normalized()) *
           Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  sdftrack::ShapeSymmetry halves;
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)})
    halves.discrete.emplace_back(Eigen::AngleAxisd(M_PI, axis));
  sdftrack::Tracker tracker(box, kCamera);
  EXPECT_NE(refusal_of([&] { tracker.declare_symmetry(1, halves); }).find("0..0"), std::string::npos);
  EXPECT_NE(refusal_of([&] {
              tracker.declare_symmetry(0, {{}, {{{0, 0, 0}, {0, 0, 0}}}});
            }).find("axes"),
            std::string::npos);
  tracker.declare_symmetry(0, halves);
  const std::vector<std::uint16_t> image = image_mm(box, T);
  sdftrack::Frame frame;
  frame.depth = image.data();
  std::vector<std::uint8_t> mask;
  for (const std::uint16_t z : image) mask.push_back(z != 0);
  sdftrack::Place place;
  place.mask = mask.data();
  const sdftrack::TrackedPose found = tracker.start(frame, place).objects.front();
  ASSERT_NE(found.status, sdftrack::Status::kLost) << found.reason;
  for (const Eigen::Isometry3d& S : halves.discrete)
    EXPECT_GT(found.T_cam_obj.linear().trace(), (found.T_cam_obj * S).linear().trace());
  EXPECT_LT((found.T_cam_obj.translation() - T.translation()).norm(), 0.002);
}

TEST(Face, what_cannot_be_meant_is_refused_and_changes_nothing) {
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  const std::vector<std::uint16_t> image = image_mm(shape, pose());
  sdftrack::Frame frame;
  frame.depth = image.data();
  sdftrack::Tracker tracker(shape, kCamera);
  EXPECT_NE(refusal_of([&] { tracker.track(frame); }).find("call start first"), std::string::npos);
  tracker.start(frame, pose());
  const std::vector<std::uint8_t> nothing(image.size(), 0);
  sdftrack::Place masked, boxed, scaled;
  masked.mask = nothing.data();
  boxed.box = {100, 100, 61, 10};
  scaled.T_cam_obj = pose();
  scaled.T_cam_obj->linear() *= 1.2;
  for (const sdftrack::Place& place : {masked, boxed, scaled})
    EXPECT_NE(refusal_of([&] { tracker.start(frame, place); }).find("expected"), std::string::npos);
  EXPECT_NE(refusal_of([&] {
              tracker.start(frame, {masked, boxed});
            }).find("one per shape (1), got 2"),
            std::string::npos);
  EXPECT_EQ(tracker.track(frame).index, 1);
  const auto with = [&](std::string name, sdftrack::OptionSetting value) {
    sdftrack::TrackerSetup setup;
    setup.options = {{std::move(name), std::move(value)}};
    return refusal_of([&] { sdftrack::Tracker(shape, kCamera, setup); });
  };
  EXPECT_EQ(with("max_pixel", 5), "max_pixel: no such option of a tracker");
  EXPECT_EQ(with("max_pixels", true), "max_pixels: expected a number");
  EXPECT_NE(with("residual", "nearest").find("ray_hit"), std::string::npos);
  EXPECT_NE(with("noise_m", -1.0).find("noise_m: expected"), std::string::npos);
  sdftrack::TrackerSetup setup;
  setup.sensor = "kinect";
  EXPECT_NE(refusal_of([&] { sdftrack::Tracker(shape, kCamera, setup); }).find("kinect_v1"),
            std::string::npos);
  EXPECT_NE(refusal_of([&] { sdftrack::Tracker(shape, {}, {}); }).find("camera: expected"),
            std::string::npos);
}

TEST(Face, an_unknown_object_becomes_a_mesh_that_lies_on_the_object) {
  const Shape shape = Shape::from_mesh(vertices(), faces(), coarse());
  sdftrack::ReconstructorSetup setup;
  setup.voxels = 64, setup.options = {{"planes", false}};
  sdftrack::Reconstructor reconstructor(kCamera, setup);
  EXPECT_NE(refusal_of([&] { reconstructor.mesh(); }).find("mesh: call start first"), std::string::npos);
  const std::vector<std::uint16_t> first = image_mm(shape, pose());
  std::vector<std::uint8_t> mask;
  for (const std::uint16_t z : first) mask.push_back(z != 0);
  sdftrack::Frame frame;
  frame.depth = first.data();
  sdftrack::Place place;
  EXPECT_NE(refusal_of([&] { reconstructor.start(frame, place); }).find("one of mask, box and pose"),
            std::string::npos);
  place.mask = mask.data();
  const Eigen::Isometry3d T_first = reconstructor.start(frame, place).pose.T_cam_obj;
  for (int i = 1; i < 6; ++i) {
    Eigen::Isometry3d T = pose();
    T.rotate(Eigen::AngleAxisd(0.04 * i, Eigen::Vector3d::UnitY()));
    const std::vector<std::uint16_t> image = image_mm(shape, T);
    frame.depth = image.data();
    const sdftrack::ReconstructionResult& found = reconstructor.track(frame);
    EXPECT_EQ(found.index, i);
    const Eigen::Isometry3d moved = found.pose.T_cam_obj * T_first.inverse(), truth = T * pose().inverse();
    EXPECT_LT((moved.inverse() * truth).translation().norm(), 0.01) << found.pose.reason;
  }
  const sdftrack::ReconstructedMesh mesh = reconstructor.mesh();
  const Eigen::Isometry3d to_truth = pose().inverse() * T_first;
  int seen = 0;
  double off_m = 0;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.seen[i] >= 0.5f)
      ++seen, off_m += std::abs(shape.distance_m(to_truth * Eigen::Vector3d(mesh.vertices.col(i))));
  ASSERT_GT(seen, 200);
  EXPECT_LT(off_m / seen, 0.002);
  EXPECT_EQ(mesh.rgb.cols(), 0);
  EXPECT_LT(mesh.faces.maxCoeff(), mesh.vertices.cols());
  sdftrack::Tracker tracker(reconstructor.shape(), kCamera);
  frame.depth = first.data();
  EXPECT_NE(tracker.start(frame, T_first).objects.front().status, sdftrack::Status::kLost);
}

TEST(Face, what_a_reconstructor_cannot_do_is_refused) {
  const auto with = [](std::string name, sdftrack::OptionSetting value) {
    sdftrack::ReconstructorSetup setup;
    setup.options = {{std::move(name), std::move(value)}};
    return refusal_of([&] { sdftrack::Reconstructor(kCamera, setup); });
  };
  EXPECT_EQ(with("min_see", 1), "min_see: no such option of a reconstructor");
  EXPECT_NE(with("memory", -1.0).find("memory: expected"), std::string::npos);
  EXPECT_NE(with("evolution", std::string("printed")).find("expected 'ours'"), std::string::npos);
  sdftrack::ReconstructorSetup setup;
  setup.voxels = 8;
  EXPECT_NE(refusal_of([&] { sdftrack::Reconstructor(kCamera, setup); }).find("16 to 512"),
            std::string::npos);
  setup.voxels = 64, setup.extent_m = -1;
  EXPECT_NE(refusal_of([&] { sdftrack::Reconstructor(kCamera, setup); }).find("extent_m"), std::string::npos);
}

}  // namespace
