"""The values that flow through imop: views -> observations -> keyframes -> demonstrations -> actions.

All are frozen and validated once, when they are made. World frame: z up, metres, radians. `T_a_b` is a
(4, 4) float64 matrix that maps points of frame b into frame a. The gripper frame is RLBench's tip frame:
origin between the finger tips, +z the approach direction, y the closing direction.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.errors import InvalidInput

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.int32]
ByteArray = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]


def as_array(name: str, value: Any, shape: tuple[int | None, ...], dtype: Any = np.float64) -> NDArray[Any]:
    """Convert `value` to a read-only array of `dtype`; None in `shape` accepts any length.

    Raises:
        InvalidInput: if it is not numeric, has another shape, or holds anything but fitting integers where
            `dtype` is one of integers.
    """
    wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + f") {np.dtype(dtype).name}"
    try:
        given = np.asarray(value)
        if np.dtype(dtype).kind in "iu":
            _check_integers(name, given, np.iinfo(dtype))
        array = np.array(given, dtype=dtype)
    except InvalidInput:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(name, f"not an array ({error})", wanted) from error
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise InvalidInput(name, f"shape {array.shape}", wanted)
    array.setflags(write=False)
    return array


def as_finite(name: str, value: Any, shape: tuple[int | None, ...]) -> FloatArray:
    """As `as_array`, of float64.

    Raises:
        InvalidInput: as `as_array`, and if a number is NaN or infinite.
    """
    array = as_array(name, value, shape)
    if not np.all(np.isfinite(array)):
        raise InvalidInput(name, "not finite", "finite numbers")
    return array


def _check_integers(name: str, given: NDArray[Any], limits: "np.iinfo[Any]") -> None:
    """A conversion would turn colours from 0 to 1 into black, and 256 into 0, without a word."""
    if not given.size or given.dtype == limits.dtype:
        return
    accepted = f"integers from {limits.min} to {limits.max}"
    if given.dtype.kind not in "iu":
        raise InvalidInput(name, f"an array of {given.dtype.name}", accepted)
    if given.min() < limits.min or given.max() > limits.max:
        raise InvalidInput(name, f"integers from {given.min()} to {given.max()}", accepted)


def rotation_error(R: FloatArray) -> float:
    """Largest error of an element of R R^T, R (3, 3); infinite if R is absurd."""
    return float(np.abs(R @ R.T - np.eye(3)).max()) if np.abs(R).max() < 1e3 else np.inf


def as_pose(name: str, value: Any) -> FloatArray:
    """Convert `value` to a rigid transformation, (4, 4) float64.

    Raises:
        InvalidInput: if it is not (4, 4), not finite, or its rotation is not orthonormal with determinant 1.
    """
    T = as_array(name, value, (4, 4))
    accepted = "a (4, 4) rigid transformation: orthonormal rotation, determinant +1, last row 0 0 0 1"
    if not np.all(np.isfinite(T)):
        raise InvalidInput(name, "not finite", accepted)
    R = T[:3, :3]
    if rotation_error(R) > 1e-4 or np.linalg.det(R) < 0:
        raise InvalidInput(name, "rotation is not orthonormal and right-handed", accepted)
    if not np.allclose(T[3], (0, 0, 0, 1), atol=1e-8):
        raise InvalidInput(name, f"last row is {T[3].tolist()}", accepted)
    return T


def as_image(name: str, value: Any) -> ByteArray:
    """Convert `value` to an image, (H, W, 3) uint8, of at least one pixel.

    Raises:
        InvalidInput: if it is none.
    """
    image: ByteArray = as_array(name, value, (None, None, 3), np.uint8)
    if not image.size:
        raise InvalidInput(name, f"shape {image.shape}", "an image with at least one pixel")
    return image


def as_intrinsics(name: str, value: Any) -> FloatArray:
    """Convert `value` to a camera matrix without skew, (3, 3), pixels.

    Raises:
        InvalidInput: if it is none.
    """
    K = as_finite(name, value, (3, 3))
    if not (K[0, 0] > 0 and K[1, 1] > 0 and np.allclose(K[[1, 2, 2, 2], [0, 0, 1, 2]], (0, 0, 0, 1))):
        raise InvalidInput(name, f"{K.tolist()}", "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]], fx, fy > 0")
    return K


def as_fraction(name: str, value: float) -> float:
    """A fraction of the stroke; measurements up to 0.01 outside of 0 .. 1 are clipped.

    Raises:
        InvalidInput: if it is farther outside, or no number.
    """
    fraction = float(value)
    if not -0.01 <= fraction <= 1.01:
        raise InvalidInput(name, f"{fraction}", "a fraction of the stroke, 0 closed .. 1 open")
    return min(max(fraction, 0.0), 1.0)


def as_positive(name: str, value: Any, largest: float, unit: str) -> float:
    """A number above 0 and at most `largest`, which is of that unit.

    Raises:
        InvalidInput: if it is none.
    """
    number = float(as_finite(name, value, ()))
    if not 0 < number <= largest:
        raise InvalidInput(name, f"{number:g}", f"above 0 and at most {largest:g}, {unit}")
    return number


def freeze(instance: object, **values: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


@dataclass(frozen=True, eq=False)
class CameraView:
    """One registered RGB-D image.

    Pixel (u, v) with depth d is the camera-frame point inv(K) (u d, v d, d): x to the right, y down, z
    forward, integer pixel coordinates from the top left corner.

    Attributes:
        rgb: (H, W, 3) uint8, at least one pixel; integers from 0 to 255 are accepted, fractions are not.
        depth: (H, W) float32, metres along the optical axis; 0, NaN and inf mean no measurement.
        intrinsics: (3, 3) float64, pixels, positive focal lengths.
        T_world_camera: (4, 4) float64.
        instance_ids: (H, W) int32 or None; only training may read it.
    """

    rgb: ByteArray
    depth: Float32Array
    intrinsics: FloatArray
    T_world_camera: FloatArray
    instance_ids: IntArray | None = None

    def __post_init__(self) -> None:
        rgb = as_image("rgb", self.rgb)
        image = rgb.shape[:2]
        ids = self.instance_ids
        freeze(
            self,
            rgb=rgb,
            depth=as_array("depth", self.depth, image, np.float32),
            intrinsics=as_intrinsics("intrinsics", self.intrinsics),
            T_world_camera=as_pose("T_world_camera", self.T_world_camera),
            instance_ids=None if ids is None else as_array("instance_ids", ids, image, np.int32),
        )

    @property
    def measured(self) -> BoolArray:
        """(H, W) True where depth is a measurement."""
        return np.isfinite(self.depth) & (self.depth > 0)


@dataclass(frozen=True, eq=False)
class Observation:
    """What the robot knows at one moment.

    Attributes:
        views: camera name -> view; at least one.
        T_world_gripper: (4, 4).
        gripper_opening: 0 closed .. 1 fully open (fraction of the stroke).
        time_step: number of keyframes reached so far in this episode.
        joint_positions: (n,) radians, finite, or None. The Panda's follow Franka's convention.
        joint_velocities: (n,) radians per second or None; no policy reads them.
        instance_names: what the instance ids of the views are called; only training may read it.
    """

    views: Mapping[str, CameraView]
    T_world_gripper: FloatArray
    gripper_opening: float
    time_step: int = 0
    joint_positions: FloatArray | None = None
    joint_velocities: FloatArray | None = None
    instance_names: Mapping[int, str] | None = None

    def __post_init__(self) -> None:
        if not self.views:
            raise InvalidInput("views", "empty", "at least one camera view")
        q, dq = self.joint_positions, self.joint_velocities
        freeze(
            self,
            views=dict(self.views),
            T_world_gripper=as_pose("T_world_gripper", self.T_world_gripper),
            gripper_opening=as_fraction("gripper_opening", self.gripper_opening),
            time_step=int(self.time_step),
            joint_positions=None if q is None else as_finite("joint_positions", q, (None,)),
            joint_velocities=None if dq is None else as_finite("joint_velocities", dq, (None,)),
        )

    def stripped(self) -> "Observation":
        """The same observation without anything that only training or a simulator knows."""
        views = {name: replace(view, instance_ids=None) for name, view in self.views.items()}
        return replace(self, views=views, joint_velocities=None, instance_names=None)


@dataclass(frozen=True, eq=False)
class Match:
    """Why an action was predicted: matched points, for people to look at.

    Attributes:
        step: index of the demonstrated step that was transferred.
        p_support: (N, 3) points of the demonstrated scene, world frame of the demonstration.
        p_query: (N, 3) their counterparts in the observed scene, world frame.
        region: (M, 3) the whole invariant region in the demonstrated scene.
        T_query_support: (4, 4) the motion that carried the demonstrated pose over, world frame to world
            frame; None if none did.
        generator: which generator proposed the motion (`policy/proposals.py`); empty if the method has none.
        probability: 0 .. 1, of the motion being right.
    """

    step: int
    p_support: FloatArray
    p_query: FloatArray
    region: FloatArray
    T_query_support: FloatArray | None = None
    generator: str = ""
    probability: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise InvalidInput("probability", f"{self.probability}", "a number between 0 and 1")
        freeze(
            self,
            p_support=as_array("p_support", self.p_support, (None, 3)),
            p_query=as_array("p_query", self.p_query, (len(self.p_support), 3)),
            region=as_array("region", self.region, (None, 3)),
        )
        if self.T_query_support is not None:
            freeze(self, T_query_support=as_pose("T_query_support", self.T_query_support))


@dataclass(frozen=True, eq=False)
class Action:
    """A gripper pose to reach, then the state of the gripper (the paper's a = (T, λ)).

    In a demonstration the pose is the one that the gripper *reached* before the fingers moved, not the one
    that was commanded, because predictions carry the reached pose over. A policy's action is a command.

    Attributes:
        T_world_gripper: (4, 4).
        gripper_open: state of the gripper after the motion.
        allow_collisions: whether the motion may touch things.
        confidence: 0 .. 1.
        match: the evidence, or None for actions that were not predicted by matching.
        reachable: whether the arm can take the gripper there; None if that was not asked.
    """

    T_world_gripper: FloatArray
    gripper_open: bool
    allow_collisions: bool = False
    confidence: float = 1.0
    match: Match | None = None
    reachable: bool | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.confidence <= 1.0:
            raise InvalidInput("confidence", f"{self.confidence}", "a number between 0 and 1")
        freeze(
            self,
            T_world_gripper=as_pose("T_world_gripper", self.T_world_gripper),
            gripper_open=bool(self.gripper_open),
            allow_collisions=bool(self.allow_collisions),
        )


@dataclass(frozen=True, eq=False)
class Keyframe:
    """One demonstrated step: what was seen, and the action that led to the next keyframe.

    Attributes:
        observation: the support state s_i.
        action: T_i and λ_i.
        object_name: the object whose frame the action is fixed to, if a simulator said so; privileged.
        T_world_object: its pose at `observation`; privileged.
    """

    observation: Observation
    action: Action
    object_name: str | None = None
    T_world_object: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.T_world_object is not None:
            freeze(self, T_world_object=as_pose("T_world_object", self.T_world_object))


@dataclass(frozen=True, eq=False)
class Demonstration:
    """One successful episode as macro-steps.

    It should end with the release. What the hand still holds at the end was not put down.

    Attributes:
        keyframes: the steps; the state after step k is `after(k)`.
        final: what was seen after the last action.
        task: "suite/name", for bookkeeping; no policy reads it.
        variation: number of the task's variation.
        instructions: the variation in words; only the baselines read them.
        seeds: instance and episode seed of the scene, where there is one.
    """

    keyframes: tuple[Keyframe, ...]
    final: Observation
    task: str = ""
    variation: int = 0
    instructions: tuple[str, ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.keyframes:
            raise InvalidInput("keyframes", "the demonstration has no keyframe", "at least one step")
        freeze(self, keyframes=tuple(self.keyframes), instructions=tuple(self.instructions))

    def __len__(self) -> int:
        return len(self.keyframes)

    def after(self, step: int) -> Observation:
        """The state s_i' that step `step` led to."""
        last = len(self.keyframes) - 1
        return self.final if step == last else self.keyframes[step + 1].observation

    @property
    def closing(self) -> int:
        """The first step that closes the gripper; as many as there are if none does."""
        steps = (k for k, step in enumerate(self.keyframes) if not step.action.gripper_open)
        return next(steps, len(self))

    def stripped(self) -> "Demonstration":
        """The same demonstration without anything that only training or a simulator knows.

        The instructions stay: who shows a task may also say it.
        """
        keyframes = tuple(Keyframe(k.observation.stripped(), k.action) for k in self.keyframes)
        return Demonstration(keyframes, self.final.stripped(), instructions=self.instructions)
