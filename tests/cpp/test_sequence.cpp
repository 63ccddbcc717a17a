// SPDX-License-Identifier: MIT
// The reader of BOP scenes: what it refuses, and which file the error names. same_answers.py compares what it
// reads with Python.
#ifdef SDFTRACK_WITH_IO
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include "sdftrack/sequence.h"

namespace {

namespace fs = std::filesystem;
using sdftrack::Sequence;

// A scene of one depth image of 3 x 2 pixels; its folder is removed with it.
class BopScene : public ::testing::Test {
 protected:
  BopScene() : folder_(fs::temp_directory_path() / ("sdftrack_scene_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_ / "depth");
    write("scene_camera.json",
          R"({"7": {"cam_K": [500, 0, 1, 0, 501, 2, 0, 0, 1], "depth_scale": 0.1, "timestamp": 2.5}})");
    // A PGM image of 16 bits, which OpenCV recognises by its first bytes whatever the name is.
    write("depth/000007.png",
          std::string("P5 3 2 65535\n") + std::string("\x03\xe8\0\0\0\0\0\0\0\0\0\0", 12));
  }
  ~BopScene() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string refusal() const {
    try {
      Sequence{folder_};
      return "";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }
  void expect_refusal(const std::string& part) const {
    EXPECT_NE(refusal().find(part), std::string::npos) << refusal();
  }

  fs::path folder_;
};

TEST_F(BopScene, IsReadWithItsCameraUnitTimeAndNumber) {
  write("scene_gt.json",
        R"({"7": [{"obj_id": 3, "cam_R_m2c": [0,-1,0, 1,0,0, 0,0,1], "cam_t_m2c": [10, 20, 500]}]})");
  Sequence scene(folder_);
  ASSERT_EQ(scene.size(), 1);
  EXPECT_EQ(scene.id(0), 7);
  EXPECT_EQ(scene.camera().width, 3);
  EXPECT_EQ(scene.camera().height, 2);
  EXPECT_EQ(scene.camera().fy, 501);
  EXPECT_EQ(scene.camera().cy, 2);
  const sdftrack::Frame frame = scene.frame(0);
  EXPECT_EQ(frame.depth[0], 1000);
  EXPECT_DOUBLE_EQ(frame.depth_unit_m, 1e-4);
  EXPECT_EQ(frame.time_s, 2.5);
  EXPECT_EQ(frame.rgb, nullptr);
  ASSERT_EQ(scene.instances(0).size(), 1u);
  EXPECT_EQ(scene.instances(0)[0].object, 3);
  EXPECT_TRUE(scene.instances(0)[0].T_cam_obj.translation().isApprox(Eigen::Vector3d(0.01, 0.02, 0.5)));
  EXPECT_EQ(scene.instances(0)[0].T_cam_obj.linear()(1, 0), 1);
  EXPECT_TRUE(scene.mask(0, 0).empty());
  EXPECT_THROW(scene.model_file(3), std::invalid_argument);
  EXPECT_THROW(scene.frame(1), std::invalid_argument);
}

TEST_F(BopScene, NamesTheFileThatSaysSomethingElse) {
  write("depth/000007.png", "P5 3 2 255\nabcdef");
  expect_refusal("depth: expected depth images of 16 bits");
  for (const char* text : {"", "{\"7\": {", "[1, 2]", "7"}) {
    write("scene_camera.json", text);
    expect_refusal("scene_camera.json");
  }
  write("scene_camera.json", R"({"first": {"cam_K": [1, 0, 0, 0, 1, 0, 0, 0, 1]}})");
  expect_refusal("expected image numbers as keys, got 'first'");
  write("scene_camera.json", R"({"7": {"cam_K": [500, 0, 1, 0, 501]}})");
  expect_refusal("image 7: cam_K: expected 9 numbers");
  write("scene_camera.json", R"({"7": {"cam_K": [500, 0, 1, 0, 501, 2, 0, 0, 1], "depth_scale": -1}})");
  expect_refusal("depth_scale: expected mm per unit, above 0");
  fs::remove(folder_ / "scene_camera.json");
  expect_refusal("scene_camera.json: expected a BOP scene");
}

TEST_F(BopScene, RefusesPosesThatAreNone) {
  write("scene_gt.json",
        R"({"7": [{"obj_id": 3, "cam_R_m2c": [2,0,0, 0,2,0, 0,0,2], "cam_t_m2c": [0,0,500]}]})");
  expect_refusal("cam_R_m2c: expected a rotation");
  write("scene_gt.json", R"({"7": [{"obj_id": 3, "cam_R_m2c": [1,0,0, 0,1,0, 0,0,1], "cam_t_m2c": [0,0]}]})");
  expect_refusal("cam_t_m2c: expected 3 numbers");
  write("scene_gt.json", R"({"7": 3})");
  expect_refusal("scene_gt.json, image 7: expected a list");
}

TEST_F(BopScene, AnImageThatCannotBeReadCostsItsFrameOnly) {
  write(
      "scene_camera.json",
      R"({"7": {"cam_K": [500, 0, 1, 0, 501, 2, 0, 0, 1]}, "8": {"cam_K": [500, 0, 1, 0, 501, 2, 0, 0, 1]}})");
  Sequence scene(folder_);
  ASSERT_EQ(scene.size(), 2);
  EXPECT_NE(scene.frame(0).depth, nullptr);
  EXPECT_EQ(scene.frame(1).depth, nullptr);
  EXPECT_TRUE(std::isnan(scene.frame(1).time_s));
}

}  // namespace
#endif
