"""A decision as shapes: the demonstration to the left, the scene to the right, and what belongs together.

The scene is drawn where it is, in the world; the demonstration beside it, `ASIDE` of where it was.
"""

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.geometry.neighbours import nearest, within
from imop.types import Action, BoolArray, FloatArray
from imop.viewing.drawables import Color, Drawable, Gripper, Label, Lines, Path, Points
from imop.viewing.look import Look, Shown

ASIDE = np.array([0.0, -1.15, 0.0])
"""From the demonstration's own frame to where it is drawn, metres."""

# Of the points of scenes, and of those that stand out of them, metres.
POINT, MARKED = 0.006, 0.0075
MOST_LINES = 40
# What the region was carried to is marked where something is seen so near to it, metres.
FOUND = 0.01
SMALLEST, LARGEST = 0.002, 0.03
"""Spreads at the ends of the scale of colours, metres."""
_DARK, _BLUE, _TEAL, _GREEN, _YELLOW = (
    (0.27, 0.0, 0.33),
    (0.23, 0.32, 0.55),
    (0.13, 0.57, 0.55),
    (0.37, 0.79, 0.38),
    (0.99, 0.91, 0.14),
)
SCALE = np.array([_DARK, _BLUE, _TEAL, _GREEN, _YELLOW])
"""(K, 3) colours from what is invariant to what is not, which differ in brightness too."""
REGION: Color = (0.07, 0.63, 0.31)
MATCH: Color = (0.84, 0.15, 0.16)
PREDICTED: Color = (0.12, 0.25, 0.85)
OTHER: Color = (0.55, 0.62, 0.9)
NOW: Color = (0.35, 0.35, 0.35)
KNOWN: Color = (0.0, 0.6, 0.2)
MEANT: Color = (0.95, 0.2, 0.75)
# Other choices that are less probable than this are named in a list, but not drawn.
UNLIKELY = 0.005
# Words that are nearer to each other than this are read as one, metres.
ONE_PLACE = 0.06
# How much of a scene's colours is left, so that what is marked stands out.
FADED = 0.75


def draw(look: Look) -> list[Drawable]:
    """All that there is to see of a decision, each with a name of its own.

    "demonstration/...", "scene/...", and "matches" between them; other candidates and their labels are
    "scene/others/...".
    """
    shapes: list[Drawable] = [*_scene(look)]
    if look.shown is not None:
        region = None if look.action is None or look.action.match is None else look.action.match.region
        shapes += _demonstration(look.shown, region)
    shapes += _matches(look)
    return shapes


def spread_colors(spread: FloatArray) -> FloatArray:
    """(M, 3) colours of spreads (M,), metres, on a logarithmic scale."""
    share = np.log(np.clip(spread, SMALLEST, LARGEST) / SMALLEST) / np.log(LARGEST / SMALLEST)
    at = np.linspace(0, 1, len(SCALE))
    return np.stack([np.interp(share, at, column) for column in SCALE.T], axis=1)


def _demonstration(shown: Shown, region: FloatArray | None) -> list[Drawable]:
    """The demonstrated state, its region, and where the gripper went, before and after."""
    observation, cloud = shown.scene.observation, shown.scene.fused
    shapes: list[Drawable] = []
    if region is not None and len(region):
        colors = _region_colors(shown, len(region))
        shapes.append(Points("demonstration/region", region + ASIDE, colors, MARKED))
        cloud = cloud.select(~within(cloud.points, region, 1e-6))
    shapes.append(_cloud("demonstration/cloud", cloud, ASIDE))
    tips = np.stack([action.T_world_gripper[:3, 3] for action in shown.actions])
    tips = np.concatenate([observation.T_world_gripper[None, :3, 3], tips[shown.step :]]) + ASIDE
    shapes.append(Path("demonstration/path", tips[:2], PREDICTED))
    if len(tips) > 2:
        shapes.append(Path("demonstration/later", tips[1:], OTHER, 2.0))
    shapes.append(_gripper("demonstration/gripper", shown.action, PREDICTED, ASIDE))
    before = _aside(observation.T_world_gripper)
    shapes.append(Gripper("demonstration/now", before, observation.gripper_opening, NOW, 2.0))
    title = f"demonstration, step {shown.step + 1} of {len(shown.actions)}"
    return [*shapes, _title("demonstration/title", title, shown.scene.fused, ASIDE)]


def _scene(look: Look) -> list[Drawable]:
    """What is seen, where the region was found, and what may be done."""
    observation, cloud, action = look.scene.observation, look.scene.fused, look.action
    shapes: list[Drawable] = []
    if look.scene.focus is not None and look.scene.focus.any():
        shapes.append(_marked("scene/focus", cloud.points[look.scene.focus], MEANT))
        cloud = cloud.select(~look.scene.focus)
    found = _found(look, cloud)
    if found is not None:
        shapes.append(Points("scene/region", cloud.points[found[0]], found[1], MARKED))
        cloud = cloud.select(~found[0])
    shapes.append(_cloud("scene/cloud", cloud, np.zeros(3)))
    T_now, opening = observation.T_world_gripper, observation.gripper_opening
    shapes.append(Gripper("scene/now", T_now, opening, NOW, 2.0))
    if look.known is not None:
        shapes.append(Gripper("scene/known", look.known, opening, KNOWN, 2.0))
    if action is not None:
        shapes.append(_gripper("scene/gripper", action, PREDICTED, np.zeros(3)))
    if look.way is not None:
        shapes.append(Path("scene/path", look.way, PREDICTED))
    shapes += _others(look)
    title = "scene" if action is None else f"scene, predicted with {action.confidence:.0%}"
    return [*shapes, _title("scene/title", title, look.scene.fused, np.zeros(3))]


def _others(look: Look) -> list[Drawable]:
    """Choices with their probabilities; those in one place share their words."""
    shapes: list[Drawable] = []
    places: list[tuple[FloatArray, list[str]]] = []
    for number, action in enumerate(look.choices):
        if number != look.chosen and action.confidence < UNLIKELY:
            continue
        if number != look.chosen:
            shapes.append(_gripper(f"scene/others/{number}", action, OTHER, np.zeros(3), 2.0))
        p_hand = se3.apply(action.T_world_gripper, np.array([[0.0, 0.0, -0.12]]))[0]
        words = f"{number + 1}: {action.confidence:.0%}"
        near = (said for p, said in places if np.linalg.norm(p - p_hand) < ONE_PLACE)
        if said := next(near, None):
            said.append(words)
        else:
            places.append((p_hand, [words]))
    labels = [Label(f"scene/others/label {k}", ", ".join(said), p) for k, (p, said) in enumerate(places)]
    return shapes + labels


def _matches(look: Look) -> list[Drawable]:
    """Lines from matched points of the region to their counterparts."""
    match = None if look.action is None else look.action.match
    if match is None or not len(match.p_support):
        return []
    some = np.linspace(0, len(match.p_support) - 1, min(MOST_LINES, len(match.p_support))).astype(int)
    ends = np.stack([match.p_support[some] + ASIDE, match.p_query[some]], axis=1)
    return [Lines("matches", ends, MATCH, 1.0)]


def _found(look: Look, cloud: PointCloud) -> tuple[BoolArray, FloatArray] | None:
    """(N,) which points of a cloud the region was carried to, and colours of these; None if none were."""
    match = None if look.action is None else look.action.match
    if match is None or match.T_query_support is None or not len(match.region):
        return None
    carried = se3.apply(match.T_query_support, match.region)
    distance, index = nearest(cloud.points, carried)
    there = distance[:, 0] < FOUND
    if not there.any():
        return None
    return there, np.asarray(_region_colors(look.shown, len(carried))[index[there, 0]])


def _region_colors(shown: Shown | None, count: int) -> FloatArray:
    """(M, 3) colours of a region of that many points."""
    if shown is None or shown.spread is None:
        return np.tile(REGION, (count, 1))
    return spread_colors(shown.spread)


def _cloud(name: str, cloud: PointCloud, shift: FloatArray) -> Points:
    colors = 1 - FADED * (1 - cloud.colors.astype(np.float64))
    return Points(name, cloud.points + shift, np.clip(colors, 0, 1), POINT)


def _marked(name: str, points: FloatArray, color: Color) -> Points:
    return Points(name, points, np.tile(color, (len(points), 1)), MARKED)


def _aside(T: FloatArray) -> FloatArray:
    return se3.make(T[:3, :3], T[:3, 3] + ASIDE)


def _gripper(name: str, action: Action, color: Color, shift: FloatArray, width: float = 5.0) -> Gripper:
    T = action.T_world_gripper
    return Gripper(name, se3.make(T[:3, :3], T[:3, 3] + shift), float(action.gripper_open), color, width)


def _title(name: str, text: str, cloud: PointCloud, shift: FloatArray) -> Label:
    """Before a cloud, seen from the front."""
    lower, upper = cloud.points.min(axis=0), cloud.points.max(axis=0)
    p = np.array([upper[0] + 0.12, (lower[1] + upper[1]) / 2, lower[2]])
    return Label(name, text, p + shift, 1.6)
