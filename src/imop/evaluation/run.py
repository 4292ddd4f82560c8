"""One task, one demonstration, one new scene: perform it and show what happened."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from imop.evaluation.appearance import Appearance
from imop.evaluation.expert_poses import ExpertPoses
from imop.evaluation.methods import make_policy
from imop.evaluation.picture import Panel, save_picture
from imop.evaluation.recordings import objects_world
from imop.evaluation.report import save_json
from imop.evaluation.rollout import rollout
from imop.evaluation.steps import Rollout
from imop.evaluation.trials import Trial, most_actions
from imop.evaluation.video import save_video
from imop.sim.cameras import look_at, render_view
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
    origin: Mapping[str, object] | None = None,
) -> Rollout:
    """Let a method that was shown `demonstration` act in the trial's scene.

    Writes result.json, steps.png and, if wanted, rollout.mp4 into `out`. What `origin` says goes into
    result.json too: where the demonstration and the weights were read.

    Raises:
        ImopError: if the demonstration or the scene cannot be used.
    """
    env = trial.env()
    policy = make_policy(method, env.world, min_confidence, weights, trial.robot)
    policy.watch(demonstration if method == "oracle" else demonstration.stripped())
    film = _Film()
    env.on_frame = film if video else None
    panels: list[Panel] = []

    appearance = Appearance(objects_world(trial))
    other = demonstration.seeds.get("instance", trial.instance) != trial.instance
    shown = demonstration if other else None
    expert = ExpertPoses(env.task, env.world, lambda: env.observation, appearance, shown)

    def on_action(observation: Observation, action: Action) -> None:
        step = action.match.step if action.match else len(panels)
        expert.took(step, action)
        panels.append(Panel(demonstration.keyframes[step], observation, action, f"step {step}"))

    result = rollout(env, policy, most_actions(method, demonstration, trial, env.task), expert, on_action)
    told = {**asdict(trial), "method": method, **(origin or {}), **result.as_dict()}
    save_json(told, out / "result.json")
    if panels:
        save_picture(panels, out / "steps.png")
    if film.frames:
        save_video(film.frames, out / "rollout.mp4")
    return result
