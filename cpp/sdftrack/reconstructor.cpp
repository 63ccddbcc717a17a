// SPDX-License-Identifier: MIT
#include "sdftrack/reconstructor.h"

#include <algorithm>
#include <stdexcept>

#include "reconstruction/option_schema.h"
#include "reconstruction/session/session.h"
#include "reconstruction/surface.h"
#include "sdf/solids.h"
#include "sdftrack/conversion.h"
#include "sdftrack/shape_volume.h"
#include "tracking/options/option_schema.h"

namespace sdftrack {

namespace {

constexpr int kMinSide = 16, kStandInVoxels = 24;
constexpr double kMaxExtent_m = 10;

// A tracker's volume until the session gives it another one: it only says where the object's middle is.
sdf::MeshVolume stand_in(double radius_m) {
  sdf::MeshVolume out;
  const Vec3d corner{radius_m, radius_m, radius_m};
  out.grid = sdf::grid_around(-corner, corner, kStandInVoxels, std::nullopt);
  for (int z = 0; z < out.grid.nz; ++z)
    for (int y = 0; y < out.grid.ny; ++y)
      for (int x = 0; x < out.grid.nx; ++x)
        out.phi.push_back(float(sdf::sphere_sample(out.grid.point(x, y, z), radius_m).phi_m));
  return out;
}

reconstruction::ReconstructionOptions reconstruction_options(const ReconstructorSetup& setup) {
  reconstruction::ReconstructionOptions options;
  set_options(setup.options, "a reconstructor", &options);
  if (options.evolved) throw std::invalid_argument("evolution: expected 'ours', got 'printed'");
  return check_options(options);
}

tracking::TrackerOptions inner_options(const ReconstructorSetup& setup) {
  tracking::TrackerOptions options;
  options.outline = options.smooth_colors = false;
  set_options(setup.tracker_options, "a tracker", &options);
  return check_options(options);
}

}  // namespace

class Reconstructor::Session {
 public:
  Session(const DepthCamera& camera, std::optional<Shape> initial, const ReconstructorSetup& setup)
      : camera_(camera_of(camera)),
        frames_(camera, setup.color),
        initial_(std::move(initial)),
        options_(reconstruction_options(setup)),
        tracker_options_(inner_options(setup)) {
    if (setup.voxels < kMinSide || setup.voxels > reconstruction::GrowingVolume::kMaxVoxels)
      throw std::invalid_argument("voxels: expected 16 to 512, got " + std::to_string(setup.voxels));
    if (setup.extent_m != 0 && !(setup.extent_m > 0 && setup.extent_m < kMaxExtent_m))
      throw std::invalid_argument("extent_m: expected metres between 0 and 10");
    settings_.voxels = setup.voxels, settings_.threads = setup.threads;
    if (setup.extent_m != 0) settings_.side_m = setup.extent_m;
    beginning_.planes = options_.planes, beginning_.keep_to_mask = options_.keep_to_mask;
    beginning_.mask_margin_px = options_.mask_margin_px;
    beginning_.noise_m = options_.noise_m;
    if (initial_) {
      const sdf::MeshVolume& mesh = initial_->volume_->mesh;
      known_ = reconstruction::KnownShape{mesh.grid, mesh.phi.data()};
    }
  }

  const ReconstructionResult& start(const Frame& frame, const Place& place) {
    if (place.T_cam_obj.has_value() + (place.mask != nullptr) + place.box.has_value() != 1)
      throw std::invalid_argument("place: expected one of mask, box and pose");
    if (place.T_cam_obj && !initial_)
      throw std::invalid_argument("place: expected a mask or a box, got a pose, but no initial shape");
    const frame::DepthFrame depth = frames_.depth_of(frame, camera_);
    if (!depth.depth_m.data)
      throw std::invalid_argument("frame: expected a depth image at the start, got none");
    const reconstruction::Beginning found = reconstruction::find_object(
        depth, hint_of(place, camera_), camera_, known_ ? &*known_ : nullptr, beginning_);
    auto session = std::make_unique<reconstruction::Session>(camera_, options_, settings_, known_, found);
    sdf::MeshVolume stand = known_ ? sdf::MeshVolume{} : stand_in(found.ball.radius_m);
    const SdfView view = known_ ? known_->view() : stand.view();
    auto tracker = std::make_unique<tracking::Tracker>(std::vector<SdfView>{view}, camera_,
                                                       session->tracker_options(tracker_options_),
                                                       tracking::TrackerSettings{settings_.threads});
    session->start(tracker.get(), frames_.read(frame, *tracker));
    tracker_ = std::move(tracker), core_ = std::move(session), stand_in_ = std::move(stand);
    return converted();
  }

  const ReconstructionResult& track(const Frame& frame) {
    started("track").track(frames_.read(frame, *tracker_));
    return converted();
  }

  Shape shape() const {
    const reconstruction::Reconstruction& core = *started("shape").volume().core();
    sdf::MeshVolume out;
    out.grid = core.grid();
    out.phi.assign(core.phi().begin(), core.phi().end());
    return Shape(std::make_shared<const Shape::Volume>(Shape::Volume{std::move(out)}));
  }

  ReconstructedMesh mesh() const {
    const reconstruction::SurfaceMesh found =
        reconstruction::surface_mesh(*started("mesh").volume().core(), settings_.threads);
    ReconstructedMesh out;
    out.vertices.resize(3, static_cast<Eigen::Index>(found.vertices.size()));
    for (Eigen::Index i = 0; i < out.vertices.cols(); ++i) {
      const Vec3d& v = found.vertices[i];
      out.vertices.col(i) << v.x, v.y, v.z;
    }
    const auto columns = [](std::size_t numbers) { return static_cast<Eigen::Index>(numbers / 3); };
    out.faces = Eigen::Map<const Shape::Faces>(found.faces.data(), 3, columns(found.faces.size()));
    out.rgb = Eigen::Map<const Eigen::Matrix<std::uint8_t, 3, Eigen::Dynamic>>(found.rgb.data(), 3,
                                                                               columns(found.rgb.size()));
    out.seen = Eigen::Map<const Eigen::VectorXf>(found.seen.data(), out.vertices.cols());
    return out;
  }

 private:
  reconstruction::Session& started(const char* what) const {
    if (!core_) throw std::logic_error(std::string(what) + ": call start first");
    return *core_;
  }

  const ReconstructionResult& converted() {
    const reconstruction::SessionResult& found = core_->result();
    result_.pose = pose_of(found.tracked.objects.front());
    result_.index = found.tracked.index, result_.time_s = found.tracked.time_s;
    result_.shape_change_m = found.change_m;
    return result_;
  }

  Camera camera_;
  FrameReader frames_;
  std::optional<Shape> initial_;
  std::optional<reconstruction::KnownShape> known_;  // what `initial_` holds
  reconstruction::ReconstructionOptions options_;
  tracking::TrackerOptions tracker_options_;
  reconstruction::SessionSettings settings_;
  reconstruction::BeginningOptions beginning_;
  sdf::MeshVolume stand_in_;  // before the tracker, which borrows it
  std::unique_ptr<tracking::Tracker> tracker_;
  std::unique_ptr<reconstruction::Session> core_;
  ReconstructionResult result_;
};

Reconstructor::Reconstructor(const DepthCamera& camera, const ReconstructorSetup& setup)
    : session_(std::make_unique<Session>(camera, std::nullopt, setup)) {}
Reconstructor::Reconstructor(const DepthCamera& camera, Shape initial, const ReconstructorSetup& setup)
    : session_(std::make_unique<Session>(camera, std::move(initial), setup)) {}
Reconstructor::Reconstructor(Reconstructor&&) noexcept = default;
Reconstructor& Reconstructor::operator=(Reconstructor&&) noexcept = default;
Reconstructor::~Reconstructor() = default;

const ReconstructionResult& Reconstructor::start(const Frame& frame, const Place& place) {
  return session_->start(frame, place);
}
const ReconstructionResult& Reconstructor::track(const Frame& frame) { return session_->track(frame); }
Shape Reconstructor::shape() const { return session_->shape(); }
ReconstructedMesh Reconstructor::mesh() const { return session_->mesh(); }

}  // namespace sdftrack
