// SPDX-License-Identifier: MIT
#include "sdftrack/sequence.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "sdf/mesh/mesh_file.h"

namespace sdftrack {

namespace {

namespace fs = std::filesystem;

constexpr double kMetresPerMm = 1e-3;
constexpr double kRotationError = 1e-2;  // what is more is a scale or a mirror

[[noreturn]] void refuse(const fs::path& file, const std::string& what) {
  throw std::invalid_argument(file.string() + ": " + what);
}

// Calls one(number, node) for each member of a JSON object with image numbers as keys.
template <class One>
void for_each_image(const fs::path& file, One one) {
  if (!fs::is_regular_file(file)) refuse(file, "expected a BOP scene with this file, got none");
  const std::string text = sdf::bytes_of(file.string());
  try {
    const cv::FileStorage json(
        text, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_JSON);
    for (const cv::FileNode node : json.root()) {
      const std::string key = node.name();
      int number = 0;
      const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
      if (error != std::errc() || end != key.data() + key.size() || number < 0)
        refuse(file, "expected image numbers as keys, got '" + key + "'");
      one(number, node);
    }
  } catch (const cv::Exception& error) {
    refuse(file, "expected JSON: " + error.err);
  }
}

std::vector<double> numbers_of(const cv::FileNode& node, std::size_t count, const std::string& where) {
  std::vector<double> out;
  if (node.isSeq())
    for (const cv::FileNode one : node)
      if (one.isReal() || one.isInt()) out.push_back(double(one));
  if (out.size() != count || !std::all_of(out.begin(), out.end(), [](double v) { return std::isfinite(v); }))
    throw std::invalid_argument(where + ": expected " + std::to_string(count) + " numbers");
  return out;
}

std::string image_name(int number) {
  char digits[16];
  std::snprintf(digits, sizeof digits, "%06d", number);
  return digits;
}

fs::path first_existing(const fs::path& folder, const std::string& stem) {
  for (const char* suffix : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"})
    if (fs::path file = folder / (stem + suffix); fs::is_regular_file(file)) return file;
  return {};
}

// Empty where the file is missing, is damaged or holds another kind of image.
cv::Mat image_in(const fs::path& file, int flags) {
  if (file.empty()) return {};
  try {
    return cv::imread(file.string(), flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

Instance instance_of(const cv::FileNode& node, const std::string& where) {
  if (!node.isMap() || !node["obj_id"].isInt())
    throw std::invalid_argument(where + ": expected obj_id, cam_R_m2c and cam_t_m2c");
  const std::vector<double> R = numbers_of(node["cam_R_m2c"], 9, where + ": cam_R_m2c");
  const std::vector<double> t_mm = numbers_of(node["cam_t_m2c"], 3, where + ": cam_t_m2c");
  const Eigen::Matrix3d given = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
  if (given.determinant() < 0 ||
      (given.transpose() * given - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRotationError)
    throw std::invalid_argument(where + ": cam_R_m2c: expected a rotation, row by row");
  Instance out;
  out.object = int(node["obj_id"]);
  out.T_cam_obj.linear() = given;
  out.T_cam_obj.translation() = kMetresPerMm * Eigen::Map<const Eigen::Vector3d>(t_mm.data());
  return out;
}

}  // namespace

struct Sequence::Scene {
  struct Image {
    int id;
    double unit_m, time_s;
    std::vector<Instance> instances;
  };

  explicit Scene(const fs::path& scene_folder) : folder(scene_folder) {
    read_cameras();
    if (fs::is_regular_file(folder / "scene_gt.json")) read_instances();
    measure();
  }

  void read_cameras() {
    const fs::path file = folder / "scene_camera.json";
    std::map<int, Image> found;
    for_each_image(file, [&](int id, const cv::FileNode& node) {
      const std::string where = file.string() + ", image " + std::to_string(id);
      if (!node.isMap()) throw std::invalid_argument(where + ": expected an object with cam_K");
      const std::vector<double> K = numbers_of(node["cam_K"], 9, where + ": cam_K");
      const double mm = node["depth_scale"].empty() ? 1.0 : double(node["depth_scale"]);
      if (!(mm > 0)) throw std::invalid_argument(where + ": depth_scale: expected mm per unit, above 0");
      if (found.empty()) own_camera = {0, 0, K[0], K[4], K[2], K[5], {}};
      if (K[0] != own_camera.fx || K[4] != own_camera.fy || K[2] != own_camera.cx || K[5] != own_camera.cy)
        throw std::invalid_argument(where + ": cam_K: expected that of the first image, got another camera");
      const cv::FileNode time = node["timestamp"];  // an addition to BOP's files
      const double time_s = time.empty() ? std::numeric_limits<double>::quiet_NaN() : double(time);
      found[id] = {id, kMetresPerMm * mm, time_s, {}};
    });
    for (auto& [id, image] : found) images.push_back(std::move(image));
    if (images.empty()) refuse(file, "expected at least one image, got none");
  }

  void read_instances() {
    const fs::path file = folder / "scene_gt.json";
    for_each_image(file, [&](int id, const cv::FileNode& list) {
      const auto image =
          std::find_if(images.begin(), images.end(), [&](const Image& i) { return i.id == id; });
      if (image == images.end()) return;
      const std::string where = file.string() + ", image " + std::to_string(id);
      if (!list.isSeq()) throw std::invalid_argument(where + ": expected a list");
      for (const cv::FileNode one : list) image->instances.push_back(instance_of(one, where));
    });
  }

  // The size of the camera is that of the first depth image that can be read.
  void measure() {
    for (const Image& image : images)
      if (const cv::Mat first = depth_of(image); !first.empty()) {
        own_camera.width = first.cols, own_camera.height = first.rows;
        return;
      }
    refuse(folder / "depth", "expected depth images of 16 bits in one channel, got none that can be read");
  }

  cv::Mat depth_of(const Image& image) const {
    const cv::Mat read =
        image_in(first_existing(folder / "depth", image_name(image.id)), cv::IMREAD_UNCHANGED);
    return read.type() == CV_16UC1 ? read : cv::Mat();
  }

  bool of_the_camera(const cv::Mat& image) const {
    return image.cols == own_camera.width && image.rows == own_camera.height;
  }

  const Image& image(int i) const {
    if (i < 0 || i >= int(images.size()))
      throw std::invalid_argument("image: expected 0.." + std::to_string(images.size() - 1) + ", got " +
                                  std::to_string(i));
    return images[i];
  }

  Frame frame(int i) {
    const Image& now = image(i);
    Frame out;
    out.time_s = now.time_s;
    depth = depth_of(now);
    if (depth.empty() || !of_the_camera(depth)) return out;
    out.depth = depth.ptr<std::uint16_t>(), out.depth_unit_m = now.unit_m;
    fs::path file = first_existing(folder / "rgb", image_name(now.id));
    if (file.empty()) file = first_existing(folder / "gray", image_name(now.id));
    rgb = image_in(file, cv::IMREAD_COLOR);
    if (rgb.empty() || !of_the_camera(rgb)) return out;
    cv::cvtColor(rgb, rgb, cv::COLOR_BGR2RGB);
    out.rgb = rgb.ptr<std::uint8_t>();
    return out;
  }

  fs::path folder;
  DepthCamera own_camera;
  std::vector<Image> images;
  cv::Mat depth, rgb;  // of the last frame
};

Sequence::Sequence(const fs::path& scene_folder) : scene_(std::make_unique<Scene>(scene_folder)) {}
Sequence::Sequence(Sequence&&) noexcept = default;
Sequence& Sequence::operator=(Sequence&&) noexcept = default;
Sequence::~Sequence() = default;

int Sequence::size() const { return int(scene_->images.size()); }
const DepthCamera& Sequence::camera() const { return scene_->own_camera; }
int Sequence::id(int i) const { return scene_->image(i).id; }
Frame Sequence::frame(int i) { return scene_->frame(i); }
const std::vector<Instance>& Sequence::instances(int i) const { return scene_->image(i).instances; }

std::vector<std::uint8_t> Sequence::mask(int i, int instance) const {
  const std::string stem = image_name(id(i)) + "_" + image_name(instance);
  for (const char* folder : {"mask_visib", "mask"}) {
    const cv::Mat read = image_in(first_existing(scene_->folder / folder, stem), cv::IMREAD_GRAYSCALE);
    if (!read.empty() && scene_->of_the_camera(read))
      return {read.ptr<std::uint8_t>(), read.ptr<std::uint8_t>() + read.total()};
  }
  return {};
}

fs::path Sequence::model_file(int object) const {
  const fs::path scene = fs::absolute(scene_->folder).lexically_normal();
  const fs::path name = "obj_" + image_name(object) + ".ply";
  // Beside the scene, or beside its split as in a whole data set.
  for (const fs::path& parent : {scene, scene.parent_path(), scene.parent_path().parent_path()})
    if (fs::path file = parent / "models" / name; fs::is_regular_file(file)) return file;
  refuse(scene / "models" / name, "expected the mesh of this object there or beside the scene, got none");
}

}  // namespace sdftrack
