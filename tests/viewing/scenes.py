"""Two boxes on a table, a policy that always knows where, and a world in which nothing falls."""

import numpy as np

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.geometry.neighbours import within
from imop.policy.interfaces import Scene
from imop.types import Action, Match
from imop.viewing.look import Look, Shown
from imop.viewing.worlds import Outcome, straight
from tests.policy.scenes import BLUE, GREEN, above, at, box, scene

MOVED = se3.make(se3.euler(z=0.6), (0.1, 0.15, 0.0))
"""From the demonstrated scene into the observed one."""
SIZE = (0.1, 0.08, 0.06)
GREEN_AT, BLUE_AT = at(0.1, -0.1), at(0.35, -0.25)


def demonstrated_scene():
    return scene([box(SIZE, GREEN, GREEN_AT), box(SIZE, BLUE, BLUE_AT)], above(0.0, 0.0, 1.1))


def observed_scene():
    return scene([box(SIZE, GREEN, MOVED @ GREEN_AT), box(SIZE, BLUE, BLUE_AT)], above(0.0, 0.0, 1.1))


ACTIONS = (Action(above(0.1, -0.1, 0.85), True), Action(above(0.1, -0.1, 0.8), False))


def shown(step=0, spread=True):
    here = demonstrated_scene()
    region = region_of(here)
    values = np.linspace(0.001, 0.04, len(region)) if spread else None
    return Shown(step, here, ACTIONS, values)


def region_of(here):
    return here.fused.points[within(here.fused.points, box(SIZE, GREEN, GREEN_AT).points, 1e-6)]


def choice(T, probability, region, matched=True):
    p_support = region[::20] if matched else region[:0]
    match = Match(0, p_support, se3.apply(T, p_support), region, T, "fit", probability)
    return Action(T @ ACTIONS[0].T_world_gripper, True, confidence=probability, match=match)


def look(seen=None, probabilities=(0.8, 0.15), spread=True):
    before = shown(spread=spread)
    region = region_of(before.scene)
    motions = (MOVED, BLUE_AT @ se3.invert(GREEN_AT), np.eye(4))
    choices = tuple(
        choice(T, p, region, number == 0)
        for number, (T, p) in enumerate(zip(motions, probabilities, strict=False))
    )
    return Look(seen or observed_scene(), choices, before)


class FakeDecider:
    """Likeliest is the green box; told what is meant, that."""

    def __init__(self):
        self.taken, self.told, self.resets = [], [], 0

    def reset(self):
        self.resets += 1

    def decide(self, observation, focus=None):
        self.told.append(focus)
        here = observed_scene()
        if focus is None:
            return look(here)
        meant = within(here.fused.points, focus.points, 0.015)
        found = look(Scene(here.observation, here.fused, meant))
        return found if meant[np.argmax(found.scene.fused.colors[:, 1])] else found.choose(1)

    def take(self, number):
        self.taken.append(number)


class FakeWorld:
    """Three actions, then it is done."""

    def __init__(self, length=3, fails=()):
        self.performed, self.stopped, self.blind = [], 0, False
        self._length, self._fails = length, fails

    def observe(self):
        if self.blind:
            raise ConnectionError("the camera is gone")
        return observed_scene().observation

    def way(self, action):
        if any(np.allclose(T, action.T_world_gripper) for T in self._fails):
            raise PlanFailed("unreachable")
        return straight(self.observe().T_world_gripper, action)

    def known(self):
        return None

    def perform(self, action):
        self.performed.append(action)
        over = len(self.performed) == self._length
        return Outcome(over, "done" if over else "")

    def stop(self):
        self.stopped += 1
