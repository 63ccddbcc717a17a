"""
Private core of sdftrack; use the names of the package sdftrack.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import typing
__all__: list[str] = ['BALL_BAND_PX', 'BallColor', 'BallFinder', 'BallOutline', 'BallRecording', 'Beginning', 'BorrowedArray', 'Calibration', 'Camera', 'Collision', 'ColorMap', 'ContourCore', 'ContourFrame', 'ContourObservation', 'ContourOptions', 'DepthBall', 'DepthToColor', 'DeviceArray', 'EVIDENCE_BIAS', 'EVIDENCE_MOST_INSTABILITY', 'EVIDENCE_MOST_SHARED', 'EVIDENCE_SURE', 'EVIDENCE_WEIGHTS', 'EvidenceGatherer', 'EvolveOptions', 'FrameEnergy', 'GrowingVolume', 'ImageNoise', 'IntrinsicsOptions', 'Keyframe', 'Keyframes', 'Lens', 'LmOptions', 'LwprModel', 'LwprOptions', 'MAX_VOXELS', 'MIN_BALL_RADIUS_PX', 'MemoryOptions', 'MeshCaster', 'MotionModel', 'ObservedFrame', 'OcclusionHandler', 'PrimitiveFitOptions', 'PrimitiveKind', 'PrimitiveView', 'Reconstruction', 'ReconstructionOptions', 'ReconstructionSession', 'Residual', 'SYMMETRY_STEPS', 'Scaling', 'Searcher', 'ShapeJudgement', 'SilhouetteMemory', 'SingleFitter', 'SlicOptions', 'SlicWork', 'State', 'Tracker', 'TrackerFrame', 'TrackerOptions', 'band_deviations', 'band_factor', 'band_solve', 'build', 'canonical_pose', 'connected_region', 'contour_first_instability', 'contour_harmonic_numbers', 'contour_harmonics', 'contour_posterior', 'contour_series', 'contour_steps', 'contour_verdict', 'contour_with_hidden', 'copy_from_cuda', 'copy_from_dlpack', 'correlation_area', 'correlation_length', 'cuda_build', 'cuda_device_name', 'cuda_devices', 'cuda_fingerprint', 'cuda_least_capability', 'decompose_map', 'depth_metres', 'evolve', 'find_object', 'find_outlines', 'find_standing', 'fit_color_map', 'fit_growth', 'fit_noise', 'fit_plane', 'grid_around', 'isa', 'isas', 'mesh_to_sdf', 'mesh_volume', 'moving_color', 'nearest_rigid', 'new_volume_id', 'paint', 'plane_noise', 'primitive_clearance', 'primitive_distances', 'primitive_kinds', 'primitive_reach', 'primitive_sdf', 'redistance', 'remove_plane', 'render_sdf', 'rotation_exp', 'rotation_log', 'rotations_of_curve', 'sample_sdf', 'scale_and_add', 'seed_rotation', 'sensor_presets', 'slic', 'slic_there', 'span_is_wide', 'spline_values', 'surface_noise', 'surface_samples', 'symmetry_motions', 'thread_count', 'too_small_radius_px', 'without_lattice', 'zero_mesh']
class BallColor:
    """
    Chromaticity model of a ball.
    """
    def __init__(self, color: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    def learn(self, colors: collections.abc.Sequence[numpy.ndarray], camera: Camera, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Relearns the model inside the outlines found with it.
        """
    def mask(self, color: numpy.ndarray) -> numpy.typing.NDArray[numpy.uint8]:
        """
        (h, w) uint8: pixels more likely the ball's than not.
        """
    @property
    def color(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class BallFinder:
    """
    Finds a ball of known radius in depth images.
    """
    def __init__(self, camera: Camera, radius_m: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def fit(self, depth: numpy.ndarray, start_cam: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> typing.Any:
        """
        A DepthBall near a start (m); None where the measurements are not of a ball.
        """
    def search(self, depth: numpy.ndarray, given: typing.Any = None) -> list[DepthBall]:
        """
        The most completely visible first.
        """
class BallOutline:
    """
    A ball's outline in a colour image.
    """
    def center(self, camera: Camera) -> typing.Any:
        """
        Image of the ball's centre (px) and its covariance; None where the edges make no cone.
        """
    @property
    def edges_px(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def radius_px(self) -> float:
        ...
    @property
    def rms_px(self) -> float:
        ...
class BallRecording:
    """
    The ball in the frames of a recording.
    """
    def __init__(self) -> None:
        ...
    def add(self, frame: ObservedFrame) -> None:
        ...
    def pairs(self, color: Camera) -> dict:
        ...
    def registered(self, color: Camera, known: bool, time_offset: bool, seed: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def sort_moving_first(self, radius_m: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def frames(self) -> list[ObservedFrame]:
        ...
class Beginning:
    """
    What the first frame of a recording shows of an unknown object.
    """
    def __init__(self, T_cam_obj: numpy.ndarray, on_object: numpy.ndarray, centre_cam: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], radius_m: typing.SupportsFloat | typing.SupportsIndex, behind_m: typing.SupportsFloat | typing.SupportsIndex, shorter_m: typing.SupportsFloat | typing.SupportsIndex, noise_m: typing.SupportsFloat | typing.SupportsIndex, from_m: numpy.ndarray | None = None, planes: numpy.ndarray | None = None, outline: numpy.ndarray | None = None) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def at_pose(self, T_cam_obj: numpy.ndarray) -> Beginning:
        """
        The same with another pose.
        """
    @property
    def T_cam_obj(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def behind_m(self) -> float:
        ...
    @property
    def centre_cam(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
    @property
    def from_m(self) -> numpy.typing.NDArray[numpy.float32] | None:
        ...
    @property
    def noise_m(self) -> float:
        ...
    @property
    def on_object(self) -> numpy.typing.NDArray[numpy.bool]:
        ...
    @property
    def outline(self) -> numpy.typing.NDArray[numpy.bool] | None:
        ...
    @property
    def planes(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
    @property
    def radius_m(self) -> float:
        ...
    @property
    def shorter_m(self) -> float:
        ...
class BorrowedArray:
    """
    An array of another library, by its DLPack capsule.
    """
    def __init__(self, capsule: typing.Any) -> None:
        ...
    @property
    def address(self) -> int:
        ...
    @property
    def contiguous(self) -> bool:
        ...
    @property
    def device(self) -> int:
        ...
    @property
    def dtype(self) -> numpy.dtype[typing.Any]:
        ...
    @property
    def shape(self) -> tuple:
        ...
class Calibration:
    """
    Estimates the intrinsics from frames of a known object.
    """
    lens: Lens
    def __init__(self, volume: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]], lens: Lens, free: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], options: IntrinsicsOptions) -> None:
        ...
    def add(self, depth: numpy.ndarray, mask: typing.Any, T_cam_obj: numpy.ndarray) -> int:
        ...
    def bias(self, seed: typing.SupportsInt | typing.SupportsIndex, pairs: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        ...
    def coverage(self, columns: typing.SupportsInt | typing.SupportsIndex, rows: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int32]:
        ...
    def drop(self, arg0: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None:
        ...
    def examine(self) -> dict:
        ...
    def polish(self) -> tuple:
        ...
    def readings(self, frame: typing.SupportsInt | typing.SupportsIndex) -> dict:
        ...
    def solve(self, scale_m: typing.SupportsFloat | typing.SupportsIndex, prior_value: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], prior_sd: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], quick: bool = False) -> tuple:
        ...
    def solve_each(self) -> dict:
        ...
    @property
    def poses(self) -> list:
        ...
class Camera:
    """
    Pinhole camera with Brown-Conrady distortion; see sdftrack.Camera.
    """
    def __init__(self, fx: typing.SupportsFloat | typing.SupportsIndex, fy: typing.SupportsFloat | typing.SupportsIndex, cx: typing.SupportsFloat | typing.SupportsIndex, cy: typing.SupportsFloat | typing.SupportsIndex, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, distortion: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> None:
        ...
    def project(self, points: numpy.ndarray) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) float64, m, camera frame -> (N, 2) pixels.
        """
    def rays(self) -> numpy.typing.NDArray[numpy.float32]:
        """
        (H, W, 2) float32: x / z and y / z of every pixel's ray, distortion removed.
        """
    @property
    def height(self) -> int:
        ...
    @property
    def width(self) -> int:
        ...
class Collision(enum.Enum):
    """
    Penalty on the penetration of objects.
    """
    contact: typing.ClassVar[Collision]  # value = <Collision.contact: 1>
    none: typing.ClassVar[Collision]  # value = <Collision.none: 0>
    printed: typing.ClassVar[Collision]  # value = <Collision.printed: 2>
class ColorMap:
    """
    Depth pixel to colour pixel; see sdftrack.RGBDCamera.
    """
    @staticmethod
    def aligned(width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex) -> ColorMap:
        ...
    @staticmethod
    def projective(P: numpy.ndarray, q: numpy.ndarray, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex) -> ColorMap:
        ...
    @staticmethod
    def rigid(depth: Camera, color: Camera, T_color_depth: numpy.ndarray) -> ColorMap:
        ...
    def find(self, u_px: typing.SupportsFloat | typing.SupportsIndex, v_px: typing.SupportsFloat | typing.SupportsIndex, depth_m: typing.SupportsFloat | typing.SupportsIndex) -> typing.Any:
        """
        Colour pixel (x, y) of a depth pixel (its lens removed where the rig is rigid), or None.
        """
    @property
    def shape(self) -> tuple[int, int]:
        ...
class ContourCore:
    """
    A contour tracker; use contour.ContourTracker.
    """
    def __init__(self, options: ContourOptions, device: typing.SupportsInt | typing.SupportsIndex = -1) -> None:
        ...
    def finish(self, judgement: ShapeJudgement, recovered: numpy.ndarray | None = None) -> ContourFrame:
        """
        The frame with a memory's judgement, and the whole silhouette where it recovered one.
        """
    def observe(self, image: numpy.ndarray, flow: numpy.ndarray | None = None, x0: typing.SupportsInt | typing.SupportsIndex = 0, y0: typing.SupportsInt | typing.SupportsIndex = 0) -> ContourObservation:
        """
        Where the object is in the next image; nothing is learned yet.
        """
    def posterior_on_grid(self, image: numpy.ndarray) -> numpy.typing.NDArray[numpy.float32]:
        """
        The posterior at every cell of the grid, between observe and finish.
        """
    def set_state(self, state: bytes) -> bool:
        """
        Goes on from such a state; False, and nothing changed, where it is one of another version.
        """
    def start_box(self, image: numpy.ndarray, x0: typing.SupportsInt | typing.SupportsIndex, y0: typing.SupportsInt | typing.SupportsIndex, x1: typing.SupportsInt | typing.SupportsIndex, y1: typing.SupportsInt | typing.SupportsIndex) -> ContourFrame:
        """
        As the option box_start says.
        """
    def start_mask(self, image: numpy.ndarray, mask: numpy.ndarray) -> ContourFrame:
        ...
    def state(self) -> bytes:
        """
        All that the next images depend on, but for the options.
        """
    def track(self, image: numpy.ndarray, flow: numpy.ndarray | None = None, x0: typing.SupportsInt | typing.SupportsIndex = 0, y0: typing.SupportsInt | typing.SupportsIndex = 0) -> ContourFrame:
        """
        A frame without a memory.
        """
    @property
    def options(self) -> ContourOptions:
        ...
class ContourFrame(ContourObservation):
    """
    A frame's result, once it is finished.
    """
    @property
    def mask(self) -> numpy.typing.NDArray[numpy.bool]:
        ...
class ContourObservation:
    """
    Where the object is in an image; nothing is learned yet.
    """
    @property
    def confidence(self) -> float:
        ...
    @property
    def overlap(self) -> float:
        ...
    @property
    def phi(self) -> numpy.typing.NDArray[numpy.float32]:
        ...
    @property
    def reason(self) -> str:
        ...
    @property
    def shared(self) -> float:
        ...
    @property
    def status(self) -> str:
        ...
    @property
    def warp(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class ContourOptions:
    """
    Options of a contour tracker.
    """
    @staticmethod
    def fields() -> dict:
        """
        Each option as a dataclass's field.
        """
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, warp: str = 'similarity', pool: str = 'linear', bins: int = 16, windows: int = 6, shrink: float = 50.0, object_rate: float = 0.02, background_rate: float = 0.2, motion: str = 'flow', confidence: str = 'evidence', max_cells: int = 160, softness: float = 1.5, band: float = 8.0, registration_steps: int = 12, reach: float = 24.0, dt: float = 4.0, mu: float = 0.05, tension: float = 1.0, box_start: str = 'place') -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def replace(self, **changes: typing.Any) -> typing.Self:
        """
        A copy with some options changed.
        """
    def to_dict(self) -> dict:
        """
        ``{name: value}``.
        """
    @property
    def background_rate(self) -> float:
        """
        learning rate of the background's histograms: weight of a new frame
        """
    @property
    def band(self) -> float:
        """
        half width of the narrow band around the contour that is evaluated
        """
    @property
    def bins(self) -> int:
        """
        histogram bins per colour channel, 16 or 32
        """
    @property
    def box_start(self) -> str:
        """
        first segmentation of a box: by its colors alone, or also by the place in the box and the edges of the image
        """
    @property
    def confidence(self) -> str:
        """
        confidence and status: from the colours alone, as in the thesis, or from evidence that was not minimised (optical flow, colours at the start)
        """
    @property
    def dt(self) -> float:
        """
        step size of the level-set evolution
        """
    @property
    def max_cells(self) -> int:
        """
        maximum number of grid cells along the object's longer side; bounds the time per frame
        """
    @property
    def motion(self) -> str:
        """
        second cue of the posterior beside the colours: none, or flow (whether a pixel moves as the object does)
        """
    @property
    def mu(self) -> float:
        """
        weight of the distance regulariser; mu dt <= 0.2
        """
    @property
    def object_rate(self) -> float:
        """
        learning rate of the object's histograms: weight of a new frame
        """
    @property
    def pool(self) -> str:
        """
        opinion pool that updates the colour histograms with each frame: linear or log (logarithmic)
        """
    @property
    def reach(self) -> float:
        """
        search radius for motion between two frames that is too large for Gauss-Newton; 0: no search
        """
    @property
    def registration_steps(self) -> int:
        """
        maximum number of Gauss-Newton iterations per frame
        """
    @property
    def shrink(self) -> float:
        """
        weight of the global histograms in each local one, as a number of pixels
        """
    @property
    def softness(self) -> float:
        """
        width of the smoothed Heaviside step across the contour
        """
    @property
    def tension(self) -> float:
        """
        contour tension; 0: the regulariser as printed, 1: a Laplacian
        """
    @property
    def warp(self) -> str:
        """
        motion model of the grid: similarity (4 parameters) or affine (6)
        """
    @property
    def windows(self) -> int:
        """
        number of local histograms along each side of the grid; 1: one pair of global histograms, as printed
        """
class DepthBall:
    """
    A ball in a depth image.
    """
    @property
    def center_cam(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        ...
    @property
    def noise_m(self) -> float:
        ...
    @property
    def pixels(self) -> int:
        ...
    @property
    def share(self) -> float:
        ...
class DepthToColor:
    """
    A map from points of a depth camera to colour pixels.
    """
    @staticmethod
    def projective(M: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 4]"]) -> DepthToColor:
        ...
    @staticmethod
    def rigid(T_color_depth: numpy.ndarray, color: Camera) -> DepthToColor:
        ...
    def Pq(self, depth: Camera) -> tuple:
        """
        P, q and the derivatives (12, n) of (P row by row, q).
        """
    def predict(self, points: numpy.ndarray) -> tuple:
        """
        Pixels (N, 2) and derivatives by the unknowns (N, 2, n).
        """
    @property
    def M(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 4]"]:
        ...
    @property
    def T_color_depth(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class DeviceArray:
    """
    An array on a CUDA device, C-contiguous. `torch.from_dlpack`, `cupy.from_dlpack` and `jax.dlpack.from_dlpack` take it without a copy; `numpy.asarray` copies it to the host.
    """
    @staticmethod
    def of(array: numpy.ndarray, device: typing.SupportsInt | typing.SupportsIndex) -> DeviceArray:
        """
        A copy of an array of numpy.
        """
    def __array__(self, dtype: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        ...
    def __dlpack__(self, *, stream: typing.Any = None, max_version: typing.Any = None, dl_device: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        ...
    def __dlpack_device__(self) -> tuple[int, int]:
        ...
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    def host(self) -> numpy.ndarray:
        """
        A copy on the host.
        """
    @property
    def __cuda_array_interface__(self) -> dict:
        ...
    @property
    def device(self) -> str:
        ...
    @property
    def dtype(self) -> numpy.dtype[typing.Any]:
        ...
    @property
    def shape(self) -> tuple:
        ...
class EvidenceGatherer:
    """
    Compares each frame's mask with the first, and with the last one moved.
    """
    def __getstate__(self) -> bytes:
        ...
    def __init__(self, image: numpy.ndarray, mask: numpy.ndarray, first_instability: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __setstate__(self, arg0: bytes) -> None:
        ...
    def gather(self, image: numpy.ndarray, mask: numpy.ndarray, shared: typing.SupportsFloat | typing.SupportsIndex = 0.0, flow: numpy.ndarray | None = None, x0: typing.SupportsInt | typing.SupportsIndex = 0, y0: typing.SupportsInt | typing.SupportsIndex = 0) -> typing.Annotated[list[float], "FixedSize(5)"]:
        """
        Evidence about the mask in the next image, given the flow back to the last.
        """
    def skip(self, mask: numpy.ndarray) -> None:
        """
        A frame without an outline.
        """
class EvolveOptions:
    printed: bool
    def __init__(self) -> None:
        ...
    @property
    def dt(self) -> float:
        ...
    @dt.setter
    def dt(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def longest_step(self) -> float:
        ...
    @property
    def sigma_h(self) -> float:
        ...
    @sigma_h.setter
    def sigma_h(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_phi(self) -> float:
        ...
    @sigma_phi.setter
    def sigma_phi(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class FrameEnergy:
    """
    Data energy of one object in one frame; see sdftrack.Energy.
    """
    def __init__(self, volumes: collections.abc.Sequence[tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]]], camera: Camera, depth: numpy.ndarray, mask: typing.Any, T_cam_obj: list, options: TrackerOptions, scale_m: typing.SupportsFloat | typing.SupportsIndex, scale: bool, intrinsics: bool, threads: typing.SupportsInt | typing.SupportsIndex, color: typing.Any = None, color_map: typing.Any = None, device: typing.SupportsInt | typing.SupportsIndex = -1) -> None:
        ...
    def cost(self, arg0: State) -> float:
        ...
    def linearize(self, arg0: State) -> dict:
        ...
    def minimize(self, start: State, options: LmOptions) -> tuple:
        ...
    def residuals(self, arg0: State) -> dict:
        ...
    def retract(self, arg0: State, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> tuple:
        ...
    def state(self, T_cam_obj: list, K: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(4)"], scales: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> State:
        ...
class GrowingVolume:
    """
    The volume of a session, enlarged where the shape needs it.
    """
    def begin_recording(self, beginning: Beginning, T_cam_obj: numpy.ndarray) -> None:
        ...
    def emptied(self) -> GrowingVolume:
        ...
    def fuse(self, keyframe: Keyframe) -> None:
        ...
    def fuse_again(self, keyframe: Keyframe, known: GrowingVolume, T_cam_known: numpy.ndarray) -> None:
        ...
    def measure(self) -> None:
        ...
    @property
    def core(self) -> typing.Any:
        ...
    @property
    def fused(self) -> int:
        ...
class ImageNoise:
    """
    What an image says of a depth camera's noise and bias; NaN: nothing.
    """
    @property
    def bias_by_tangent(self) -> float:
        ...
    @property
    def bias_m(self) -> float:
        ...
    @property
    def correlation(self) -> float:
        ...
    @property
    def depth_m(self) -> float:
        ...
    @property
    def known(self) -> int:
        ...
    @property
    def samples(self) -> list[tuple[float, float, float, int]]:
        ...
    @property
    def systematic_m(self) -> float:
        ...
class IntrinsicsOptions:
    """
    Options of a calibration.
    """
    residual: Residual
    def __init__(self) -> None:
        ...
    @property
    def max_pixels(self) -> int:
        ...
    @max_pixels.setter
    def max_pixels(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def outlier_floor(self) -> float:
        ...
    @outlier_floor.setter
    def outlier_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def padding_m(self) -> float:
        ...
    @padding_m.setter
    def padding_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        ...
    @threads.setter
    def threads(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class Keyframe:
    """
    A fused frame: its images cropped to the object, and the pose used for fusion.
    """
    def __init__(self, index: typing.SupportsInt | typing.SupportsIndex, region: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(4)"], depth: numpy.ndarray, rgb: numpy.ndarray | None, foreground: numpy.ndarray, T_cam_obj: numpy.ndarray, mask: numpy.ndarray | None = None, recording: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    @property
    def T_cam_obj(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @T_cam_obj.setter
    def T_cam_obj(self, arg1: numpy.ndarray) -> None:
        ...
    @property
    def depth(self) -> typing.Any:
        ...
    @property
    def foreground(self) -> typing.Any:
        ...
    @property
    def index(self) -> int:
        ...
    @property
    def mask(self) -> typing.Any:
        ...
    @property
    def recording(self) -> int:
        ...
    @property
    def region(self) -> tuple[int, int, int, int]:
        ...
    @property
    def rgb(self) -> typing.Any:
        ...
class Keyframes:
    """
    Keeps a limited number of frames, spread over viewpoints and time.
    """
    def __init__(self, most: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def add(self, keyframe: Keyframe) -> None:
        ...
    def record(self) -> dict:
        """
        What the choice depends on, beside the frames.
        """
    def restore(self, frames: collections.abc.Sequence[Keyframe], views: numpy.ndarray, nearest: numpy.ndarray, gaps: numpy.ndarray) -> None:
        ...
    @property
    def frames(self) -> list[Keyframe]:
        ...
class Lens:
    """
    A depth camera with skew, depth scale and depth offset.
    """
    def __init__(self, camera: Camera, skew: typing.SupportsFloat | typing.SupportsIndex = 0.0, depth_scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, depth_offset_m: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    @property
    def values(self) -> list[float]:
        """
        fx, fy, cx, cy, skew, k1, k2, depth scale, depth offset (m).
        """
class LmOptions:
    """
    Options of the optimiser.
    """
    def __init__(self) -> None:
        ...
    @property
    def cost_gain(self) -> float:
        ...
    @cost_gain.setter
    def cost_gain(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cost_relative(self) -> float:
        ...
    @cost_relative.setter
    def cost_relative(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def damping(self) -> float:
        ...
    @damping.setter
    def damping(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def damping_down(self) -> float:
        ...
    @damping_down.setter
    def damping_down(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def damping_max(self) -> float:
        ...
    @damping_max.setter
    def damping_max(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def damping_min(self) -> float:
        ...
    @damping_min.setter
    def damping_min(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def damping_up(self) -> float:
        ...
    @damping_up.setter
    def damping_up(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def fixed(self) -> list[bool]:
        ...
    @fixed.setter
    def fixed(self, arg0: collections.abc.Sequence[bool]) -> None:
        ...
    @property
    def max_steps(self) -> int:
        ...
    @max_steps.setter
    def max_steps(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def step_m(self) -> float:
        ...
    @step_m.setter
    def step_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def step_rad(self) -> float:
        ...
    @step_rad.setter
    def step_rad(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def step_relative(self) -> float:
        ...
    @step_relative.setter
    def step_relative(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sure_gain(self) -> float:
        ...
    @sure_gain.setter
    def sure_gain(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class LwprModel:
    @staticmethod
    def from_bytes(data: bytes) -> LwprModel:
        ...
    def __init__(self, n_in: typing.SupportsInt | typing.SupportsIndex, n_out: typing.SupportsInt | typing.SupportsIndex, options: LwprOptions, norm_in: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], norm_out: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    def activations(self, x: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def copy(self) -> LwprModel:
        ...
    def field_counts(self) -> list[int]:
        ...
    def fields(self, output: typing.SupportsInt | typing.SupportsIndex) -> list:
        ...
    def predict(self, x: numpy.ndarray, with_sd: bool = False, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> typing.Any:
        ...
    def predict_there(self, address: typing.SupportsInt | typing.SupportsIndex, stream: typing.SupportsInt | typing.SupportsIndex, count: typing.SupportsInt | typing.SupportsIndex, device: typing.SupportsInt | typing.SupportsIndex) -> DeviceArray:
        ...
    def to_bytes(self) -> bytes:
        ...
    def training_error(self) -> list[float]:
        ...
    def update(self, x: numpy.ndarray, y: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> None:
        ...
    @property
    def n_in(self) -> int:
        ...
    @property
    def n_out(self) -> int:
        ...
    @property
    def norm_in(self) -> list[float]:
        ...
    @property
    def norm_out(self) -> list[float]:
        ...
    @property
    def options(self) -> LwprOptions:
        ...
    @property
    def samples(self) -> int:
        ...
class LwprOptions:
    """
    Options of a regression.
    """
    @staticmethod
    def fields() -> dict:
        """
        Each option as a dataclass's field.
        """
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, w_gen: float = 0.2, w_prune: float = 0.95, w_cutoff: float = 0.01, init_D: collections.abc.Sequence[float] = [25.0], diagonal: bool = False, update_D: bool = True, init_alpha: float = 50.0, meta: bool = False, meta_rate: float = 1.0, penalty: float = 1e-08, add_threshold: float = 0.5, init_lambda: float = 0.999, final_lambda: float = 0.99999, tau_lambda: float = 0.9999) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def replace(self, **changes: typing.Any) -> typing.Self:
        """
        A copy with some options changed.
        """
    def to_dict(self) -> dict:
        """
        ``{name: value}``.
        """
    @property
    def add_threshold(self) -> float:
        """
        a projection is added if the last one left less than this share of the mean squared error
        """
    @property
    def diagonal(self) -> bool:
        """
        restrict the distance metric to a diagonal matrix
        """
    @property
    def final_lambda(self) -> float:
        """
        final forgetting factor
        """
    @property
    def init_D(self) -> list[float]:
        """
        initial distance metric of a new receptive field, for inputs divided by norm_in: a number, one per input, or a matrix
        """
    @property
    def init_alpha(self) -> float:
        """
        initial learning rate of the distance metric
        """
    @property
    def init_lambda(self) -> float:
        """
        initial forgetting factor of a receptive field
        """
    @property
    def meta(self) -> bool:
        """
        adapt the learning rates as well (second-order learning)
        """
    @property
    def meta_rate(self) -> float:
        """
        meta learning rate
        """
    @property
    def penalty(self) -> float:
        """
        gamma of Eq. 6.13: regularisation that prevents receptive fields from shrinking without limit
        """
    @property
    def tau_lambda(self) -> float:
        """
        annealing rate from init_lambda to final_lambda
        """
    @property
    def update_D(self) -> bool:
        """
        learn the distance metric
        """
    @property
    def w_cutoff(self) -> float:
        """
        activations below this are treated as 0; must be below w_gen
        """
    @property
    def w_gen(self) -> float:
        """
        a sample whose activation stays below this in every receptive field creates a new one
        """
    @property
    def w_prune(self) -> float:
        """
        if a sample activates two receptive fields above this, one of them is pruned; must exceed w_gen
        """
class MemoryOptions:
    """
    Options of a memory of silhouettes.
    """
    @staticmethod
    def fields() -> dict:
        """
        Each option as a dataclass's field.
        """
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_harmonics: int = 10, n_inputs: int = 3, rule: str = 'remembered', order: str = 'max', size: int = 64, capacity: int = 256, spacing: float = 0.02, max_occluders: int = 2, calibrate_on: int = 100, w_gen: float = 0.1, reach: float = 0.1, settle: int = 20) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def replace(self, **changes: typing.Any) -> typing.Self:
        """
        A copy with some options changed.
        """
    def to_dict(self) -> dict:
        """
        ``{name: value}``.
        """
    @property
    def calibrate_on(self) -> int:
        """
        number of known silhouettes whose error sets the threshold (remembered)
        """
    @property
    def capacity(self) -> int:
        """
        maximum number of stored silhouettes (remembered)
        """
    @property
    def max_occluders(self) -> int:
        """
        a silhouette with more occluders than this is novel (remembered)
        """
    @property
    def n_harmonics(self) -> int:
        """
        number of harmonics that describe a silhouette
        """
    @property
    def n_inputs(self) -> int:
        """
        number of the highest harmonics that predict the others (printed, regressed); must be below n_harmonics
        """
    @property
    def order(self) -> str:
        """
        how coefficients form a harmonic: all C(u, v) with equal max(u, v), or with equal u + v
        """
    @property
    def reach(self) -> float:
        """
        distance metric of the receptive fields, D = reach / n_inputs; smaller values generalise farther (printed, regressed)
        """
    @property
    def rule(self) -> str:
        """
        how occluded parts are recovered: from stored silhouettes, as printed (Table 6.3), or as printed but judged by the errors of silhouettes before they were learned
        """
    @property
    def settle(self) -> int:
        """
        number of silhouettes that determine the scale of the inputs (printed, regressed)
        """
    @property
    def size(self) -> int:
        """
        side of the grid to which silhouettes are normalised
        """
    @property
    def spacing(self) -> float:
        """
        minimum dissimilarity of two stored silhouettes: symmetric difference over area (remembered)
        """
    @property
    def w_gen(self) -> float:
        """
        a silhouette is unknown if its activation is below this (printed, regressed)
        """
class MeshCaster:
    """
    Rays and closest points of one mesh. The arrays must not change.
    """
    def __init__(self, vertices: numpy.ndarray, faces: numpy.ndarray) -> None:
        ...
    def closest(self, points: numpy.ndarray) -> tuple:
        """
        (N, 3) float64 -> distances (N,) m, faces (N,) int32, points (N, 3).
        """
    def raycast(self, camera: Camera, T_cam_obj: numpy.ndarray, colors: numpy.ndarray | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> tuple:
        """
        -> depth (H, W) float32 m, normals (H, W, 3) float32, colours (H, W, 3) uint8 or None.
        """
class MotionModel(enum.Enum):
    """
    Where an object is expected in the next frame.
    """
    adaptive: typing.ClassVar[MotionModel]  # value = <MotionModel.adaptive: 2>
    constant_velocity: typing.ClassVar[MotionModel]  # value = <MotionModel.constant_velocity: 1>
    static: typing.ClassVar[MotionModel]  # value = <MotionModel.static: 0>
class ObservedFrame:
    """
    Candidates of the ball in a frame's two images.
    """
    def __init__(self, index: typing.SupportsInt | typing.SupportsIndex, time_s: typing.SupportsFloat | typing.SupportsIndex, balls: collections.abc.Sequence[DepthBall], outlines: collections.abc.Sequence[BallOutline]) -> None:
        ...
    @property
    def balls(self) -> list[DepthBall]:
        ...
    @property
    def index(self) -> int:
        ...
    @property
    def outlines(self) -> list[BallOutline]:
        ...
    @property
    def time_s(self) -> float:
        ...
class OcclusionHandler:
    """
    Occlusions of a tracked contour, by a memory.
    """
    def __getstate__(self) -> bytes:
        ...
    def __init__(self) -> None:
        ...
    def __setstate__(self, arg0: bytes) -> None:
        ...
    def begin(self, tracker: ContourCore, memory: SilhouetteMemory) -> None:
        """
        After a start, in which the object is seen as a whole.
        """
    def judge(self, tracker: ContourCore, image: numpy.ndarray, burn_in: bool, memory: SilhouetteMemory) -> tuple:
        """
        Between observe and finish: the judgement, and the whole silhouette where one is recovered.
        """
class PrimitiveFitOptions:
    scaling: Scaling
    def __init__(self) -> None:
        ...
    @property
    def seed(self) -> int:
        ...
    @seed.setter
    def seed(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def tolerance_m(self) -> float:
        ...
    @tolerance_m.setter
    def tolerance_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class PrimitiveKind(enum.Enum):
    box: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.box: 3>
    cone: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.cone: 2>
    cylinder: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.cylinder: 1>
    ellipsoid: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.ellipsoid: 4>
    plane: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.plane: 5>
    sphere: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.sphere: 0>
    superquadric: typing.ClassVar[PrimitiveKind]  # value = <PrimitiveKind.superquadric: 6>
class PrimitiveView:
    """
    Depth measurements and edge pixels of an object, for fitting solids of unknown size.
    """
    @staticmethod
    def of_image(depth: numpy.ndarray, labels: numpy.ndarray, camera: Camera, reach_px: typing.SupportsInt | typing.SupportsIndex = 2) -> PrimitiveView:
        ...
    @staticmethod
    def of_points(points: numpy.ndarray) -> PrimitiveView:
        ...
    def fit(self, kinds: collections.abc.Sequence[PrimitiveKind], options: PrimitiveFitOptions, T_cam_obj: typing.Any = None, size: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> list:
        ...
    def set_plane(self, normal: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], offset: typing.SupportsFloat | typing.SupportsIndex, stands: bool) -> None:
        ...
    @property
    def points(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class Reconstruction:
    def __init__(self, voxels: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"], voxel_m: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], prior: numpy.ndarray | None, options: ReconstructionOptions, threads: typing.SupportsInt | typing.SupportsIndex, first_shape: numpy.ndarray | None = None, device: typing.SupportsInt | typing.SupportsIndex = -1, usual_noise_m: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        ...
    def fuse(self, depth: numpy.ndarray, camera: Camera, T: numpy.ndarray, region: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(4)"], mask: typing.Any = None, foreground: numpy.ndarray | None = None, rgb: numpy.ndarray | None = None) -> None:
        ...
    def mesh(self) -> tuple:
        ...
    def show(self) -> None:
        """
        Bring what arrays and trackers have borrowed of a volume on a GPU up to the last frame.
        """
    @property
    def log_ratio(self) -> numpy.ndarray:
        ...
    @property
    def origin(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
    @property
    def phi(self) -> numpy.ndarray:
        ...
    @property
    def rgb_seen(self) -> numpy.typing.NDArray[numpy.uint16]:
        ...
    @property
    def seen(self) -> numpy.ndarray:
        ...
    @property
    def surface_boxes(self) -> numpy.typing.NDArray[numpy.int32]:
        ...
    @property
    def voxel_m(self) -> float:
        ...
    @property
    def voxels(self) -> typing.Annotated[list[int], "FixedSize(3)"]:
        ...
    @property
    def weight(self) -> numpy.ndarray:
        ...
class ReconstructionOptions:
    """
    Options of a reconstruction.
    """
    @staticmethod
    def fields() -> dict:
        """
        Each option as a dataclass's field.
        """
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, evolution: str = 'ours', evidence: str = 'smooth', sigma_d_m: float = 0.003, sigma_d_voxels: float = 8.0, evolution_steps: int = 15, redistance_every: int = 15, noise_m: float | None = None, noise_per_m: float = 0.0, carve_from_m: float = 0.003, memory: float = 100.0, known_every: int = 2, border_px: int = 2, prior: float = 0.4, min_seen: float = 0.15, padding_m: float = 0.02, planes: bool = True, keep_to_mask: bool = True, mask_margin_px: int = 3, settle_after: int = 10, kept_frames: int = 600) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def replace(self, **changes: typing.Any) -> typing.Self:
        """
        A copy with some options changed.
        """
    def to_dict(self) -> dict:
        """
        ``{name: value}``.
        """
    @property
    def border_px(self) -> int:
        """
        object pixels within this distance of the silhouette or of a depth discontinuity are ignored
        """
    @property
    def carve_from_m(self) -> float:
        """
        no free space is carved within this distance in front of a depth measurement
        """
    @property
    def evidence(self) -> str:
        """
        likelihood of a voxel: smooth, or printed (thesis Eqs. 4.29 to 4.31)
        """
    @property
    def evolution(self) -> str:
        """
        ours, or printed: evidence, gradient flow and tracker of the thesis (Eqs. 4.18, 4.29 to 4.42)
        """
    @property
    def evolution_steps(self) -> int:
        """
        steps of the printed evolution per frame; 100 after the first frame
        """
    @property
    def keep_to_mask(self) -> bool:
        """
        the object is excluded where the first frame observes free space outside its mask
        """
    @property
    def kept_frames(self) -> int:
        """
        maximum number of frames kept for refine() and save(): the first, and others spread over all viewpoints
        """
    @property
    def known_every(self) -> int:
        """
        once a block has been observed in 30 frames, only every n-th further frame is fused into it; 1: every frame
        """
    @property
    def mask_margin_px(self) -> int:
        """
        how far the object may extend beyond the first mask
        """
    @property
    def memory(self) -> float:
        """
        maximum number of frames averaged in a voxel; fewer forget errors sooner, more reduce noise further
        """
    @property
    def min_seen(self) -> float:
        """
        a surface patch is used for tracking once it has been observed in this many (frontal) views
        """
    @property
    def noise_m(self) -> float | None:
        """
        standard deviation of the depth noise; None: estimated within the mask of the first frame
        """
    @property
    def noise_per_m(self) -> float:
        """
        depth noise grows with distance: noise_m + noise_per_m Z^2
        """
    @property
    def padding_m(self) -> float:
        """
        pixels within this distance of the current shape are considered in the next frame
        """
    @property
    def planes(self) -> bool:
        """
        planes that extend beyond the first mask (table, wall), and what lies behind them, are not part of the object
        """
    @property
    def prior(self) -> float:
        """
        log ratio of the initial guess, positive inside, negative outside; 0: no prior
        """
    @property
    def redistance_every(self) -> int:
        """
        steps of the printed evolution after which its field is made a signed distance again; 0: never, which loses the object
        """
    @property
    def settle_after(self) -> int:
        """
        number of frames after which the first one is placed on the shape again and the shape is rebuilt there; 0: never
        """
    @property
    def sigma_d_m(self) -> float:
        """
        support of the likelihood around a depth measurement; nothing is inferred from twice that distance behind it
        """
    @property
    def sigma_d_voxels(self) -> float:
        """
        replaces sigma_d_m when evolution is printed, as in the thesis
        """
class ReconstructionSession:
    """
    See sdftrack.Reconstructor.
    """
    volume: GrowingVolume
    def __init__(self, camera: Camera, options: ReconstructionOptions, voxels: typing.SupportsInt | typing.SupportsIndex, extent: typing.SupportsFloat | typing.SupportsIndex | None, threads: typing.SupportsInt | typing.SupportsIndex, device: typing.SupportsInt | typing.SupportsIndex, initial: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]] | None, beginning: Beginning) -> None:
        ...
    def add(self, frame: TrackerFrame, T_cam_obj: numpy.ndarray) -> bool:
        ...
    def restore(self, later: collections.abc.Sequence[Beginning], index: typing.SupportsInt | typing.SupportsIndex, voxels: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"], voxel_m: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    def resume(self, tracker: typing.Any, frame: TrackerFrame, shown: Beginning, masked: bool, names: collections.abc.Sequence[str]) -> dict:
        ...
    def set_tracker(self, tracker: typing.Any) -> None:
        ...
    def show_shape(self, tracker: typing.Any) -> None:
        ...
    def start(self, tracker: typing.Any, frame: TrackerFrame, names: collections.abc.Sequence[str]) -> dict:
        ...
    def track(self, frame: TrackerFrame, names: collections.abc.Sequence[str]) -> dict:
        ...
    @property
    def beginning(self) -> Beginning:
        ...
    @property
    def index(self) -> int:
        ...
    @property
    def keyframes(self) -> Keyframes:
        ...
    @property
    def later(self) -> list[Beginning]:
        ...
    @property
    def least_seen(self) -> int:
        ...
    @property
    def part_seconds(self) -> dict:
        """
        Time of tracking, fusing, and giving the tracker the new shape, in the last frame.
        """
    @property
    def tracker_noise(self) -> tuple[float, float]:
        """
        Depth noise for the tracker's options: noise_m and noise_per_m.
        """
class Residual(enum.Enum):
    """
    What a pixel's residual is.
    """
    point: typing.ClassVar[Residual]  # value = <Residual.point: 0>
    ray_hit: typing.ClassVar[Residual]  # value = <Residual.ray_hit: 2>
    slope: typing.ClassVar[Residual]  # value = <Residual.slope: 1>
class Scaling(enum.Enum):
    exact: typing.ClassVar[Scaling]  # value = <Scaling.exact: 0>
    printed: typing.ClassVar[Scaling]  # value = <Scaling.printed: 1>
class Searcher:
    """
    Finds a shape in a depth image without an initial pose.
    """
    def __init__(self, shape: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]], options: TrackerOptions) -> None:
        ...
    def search(self, depth: numpy.ndarray, camera: Camera, mask: typing.Any = None, box: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(4)"] | None = None, near: typing.Any = None, reach_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, foreground: typing.Any = None, plane: tuple[typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], typing.SupportsFloat | typing.SupportsIndex] | None = None, taken: typing.Any = None, first_seed: typing.SupportsInt | typing.SupportsIndex = 0, seeds: typing.SupportsInt | typing.SupportsIndex = 0, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> list:
        ...
class ShapeJudgement(enum.Enum):
    """
    What a memory says of a frame's shape.
    """
    none: typing.ClassVar[ShapeJudgement]  # value = <ShapeJudgement.none: 0>
    novel: typing.ClassVar[ShapeJudgement]  # value = <ShapeJudgement.novel: 3>
    occluded: typing.ClassVar[ShapeJudgement]  # value = <ShapeJudgement.occluded: 2>
    unoccluded: typing.ClassVar[ShapeJudgement]  # value = <ShapeJudgement.unoccluded: 1>
class SilhouetteMemory:
    """
    Silhouettes that explain others; use contour.ShapeMemory.
    """
    def __init__(self, options: MemoryOptions) -> None:
        ...
    def assess(self, mask: numpy.ndarray) -> dict:
        ...
    def learn(self, mask: numpy.ndarray) -> None:
        ...
    def restore(self, learnt: typing.SupportsInt | typing.SupportsIndex, calibrated: typing.SupportsInt | typing.SupportsIndex, squares: typing.SupportsFloat | typing.SupportsIndex, kept: numpy.ndarray, unlike: numpy.ndarray, ages: numpy.ndarray, clock: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        What `state` returned.
        """
    def state(self) -> dict:
        """
        All but the options.
        """
    @property
    def count(self) -> int:
        ...
    @property
    def learnt(self) -> int:
        ...
    @property
    def threshold(self) -> float:
        ...
class SingleFitter:
    """
    Objects that are each fitted on their own; see sdftrack.PoseFitter.
    """
    def __init__(self, volumes: collections.abc.Sequence[tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]]], camera: Camera, device: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def fit(self, depth: numpy.ndarray, mask: typing.Any, of: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], T_cam_obj: collections.abc.Sequence[numpy.ndarray], scale_m: typing.SupportsFloat | typing.SupportsIndex, options: TrackerOptions, max_steps: typing.SupportsInt | typing.SupportsIndex, rounds: typing.SupportsInt | typing.SupportsIndex, threads: typing.SupportsInt | typing.SupportsIndex) -> list:
        ...
class SlicOptions:
    connected: bool
    def __init__(self) -> None:
        ...
    @property
    def compactness(self) -> float:
        ...
    @compactness.setter
    def compactness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def depth_weight(self) -> float:
        ...
    @depth_weight.setter
    def depth_weight(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def distance(self) -> int:
        ...
    @distance.setter
    def distance(self, arg1: str) -> None:
        ...
    @property
    def first_label(self) -> int:
        ...
    @first_label.setter
    def first_label(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        ...
    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_size(self) -> float:
        ...
    @min_size.setter
    def min_size(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def n_segments(self) -> int:
        ...
    @n_segments.setter
    def n_segments(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def space(self) -> int:
        ...
    @space.setter
    def space(self, arg1: str) -> None:
        ...
class SlicWork:
    def __init__(self) -> None:
        ...
    def run(self, image: numpy.ndarray, options: SlicOptions, mask: numpy.ndarray | None, depth: numpy.ndarray | None, resume: bool, threads: typing.SupportsInt | typing.SupportsIndex, device: typing.SupportsInt | typing.SupportsIndex) -> tuple:
        ...
    @property
    def bytes(self) -> int:
        ...
class State:
    """
    A point in the space of unknowns, in the core's own frames.
    """
class Tracker:
    """
    Tracks shapes; see sdftrack.Tracker.
    """
    def __init__(self, shapes: collections.abc.Sequence[tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]]], camera: Camera, options: TrackerOptions, threads: typing.SupportsInt | typing.SupportsIndex, recover: bool, motion: MotionModel, device: typing.SupportsInt | typing.SupportsIndex, collision: Collision) -> None:
        ...
    def add(self, shape: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]], place: typing.Any) -> int:
        ...
    def alternative_poses(self, k: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def check_mask_size(self, frame: TrackerFrame, k: typing.SupportsInt | typing.SupportsIndex, mask: typing.Any, name: str) -> None:
        """
        ValueError, a sentence about `name`, if a mask is of another size than object k.
        """
    def color_delay(self) -> tuple[float, float, int]:
        ...
    def enlarged_volume(self, k: typing.SupportsInt | typing.SupportsIndex, voxel_m: typing.SupportsFloat | typing.SupportsIndex) -> typing.Any:
        ...
    def evidence(self, k: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def free_scale(self, k: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def interrupt(self, index: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def is_sure(self, k: typing.SupportsInt | typing.SupportsIndex) -> bool:
        """
        Whether in the last frame only open directions count against the pose.
        """
    def judge(self, frame: TrackerFrame, k: typing.SupportsInt | typing.SupportsIndex, T: numpy.ndarray) -> typing.Any:
        """
        The judgement of object k at an unchanged pose, with its grounds; None: too few measurements.
        """
    def located(self, frame: TrackerFrame, places: list) -> list:
        """
        The places with masks or boxes in place of clicks; masks of another size than the shape are refused.
        """
    def mark_unfound(self, k: typing.SupportsInt | typing.SupportsIndex, kind: str) -> None:
        ...
    def membership(self, frame: TrackerFrame) -> tuple:
        """
        Soft weights (H, W, M) and P_f (H, W) of the last poses in this frame.
        """
    def paint(self, k: typing.SupportsInt | typing.SupportsIndex, colors: numpy.ndarray) -> None:
        ...
    def place_of_click(self, frame: TrackerFrame, k: typing.SupportsInt | typing.SupportsIndex, px: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"]) -> tuple:
        """
        The region (H, W) bool of a click on object k, and the box to search in its place or None.
        """
    def recover(self, frame: TrackerFrame, objects: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], places: list, names: collections.abc.Sequence[str]) -> dict:
        ...
    def remove(self, k: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def replace_shapes(self, shapes: collections.abc.Sequence[tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]]], poses: numpy.ndarray) -> None:
        ...
    def reshape(self, k: typing.SupportsInt | typing.SupportsIndex, shape: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]], seen: numpy.ndarray, least: typing.SupportsInt | typing.SupportsIndex, boxes: numpy.ndarray, colors: numpy.ndarray | None = None) -> None:
        ...
    def resume(self, index: typing.SupportsInt | typing.SupportsIndex, time_s: typing.SupportsFloat | typing.SupportsIndex, followed: collections.abc.Sequence[bool], best: numpy.ndarray) -> None:
        ...
    def revisit(self, frame: TrackerFrame) -> tuple:
        """
        Poses (M, 4, 4) in a frame outside the sequence, and whether each is sure.
        """
    def scale(self, k: typing.SupportsInt | typing.SupportsIndex) -> tuple[float, float]:
        """
        Log scale and its sd.
        """
    def set_camera(self, camera: Camera) -> None:
        ...
    def set_pose(self, k: typing.SupportsInt | typing.SupportsIndex, T: numpy.ndarray, covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"] | None) -> None:
        ...
    def set_state(self, state: bytes) -> bool:
        """
        Goes on from such a state; False, and nothing changed, where it is one of another version.
        """
    def set_symmetry(self, k: typing.SupportsInt | typing.SupportsIndex, discrete: numpy.ndarray, axes: numpy.ndarray) -> None:
        ...
    def start(self, frame: TrackerFrame, places: list, names: collections.abc.Sequence[str]) -> dict:
        ...
    def state(self) -> bytes:
        """
        All that the next frames depend on, but for shapes, camera and settings.
        """
    def track(self, frame: TrackerFrame, names: collections.abc.Sequence[str]) -> dict:
        ...
    @property
    def best(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 4, 4), NaN: no good pose yet.
        """
    @property
    def index(self) -> int:
        ...
class TrackerFrame:
    """
    A frame for Tracker; without depth, `error` may give the reason.
    """
    def __init__(self, depth: typing.Any, mask: typing.Any = None, color: typing.Any = None, color_map: typing.Any = None, time_s: typing.SupportsFloat | typing.SupportsIndex = ..., error: str = '', given: typing.Any = None) -> None:
        ...
class TrackerOptions:
    """
    Options of a tracker.
    """
    @staticmethod
    def fields() -> dict:
        """
        Each option as a dataclass's field.
        """
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, residual: str = 'ray_hit', curvature: str = 'irls', outlier_floor: float = 0.1, scale_start_m: float = 0.005, scale_per_noise: float = 1.0, noise_m: float = 0.001, noise_per_m: float = 0.0, adapt_noise: bool = True, systematic_m: float = 0.0, max_systematic_m: float = 0.008, systematic_per_m: float = 0.0, lateral_px: float = 0.0, correlation_area_px: float = 0.0, min_correlation_area_px: float = 0.0, padding_m: float = 0.04, retry_inliers: float = 0.5, far_scale_m: float = 0.012, far_padding_m: float = 0.045, max_pixels: int = 10000, coarse_pixels: int = 320, fine_first: bool = True, damping_start: float = 0.001, stop_rule: str = 'gain', coarse_floor: float = 0.3, coarse_floor_behind: float = 0.02, free_space: bool = True, free_space_scale_m: float = 0.003, free_space_weight: float = 1.0, motion_sigma_m: float = 0.03, motion_sigma_rad: float = 0.3, drop_plane: bool = False, carried_frames: int = 0, collision_tolerance_m: float = 3e-05, union_sharpness: float = 40.0, coarse_union_sharpness: float = 2.0, color_likelihood: str = 'odds', color_learning: str = 'guarded', color_prior: float = 0.7, smooth_colors: bool = True, color_free_space: bool = False, color_max_overlap: float = 0.9, photometric: bool = True, photometric_weight: float = 0.3, photometric_pixels: int = 600, outline: bool = True, outline_weight: float = 1.0, outline_points: int = 120, outline_reach_px: int = 8, outline_far_px: int = 24, outline_from_m: float = 0.0005, outline_local: bool = True, recover_seeds: int = 120, lost_inliers: float = 0.3, weak_inliers: float = 0.55, lost_evidence: float = 0.02, weak_evidence: float = 0.5, given_odds: float = 20.0, search_odds: float = 0.05) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict) -> None:
        ...
    def replace(self, **changes: typing.Any) -> typing.Self:
        """
        A copy with some options changed.
        """
    def to_dict(self) -> dict:
        """
        ``{name: value}``.
        """
    @property
    def adapt_noise(self) -> bool:
        """
        rescale sigma(Z) in every frame by the residuals
        """
    @property
    def carried_frames(self) -> int:
        """
        an object without measurements of its own is placed by its neighbours for at most this many frames; 0: for 5, and as long as tracked neighbours hold it
        """
    @property
    def coarse_floor(self) -> float:
        """
        outlier_floor of the coarse stages for measurements in front of the surface
        """
    @property
    def coarse_floor_behind(self) -> float:
        """
        outlier_floor of the coarse stages for measurements behind the surface, where no occluder can be
        """
    @property
    def coarse_pixels(self) -> int:
        """
        maximum number of pixels in the coarse stages
        """
    @property
    def coarse_union_sharpness(self) -> float:
        """
        sharpness of the soft minimum in the coarse stages; 2 in the thesis (section 5.2)
        """
    @property
    def collision_tolerance_m(self) -> float:
        """
        standard deviation of the penetration depth between objects
        """
    @property
    def color_free_space(self) -> bool:
        """
        treat a pixel without depth but with background colour as free space
        """
    @property
    def color_learning(self) -> str:
        """
        guarded: pixels are weighted by their colour, and colours of what stands in front are removed; printed: all within 3 voxels of the surface (Eq. 4.22)
        """
    @property
    def color_likelihood(self) -> str:
        """
        odds: the colour sets each pixel's outlier fraction; printed: P_f d_on + P_b H_out (Eq. 4.18)
        """
    @property
    def color_max_overlap(self) -> float:
        """
        mode auto: depth alone if the overlap of the histograms, sum sqrt(p_f p_b), exceeds this
        """
    @property
    def color_prior(self) -> float:
        """
        foreground posterior of an uninformative colour
        """
    @property
    def correlation_area_px(self) -> float:
        """
        number of pixels that share one error; widens the covariance; 0: estimated
        """
    @property
    def curvature(self) -> str:
        """
        irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)
        """
    @property
    def damping_start(self) -> float:
        """
        initial Levenberg-Marquardt damping (100 in the thesis)
        """
    @property
    def drop_plane(self) -> bool:
        """
        ignore the pixels of the dominant plane (a table)
        """
    @property
    def far_padding_m(self) -> float:
        """
        padding_m of the second attempt
        """
    @property
    def far_scale_m(self) -> float:
        """
        scale_start_m of the second attempt
        """
    @property
    def fine_first(self) -> bool:
        """
        start each frame without coarse stages, in which a hand holding the object would pull the pose along
        """
    @property
    def free_space(self) -> bool:
        """
        penalise model points in space that the sensor observes to be free
        """
    @property
    def free_space_scale_m(self) -> float:
        """
        scale s of the free-space term
        """
    @property
    def free_space_weight(self) -> float:
        """
        weight of the free-space term; 1: all its surface points together weigh as much as all pixels
        """
    @property
    def given_odds(self) -> float:
        """
        prior odds that the object is present at a given pose
        """
    @property
    def lateral_px(self) -> float:
        """
        standard deviation of the lateral offset of the depth image from its intrinsics; widens the covariance
        """
    @property
    def lost_evidence(self) -> float:
        """
        lost if the posterior probability of the pose is below this
        """
    @property
    def lost_inliers(self) -> float:
        """
        lost if the inlier fraction among unoccluded surface points is below this
        """
    @property
    def max_pixels(self) -> int:
        """
        maximum number of pixels in the last stage
        """
    @property
    def max_systematic_m(self) -> float:
        """
        upper bound of the estimated systematic_m; 0: the sensor has no such error
        """
    @property
    def min_correlation_area_px(self) -> float:
        """
        lower bound of the estimated correlation_area_px
        """
    @property
    def motion_sigma_m(self) -> float:
        """
        standard deviation of the weak prior on the translation, centred at the predicted pose; 0: no prior
        """
    @property
    def motion_sigma_rad(self) -> float:
        """
        standard deviation of the same prior on the rotation
        """
    @property
    def noise_m(self) -> float:
        """
        sensor noise: sigma(Z) = noise_m + noise_per_m Z^2
        """
    @property
    def noise_per_m(self) -> float:
        """
        see noise_m
        """
    @property
    def outlier_floor(self) -> float:
        """
        outlier fraction of the likelihood; 0: as printed
        """
    @property
    def outline(self) -> bool:
        """
        with colour images: use the object's outline (occluding contour) too; the only term in frames without depth
        """
    @property
    def outline_far_px(self) -> int:
        """
        search distance on either side of the outline when the pose may be farther off
        """
    @property
    def outline_from_m(self) -> float:
        """
        with depth, use the outline only if the depth measurements share an error of at least this; 0: always
        """
    @property
    def outline_local(self) -> bool:
        """
        learn the colours along the outline locally; False: those of the whole object and its whole surroundings
        """
    @property
    def outline_points(self) -> int:
        """
        number of points on the outline in the outline term
        """
    @property
    def outline_reach_px(self) -> int:
        """
        search distance on either side of the outline, near the pose
        """
    @property
    def outline_weight(self) -> float:
        """
        weight of the outline term; 1: according to its noise and that of the depth alone
        """
    @property
    def padding_m(self) -> float:
        """
        pixels within this distance of the object's bounding box at its last pose are used
        """
    @property
    def photometric(self) -> bool:
        """
        with a coloured shape and colour images: add a photometric term to the pose estimation
        """
    @property
    def photometric_pixels(self) -> int:
        """
        number of pixels in the photometric term
        """
    @property
    def photometric_weight(self) -> float:
        """
        weight of the photometric term; 1: according to its noise alone
        """
    @property
    def recover_seeds(self) -> int:
        """
        rotations, of 240, that a search for a lost object tries per frame; bounds its time
        """
    @property
    def residual(self) -> str:
        """
        ray_hit: depth where the ray intersects the model minus measured depth; slope; point: as printed (Eq. 3.11)
        """
    @property
    def retry_inliers(self) -> float:
        """
        at a start: a wider second attempt is made if the inlier fraction is below this; 0: never
        """
    @property
    def scale_per_noise(self) -> float:
        """
        scale s of the last stage, relative to the sensor noise
        """
    @property
    def scale_start_m(self) -> float:
        """
        scale s of the first coarse stage, halved from stage to stage; 0: no coarse stages
        """
    @property
    def search_odds(self) -> float:
        """
        prior odds that the result of a search without mask or box is the object; applies until a frame is ok
        """
    @property
    def smooth_colors(self) -> bool:
        """
        combine the colour evidence of a pixel with that of its neighbours on the same surface
        """
    @property
    def stop_rule(self) -> str:
        """
        gain: a stage ends once the predicted decrease is small; printed: once the damping exceeds 10e6 (Table 3.2)
        """
    @property
    def systematic_m(self) -> float:
        """
        sd of the depth error shared by neighbouring pixels (stereo, time of flight); 0: estimated at a given pose
        """
    @property
    def systematic_per_m(self) -> float:
        """
        the systematic error grows with distance: systematic_m + systematic_per_m Z^2
        """
    @property
    def union_sharpness(self) -> float:
        """
        sharpness of the soft minimum over several objects, per voxel, in the last stages
        """
    @property
    def weak_evidence(self) -> float:
        """
        weak if the posterior probability of the pose is below this
        """
    @property
    def weak_inliers(self) -> float:
        """
        weak if that inlier fraction is below this
        """
def band_deviations(factor: numpy.ndarray, normal: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> None:
    """
    Standard normal (N, k) becomes L^-T normal, of covariance A^-1.
    """
def band_factor(band: numpy.ndarray) -> tuple:
    """
    Cholesky factor (N, width) of a lower band (width, N), and 0 or the row that is not positive.
    """
def band_solve(factor: numpy.ndarray, b: numpy.ndarray) -> None:
    """
    b (N, k) becomes A^-1 b.
    """
def canonical_pose(discrete: numpy.ndarray, axes: numpy.ndarray, T: numpy.ndarray, near: numpy.ndarray) -> numpy.typing.NDArray[numpy.float64]:
    """
    Symmetry.canonical: (4, 4).
    """
def connected_region(depth: numpy.ndarray, camera: Camera, rays: typing.Any, px: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"], reach_m: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.bool]:
    ...
def contour_first_instability(image: numpy.ndarray, box: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(4)"], mask: numpy.ndarray, options: ContourOptions) -> float:
    """
    1 less the mean IoU of the first mask and those of the box shifted a little.
    """
def contour_harmonic_numbers(n: typing.SupportsInt | typing.SupportsIndex, order: str) -> list[int]:
    """
    The harmonic of each coefficient.
    """
def contour_harmonics(inside: numpy.ndarray, n: typing.SupportsInt | typing.SupportsIndex, order: str) -> numpy.typing.NDArray[numpy.float64]:
    """
    Coefficients of a square picture, 1 inside and 0 outside.
    """
def contour_posterior(learned: numpy.ndarray, image: numpy.ndarray, phi: numpy.ndarray, warp: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(6)"], options: ContourOptions, pooled: collections.abc.Sequence[numpy.ndarray] = []) -> numpy.typing.NDArray[numpy.float32]:
    ...
def contour_series(coefficients: numpy.ndarray, n: typing.SupportsInt | typing.SupportsIndex, order: str, height: typing.SupportsInt | typing.SupportsIndex, width: typing.SupportsInt | typing.SupportsIndex, size: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    The cosine series at the pixels of an image.
    """
def contour_steps(phi: numpy.ndarray, foreground: numpy.ndarray, steps: typing.SupportsInt | typing.SupportsIndex, options: ContourOptions, device: typing.SupportsInt | typing.SupportsIndex = -1) -> numpy.typing.NDArray[numpy.float32]:
    """
    phi after steps of the evolution.
    """
def contour_verdict(evidence: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(5)"], status: str, reason: str) -> tuple:
    """
    Status, reason and confidence by the evidence.
    """
def contour_with_hidden(seen: numpy.ndarray, expected: numpy.ndarray) -> numpy.typing.NDArray[numpy.bool]:
    """
    The seen part and what an occluder hides of the expected silhouette.
    """
def copy_from_cuda(address: typing.SupportsInt | typing.SupportsIndex, out: numpy.ndarray) -> None:
    """
    Fills an array from an address on a CUDA device.
    """
def copy_from_dlpack(capsule: typing.Any, name: str) -> numpy.ndarray:
    """
    A DLPack capsule as an array of its own on the host; `name` is for messages.
    """
def correlation_area(u_px: numpy.ndarray, v_px: numpy.ndarray, residual_m: numpy.ndarray, scale_m: typing.SupportsFloat | typing.SupportsIndex, outlier_floor: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Number of pixels that share one error; 0: too few to estimate it.
    """
def correlation_length(neighbours: typing.SupportsFloat | typing.SupportsIndex) -> float:
    ...
def cuda_device_name(device: typing.SupportsInt | typing.SupportsIndex = 0) -> str:
    """
    Its name; empty where it does not answer.
    """
def cuda_devices() -> list[int]:
    """
    Numbers of the CUDA devices that can be used.
    """
def cuda_fingerprint(device: typing.SupportsInt | typing.SupportsIndex = 0) -> str:
    """
    Name, capability, driver and runtime of a device; empty where it does not answer.
    """
def cuda_least_capability() -> int:
    """
    The compute capability that the kernels need, as 10 major + minor.
    """
def decompose_map(M: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 4]"]) -> typing.Any:
    """
    K' and T_color_depth of M = K' [R' | t].
    """
def depth_metres(units: numpy.ndarray, unit_m: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float32]:
    """
    Depth of 16 bits as metres, the nearest float32.
    """
def evolve(phi: numpy.ndarray, log_ratio: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, steps: typing.SupportsInt | typing.SupportsIndex, options: EvolveOptions, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> numpy.typing.NDArray[numpy.float32]:
    ...
def find_object(depth: numpy.ndarray, given: typing.Any, place: typing.Any, camera: Camera, initial: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]] | None, options: ReconstructionOptions) -> Beginning:
    """
    The object of a first frame at a mask, a box, or a pose of the initial shape.
    """
def find_outlines(color: numpy.ndarray, mask: numpy.ndarray, camera: Camera, seed: typing.SupportsInt | typing.SupportsIndex = 0, most: typing.SupportsInt | typing.SupportsIndex = 3) -> list[BallOutline]:
    ...
def find_standing(depth: numpy.ndarray, given: typing.Any, T_cam_obj: numpy.ndarray, camera: Camera, shape: tuple[numpy.ndarray, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]], options: ReconstructionOptions) -> Beginning:
    """
    The same at the pose of a shape, with the planes that it stands on.
    """
def fit_color_map(center_cam: numpy.ndarray, center_covariance: numpy.ndarray, color_px: numpy.ndarray, color_covariance: numpy.ndarray, time_s: numpy.ndarray, color: typing.Any, time_offset: bool, seed: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
    ...
def fit_growth(depth_m: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], value: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], is_signed: bool) -> tuple:
    """
    (constant, per Z^2).
    """
def fit_noise(samples: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]]) -> tuple:
    """
    (noise_m, noise_per_m, noise_incidence).
    """
def fit_plane(depth: numpy.ndarray, camera: Camera, rays: typing.Any, mask: typing.Any, normal: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], offset: typing.SupportsFloat | typing.SupportsIndex, tolerance_m: typing.SupportsFloat | typing.SupportsIndex, noise: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], bent: bool = False) -> typing.Any:
    """
    Normal, offset, bend and noise over the law's of a plane refitted to the readings in a mask; None on a line.
    """
def grid_around(low: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], high: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], voxels: typing.SupportsInt | typing.SupportsIndex, padding: typing.SupportsFloat | typing.SupportsIndex | None) -> tuple:
    """
    -> voxel size (m), shape [z, y, x] and origin (m) of the grid around a box.
    """
def isa() -> str:
    """
    The one in use: the fastest, or the environment variable SDFTRACK_ISA.
    """
def isas() -> list[str]:
    """
    Instruction sets that this build has code for and this processor runs, slowest first.
    """
def mesh_to_sdf(vertices: numpy.ndarray, faces: numpy.ndarray, shape: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"], voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], band_voxels: typing.SupportsFloat | typing.SupportsIndex = 6.0, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> tuple:
    """
    -> phi [z, y, x] float32 m, number of voxels inside an inside-out part.
    """
def mesh_volume(vertices: numpy.ndarray, faces: numpy.ndarray, voxels: typing.SupportsInt | typing.SupportsIndex, padding: typing.SupportsFloat | typing.SupportsIndex | None, unit_m: typing.SupportsFloat | typing.SupportsIndex | None, close_holes: bool, threads: typing.SupportsInt | typing.SupportsIndex) -> tuple:
    """
    -> phi [z, y, x] float32 m, voxel size and origin (m), report, warnings (SDF.from_mesh).
    """
def moving_color(colors: collections.abc.Sequence[numpy.ndarray]) -> BallColor:
    """
    The most saturated colour among pixels that change.
    """
def nearest_rigid(T: numpy.ndarray, name: str = 'T') -> numpy.typing.NDArray[numpy.float64]:
    """
    4x4 float64, rotation to within 0.01, projected onto the rotations; ValueError beyond.
    """
def new_volume_id() -> int:
    """
    A number that no other volume has.
    """
def paint(vertices: numpy.ndarray, faces: numpy.ndarray, colors: numpy.ndarray, values: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], reach_m: typing.SupportsFloat | typing.SupportsIndex, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.uint8]:
    """
    RGBA [z, y, x, 4] of the voxels within reach of a mesh with coloured vertices.
    """
def plane_noise(depth: numpy.ndarray, given: typing.Any, camera: Camera, beside: numpy.ndarray, normal: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], offset_m: typing.SupportsFloat | typing.SupportsIndex) -> ImageNoise:
    ...
def primitive_clearance(kind: PrimitiveKind, size: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], T_obj_cam: numpy.ndarray, ray: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], near_m: typing.SupportsFloat | typing.SupportsIndex, far_m: typing.SupportsFloat | typing.SupportsIndex) -> tuple:
    """
    -> least phi along a stretch of a ray (m), derivative by (v, w) and every size.
    """
def primitive_distances(kind: PrimitiveKind, size: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], points: numpy.ndarray, scaling: Scaling = ...) -> tuple:
    """
    -> phi (N,), gradient (N, 3), derivative by every size (N, sizes).
    """
def primitive_kinds() -> list:
    """
    What each kind of primitive is; see primitives/kinds.py.
    """
def primitive_reach(kind: PrimitiveKind, size: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], direction: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> tuple[float, typing.Annotated[list[float], "FixedSize(3)"], list[float]]:
    """
    -> reach (m), point, derivative by every size.
    """
def primitive_sdf(kind: str, size: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], shape: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"], voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], threads: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float32]:
    """
    Exact distance of a primitive at every voxel, float32 [z, y, x].
    """
def redistance(values: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> numpy.typing.NDArray[numpy.float32]:
    """
    Distance field with the same zero set, float32 [z, y, x].
    """
def remove_plane(depth: numpy.ndarray, camera: Camera, rays: typing.Any, start_x: typing.SupportsInt | typing.SupportsIndex, start_y: typing.SupportsInt | typing.SupportsIndex, tolerance_m: typing.SupportsFloat | typing.SupportsIndex, method: str, noise: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], measure_noise: bool, feet: bool, threads: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
    """
    Mask of what is not on the dominant plane, normal, offset, bend, noise over the law's and share of the readings; or one of "few readings", "no start", "start not flat", "small".
    """
def render_sdf(values: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], camera: Camera, T_cam_obj: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1, id: typing.SupportsInt | typing.SupportsIndex = 0) -> tuple:
    """
    -> depth (H, W) float32 m, normals (H, W, 3) float32; id: of values that do not change, 0: unknown.
    """
def rotation_exp(w_rad: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Rotation vector to a 4x4 rotation.
    """
def rotation_log(T: numpy.ndarray) -> typing.Annotated[list[float], "FixedSize(3)"]:
    """
    Rotation vector (rad) of a 4x4 pose.
    """
def rotations_of_curve(q: numpy.ndarray, rate: numpy.ndarray) -> tuple:
    """
    (3, 3, n, S) rotations and (3, n, S) angular velocities of quaternions (4, n, S) and their rates.
    """
def sample_sdf(values: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], points: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> tuple:
    """
    (N, 3) float64 -> phi (N,), gradient (N, 3), of the trilinear interpolant.
    """
def scale_and_add(a: typing.SupportsFloat | typing.SupportsIndex, x: numpy.ndarray, y: numpy.ndarray, *, device: typing.SupportsInt | typing.SupportsIndex = -1) -> numpy.typing.NDArray[numpy.float32]:
    """
    a x + y of (N,) float32 arrays: the smallest kernel, to test the device.
    """
def seed_rotation(k: typing.SupportsInt | typing.SupportsIndex, n: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    Rotation k of n evenly spread ones, as a 4x4 matrix.
    """
def sensor_presets() -> list:
    """
    One dict of the values of each preset (SensorModel.preset).
    """
def slic(image: numpy.ndarray, options: SlicOptions, mask: numpy.ndarray | None, depth: numpy.ndarray | None, threads: typing.SupportsInt | typing.SupportsIndex, device: typing.SupportsInt | typing.SupportsIndex) -> tuple:
    ...
def slic_there(address: typing.SupportsInt | typing.SupportsIndex, stream: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, width: typing.SupportsInt | typing.SupportsIndex, channels: typing.SupportsInt | typing.SupportsIndex, options: SlicOptions, device: typing.SupportsInt | typing.SupportsIndex) -> DeviceArray:
    ...
def span_is_wide(depth_m: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> bool:
    ...
def spline_values(first: numpy.ndarray, weights: numpy.ndarray, coefficients: numpy.ndarray, count: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    (count, n, S) values of the first components of (size, C, S) coefficients.
    """
def surface_noise(depth: numpy.ndarray, given: typing.Any, camera: Camera, expected: numpy.ndarray, normals: numpy.ndarray) -> ImageNoise:
    ...
def surface_samples(values: numpy.ndarray, voxel_size: typing.SupportsFloat | typing.SupportsIndex, origin: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], count: typing.SupportsInt | typing.SupportsIndex) -> tuple:
    """
    -> points (N, 3) float32 m, normals (N, 3) float32.
    """
def symmetry_motions(discrete: numpy.ndarray, axes: numpy.ndarray, steps: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    Symmetry.motions: (n, 4, 4).
    """
def thread_count(requested: typing.SupportsInt | typing.SupportsIndex = 0) -> int:
    """
    Threads used when `requested` are asked for.
    """
def too_small_radius_px(mask: numpy.ndarray) -> float:
    ...
def without_lattice(depth_m: numpy.ndarray) -> numpy.ndarray:
    """
    The depth with the holes of a registration filled; the same array without such holes.
    """
def zero_mesh(phi: numpy.ndarray, threads: typing.SupportsInt | typing.SupportsIndex = 0, device: typing.SupportsInt | typing.SupportsIndex = -1) -> tuple:
    """
    The zero set by marching cubes -> vertices (N, 3) float64, x, y, z in voxels; faces (M, 3) int32.
    """
BALL_BAND_PX: float = 8.0
EVIDENCE_BIAS: float = 4.23
EVIDENCE_MOST_INSTABILITY: float = 0.2
EVIDENCE_MOST_SHARED: float = 0.55
EVIDENCE_SURE: float = 0.9
EVIDENCE_WEIGHTS: list = [-2.21, -8.91, -4.23, -5.67]
MAX_VOXELS: int = 1200
MIN_BALL_RADIUS_PX: float = 5.0
SYMMETRY_STEPS: int = 315
__version__: str = '0.1.0'
build: dict = {'compiler': 'gcc 12.2.0', 'optimised': True}
cuda_build: bool = False
