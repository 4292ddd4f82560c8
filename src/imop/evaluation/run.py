"""One task, one demonstration, one new scene: perform it and show what happened."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.table import Table

from imop.demos.frames import moved
from imop.evaluation.appearance import Appearance
from imop.evaluation.expert_poses import ExpertPoses
from imop.evaluation.open_loop import Prediction, predict
from imop.evaluation.picture import Panel, save_picture
from imop.evaluation.recordings import objects_world
from imop.evaluation.report import save_json
from imop.evaluation.rollout import Rollout, rollout
from imop.evaluation.trials import Trial, make_policy, most_actions
from imop.evaluation.video import save_video
from imop.geometry import se3
from imop.sim.cameras import look_at, render_view
from imop.sim.robot import T_WORLD_BASE
from imop.sim.world import World
from imop.types import Action, ByteArray, Demonstration, Observation

VIDEO_SIZE = (320, 240)
VIDEO_STRIDE = 2
"""Every second frame of 0.05 simulated seconds is drawn, and shown at twice the real speed."""


AUDIENCE = look_at((1.5, -0.9, 1.6), (0.2, 0.0, 0.95), 40.0)


class _Film:
    """Draws every second frame."""

    def __init__(self) -> None:
        self.frames: list[ByteArray] = []
        self._seen = 0

    def __call__(self, world: World) -> None:
        if self._seen % VIDEO_STRIDE == 0:
            self.frames.append(render_view(world, AUDIENCE, *VIDEO_SIZE))
        self._seen += 1


def perform(
    trial: Trial,
    demonstration: Demonstration,
    method: str,
    out: Path,
    min_confidence: float = 0.0,
    video: bool = True,
    weights: Path | None = None,
) -> Rollout:
    """Let a method that was shown `demonstration` act in the trial's scene.

    Writes result.json, steps.png and, if wanted, rollout.mp4 into `out`.

    Raises:
        ImopError: if the demonstration or the scene cannot be used.
    """
    env = trial.env()
    policy = make_policy(method, env.world, min_confidence, weights)
    policy.watch(demonstration if method == "oracle" else demonstration.stripped())
    film = _Film()
    env.on_frame = film if video else None
    panels: list[Panel] = []

    appearance = Appearance(objects_world(trial))
    expert = ExpertPoses(env.task, env.world, lambda: env.observation, appearance)

    def on_action(observation: Observation, action: Action) -> None:
        step = action.match.step if action.match else len(panels)
        expert.took(step, action)
        panels.append(Panel(demonstration.keyframes[step], observation, action, f"step {step}"))

    result = rollout(env, policy, most_actions(method, demonstration, env.task), expert, on_action)
    save_json({**asdict(trial), "method": method, **result.as_dict()}, out / "result.json")
    if panels:
        save_picture(panels, out / "steps.png")
    if film.frames:
        save_video(film.frames, out / "rollout.mp4")
    return result


def steps_table(result: Rollout) -> Table:
    """The steps of an episode for the terminal."""
    table = Table()
    for column in ("action", "support step", "off the expert", "confidence", "decided in", "moved in"):
        table.add_column(column, justify="right")
    for number, step in enumerate(result.steps):
        table.add_row(
            str(number),
            "-" if step.support_step is None else str(step.support_step),
            _error(step.position_error, step.rotation_error),
            f"{step.confidence:.2f}",
            f"{step.policy_seconds:.2f} s",
            step.plan_failed or f"{step.motion_seconds:.2f} s",
        )
    return table


def predict_recorded(
    demonstration: Demonstration,
    recorded: Demonstration,
    method: str,
    out: Path,
    weights: Path | None = None,
    p_world_base: tuple[float, float, float] | None = None,
) -> list[Prediction]:
    """Predict every keyframe of `recorded` and write result.json and steps.png into `out`.

    Args:
        demonstration: what is shown.
        recorded: what is asked.
        method: as for `make_policy`.
        out: folder for the results.
        weights: folder of the learned policy's weights; by default the bundled ones.
        p_world_base: (3,) metres, where the robot's base is in the recordings' frame, whose axes are the
            base's; by default where the simulated one is.

    Raises:
        ImopError: if either recording cannot be used.
    """
    T_imop_world = np.eye(4) if p_world_base is None else T_WORLD_BASE @ se3.invert(se3.make(p=p_world_base))
    demonstration, recorded = (moved(d, T_imop_world) for d in (demonstration, recorded))
    policy = make_policy(method, weights=weights)
    policy.watch(demonstration.stripped())
    predictions = predict(policy, recorded)
    steps = [
        {
            "step": p.step,
            "T_world_gripper": se3.to_pose7(se3.invert(T_imop_world) @ p.action.T_world_gripper).tolist(),
            "gripper_open": p.action.gripper_open,
            "allow_collisions": p.action.allow_collisions,
            "confidence": p.action.confidence,
            "position_error": p.position_error,
            "rotation_error": p.rotation_error,
            "seconds": p.seconds,
        }
        for p in predictions
    ]
    save_json({"method": method, "steps": steps}, out / "result.json")
    panels = []
    for p in predictions:
        step = p.action.match.step if p.action.match else min(p.step, len(demonstration) - 1)
        seen = recorded.keyframes[p.step].observation
        panels.append(Panel(demonstration.keyframes[step], seen, p.action, f"step {p.step}"))
    save_picture(panels, out / "steps.png")
    return predictions


def predictions_table(predictions: list[Prediction]) -> Table:
    """Open-loop predictions for the terminal."""
    table = Table()
    for column in ("keyframe", "off the recording", "confidence", "decided in"):
        table.add_column(column, justify="right")
    for p in predictions:
        off = _error(p.position_error, p.rotation_error)
        table.add_row(str(p.step), off, f"{p.action.confidence:.2f}", f"{p.seconds:.2f} s")
    return table


def _error(position: float | None, rotation: float | None) -> str:
    if position is None or rotation is None:
        return "-"
    return f"{100 * position:.2f} cm, {np.degrees(rotation):.1f} deg"
