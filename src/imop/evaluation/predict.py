"""A recorded episode, predicted keyframe by keyframe after one demonstration; nothing moves."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from imop.evaluation.methods import Policy, make_policy
from imop.evaluation.report import save_json
from imop.evaluation.robots import PANDA, perception_for
from imop.geometry import se3
from imop.geometry.accuracy import FINE
from imop.robots.panda import T_WORLD_BASE
from imop.types import Action, Demonstration, FloatArray


@dataclass(frozen=True)
class Prediction:
    """One predicted action beside the recorded one.

    Attributes:
        step: number of the recorded keyframe.
        action: what the policy predicted.
        position_error: metres to the recorded gripper position.
        rotation_error: radians to the recorded gripper orientation.
        seconds: time to decide.
    """

    step: int
    action: Action
    position_error: float
    rotation_error: float
    seconds: float

    @property
    def within_1cm_5deg(self) -> bool:
        """Whether the prediction is near enough for most grasps."""
        return bool(self.position_error < FINE[0] and self.rotation_error < np.radians(FINE[1]))


def predict(policy: Policy, recorded: Demonstration) -> list[Prediction]:
    """Ask the policy, which has watched another demonstration, for the action at every recorded keyframe.

    Raises:
        ImopError: as the policy does.
    """
    policy.reset()
    predictions = []
    for step, keyframe in enumerate(recorded.keyframes):
        started = time.perf_counter()
        action = policy.act(keyframe.observation.stripped())
        seconds = time.perf_counter() - started
        predictions.append(
            Prediction(
                step,
                action,
                float(se3.translation_distance(action.T_world_gripper, keyframe.action.T_world_gripper)),
                float(se3.rotation_distance(action.T_world_gripper, keyframe.action.T_world_gripper)),
                seconds,
            )
        )
    return predictions


def predict_recorded(
    demonstration: Demonstration,
    recorded: Demonstration,
    method: str,
    out: Path,
    weights: Path | None = None,
    T_imop_world: FloatArray | None = None,
    robot: str = PANDA,
    origin: Mapping[str, object] | None = None,
) -> list[Prediction]:
    """Predict every keyframe of `recorded` and write result.json into `out`.

    Args:
        demonstration: what is shown.
        recorded: what is asked.
        method: as for `make_policy`.
        out: folder for the results.
        weights: folder of the learned policy's weights; by default the bundled ones.
        T_imop_world: (4, 4) by which both were moved before (see `frame_of`); poses are written as they were
            recorded.
        robot: its name, see `perception_for`.
        origin: where all of it was read, to be written into result.json too.

    Raises:
        ImopError: if either recording cannot be used.
    """
    T_world_imop = np.eye(4) if T_imop_world is None else se3.invert(T_imop_world)
    policy = make_policy(method, weights=weights, robot=robot)
    policy.watch(demonstration.stripped())
    predictions = predict(policy, recorded)
    steps = [
        {
            "step": p.step,
            "T_world_gripper": se3.to_pose7(T_world_imop @ p.action.T_world_gripper).tolist(),
            "gripper_open": p.action.gripper_open,
            "allow_collisions": p.action.allow_collisions,
            "confidence": p.action.confidence,
            "position_error": p.position_error,
            "rotation_error": p.rotation_error,
            "seconds": p.seconds,
        }
        for p in predictions
    ]
    save_json({"method": method, **(origin or {}), "steps": steps}, out / "result.json")
    return predictions


def frame_of(p_world_base: tuple[float, float, float] | None) -> FloatArray:
    """T_imop_world (4, 4), which moves recordings to where imop's self-filter and workspace expect the robot.

    Args:
        p_world_base: (3,) metres, where the robot's base is in the recordings' frame, whose axes are the
            base's; None if it is where the simulated one is.
    """
    return np.eye(4) if p_world_base is None else T_WORLD_BASE @ se3.invert(se3.make(p=p_world_base))


def draw_predictions(
    demonstration: Demonstration,
    recorded: Demonstration,
    predictions: list[Prediction],
    path: Path,
    robot: str = PANDA,
) -> None:
    """Draw the demonstrated step and the predicted action of every keyframe into a PNG.

    The workspace is that of the robot, see `perception_for`.

    Raises:
        MissingExtra: without Matplotlib.
    """
    from imop.evaluation.picture import Panel, save_picture

    perception, _ = perception_for(robot)
    bounds = perception.lower, perception.upper
    panels = []
    for p in predictions:
        step = p.action.match.step if p.action.match else min(p.step, len(demonstration) - 1)
        seen = recorded.keyframes[p.step].observation
        panels.append(Panel(demonstration.keyframes[step], seen, p.action, f"step {p.step}", bounds))
    save_picture(panels, path)


def predictions_table(predictions: list[Prediction]) -> Table:
    """Open-loop predictions for the terminal."""
    table = Table()
    for column in ("keyframe", "off the recording", "confidence", "decided in"):
        table.add_column(column, justify="right")
    for p in predictions:
        off = deviation(p.position_error, p.rotation_error)
        table.add_row(str(p.step), off, f"{p.action.confidence:.2f}", f"{p.seconds:.2f} s")
    return table


def deviation(position: float | None, rotation: float | None) -> str:
    """Metres and radians in words; a dash where one is unknown."""
    if position is None or rotation is None:
        return "-"
    return f"{100 * position:.2f} cm, {np.degrees(rotation):.1f} deg"
