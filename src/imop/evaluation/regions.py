"""Pictures of the regions that Eq. (3) finds in a store, to look at."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from imop.demos.correspondences import correspondences
from imop.demos.regions import BACKGROUND, by_aim, invariant_region, segmented
from imop.demos.store import DemonstrationStore
from imop.evaluation.picture import Panel, save_picture
from imop.geometry import cloud as clouds
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.types import Action, Demonstration, Match, Observation

VOXEL = 0.006


def region_panels(demonstrations: Sequence[Demonstration]) -> list[Panel]:
    """One row per step of the first demonstration: its region, and the pairs with the last one.

    Args:
        demonstrations: two or more of the same task, variation and objects; all are partners of the first.

    Raises:
        InvalidInput: if there is only one, or one has no segmentation.
    """
    support, query = demonstrations[0], demonstrations[-1]
    states = [[segmented(k) for k in d.keyframes] for d in demonstrations]
    panels = []
    for step, keyframe in enumerate(support.keyframes):
        region = invariant_region(states[0][step], [s[step] for s in states[1:]])
        other = query.keyframes[step]
        p_support = _part(keyframe.observation, region.names).points
        p_query = _objects(other.observation).points
        T_support, T_query = keyframe.action.T_world_gripper, other.action.T_world_gripper
        pairs = correspondences(p_support, T_support, p_query, T_query)
        match = Match(step, p_support[pairs[:, 0]], p_query[pairs[:, 1]], p_support)
        action = Action(T_query, other.action.gripper_open, match=match)
        found = ", ".join(f"{name} ({1000 * region.displacement[name]:.0f} mm)" for name in region.names)
        panels.append(Panel(keyframe, other.observation, action, f"{support.task} {step}: {found}"))
    return panels


def _part(observation: Observation, names: Sequence[str]) -> PointCloud:
    """What is seen of the instances with these names, thinned."""
    cloud = clouds.crop(clouds.fuse(observation), WORKSPACE_LOWER, WORKSPACE_UPPER)
    known = observation.instance_names or {}
    assert cloud.ids is not None
    ids = [i for i, name in known.items() if name in names]
    return clouds.voxel_downsample(cloud.select(np.isin(cloud.ids, ids)), VOXEL)


def _objects(observation: Observation) -> PointCloud:
    known = observation.instance_names or {}
    return _part(observation, [name for name in known.values() if name not in BACKGROUND])


def draw(store: DemonstrationStore, out: Path, count: int) -> list[Path]:
    """Write NAME-VARIATION-OBJECTS.png for the first `count` sets of demonstrations that belong together."""
    together = [(aim, numbers) for aim, numbers in by_aim(store.aims()).items() if len(numbers) > 1]
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for (task, variation, instance), numbers in together[:count]:
        path = out / f"{task.replace('/', '-')}-{variation}-{instance}.png"
        save_picture(region_panels([store[number] for number in numbers]), path)
        written.append(path)
    return written
