"""A policy that is quick and remembers, so that what one client does to another's episode can be seen."""

import os
import time

import numpy as np

from imop.errors import NoConfidentMatch
from imop.types import Action, CameraView, Demonstration, Keyframe, Match, Observation

# What an observation's time step makes the policy do.
SLEEP, NAP, CRASH, UNSURE, GREEDY, BUG = 10_001, 10_002, 10_003, 10_004, 10_005, 10_006


class Remembering:
    """Goes to x: sum of all openings of the episode, y: how many of them, z: demonstrations watched."""

    def __init__(self):
        self.watched, self.seen, self.leak = 0, [], []

    def watch(self, demonstration):
        self.watched += 1

    def reset(self):
        self.seen = []

    def act(self, observation, focus=None):
        self.meant = focus
        todo = observation.time_step
        if todo == SLEEP:
            time.sleep(600)
        elif todo == NAP:
            time.sleep(0.1)
        elif todo == CRASH:
            os._exit(11)
        elif todo == UNSURE:
            raise NoConfidentMatch(0.25, 0.5)
        elif todo == GREEDY:
            bytearray(2**40)
        elif todo == BUG:
            raise KeyError("a bug of the policy")
        self.seen.append(observation.gripper_opening)
        T = np.eye(4)
        T[:3, 3] = sum(self.seen), len(self.seen), self.watched
        points = np.arange(12.0).reshape(4, 3)
        match = Match(2, points, points + 1, points, T, "somebody", 0.75)
        return Action(T, len(self.seen) % 2 == 0, True, 0.75, match, False)


def observe(opening=0.5, time_step=0, shape=(4, 6), cameras=("front", "wrist")):
    random = np.random.default_rng(0)
    views = {
        name: CameraView(
            random.integers(0, 255, (*shape, 3), dtype=np.uint8),
            random.uniform(0.3, 2, shape).astype(np.float32),
            np.array([[9.0, 0, 3], [0, 9, 2], [0, 0, 1]]),
            np.eye(4),
        )
        for name in cameras
    }
    return Observation(views, np.eye(4), opening, time_step, np.linspace(0, 1, 7))


def demonstrate(steps=2, shape=(4, 6)):
    action = Action(np.eye(4), gripper_open=False, allow_collisions=True)
    keyframes = tuple(Keyframe(observe(shape=shape), action) for _ in range(steps))
    return Demonstration(keyframes, observe(shape=shape), "some/task", instructions=("do it",))


class Plain(Remembering):
    """Cannot be told what is meant."""

    def act(self, observation):
        return super().act(observation)


class Refusing(Remembering):
    """Cannot watch anything."""

    def watch(self, demonstration: Demonstration):
        from imop.errors import InvalidInput

        raise InvalidInput("demonstration", "is not liked", "another")
