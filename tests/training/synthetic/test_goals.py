"""The kinds of goals: what their regions and right motions are, seen in two executions without cameras."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.generate import GenerateConfig, generate
from imop.training.synthetic.plans import SHARES, draw_plan
from imop.training.synthetic.scenes import build, demonstrate
from imop.training.synthetic.stage import Unreachable
from imop.training.synthetic.takes import reference, right_motions, rigid_with
from imop.training.synthetic.viewpoints import placed_cameras

KINDS = ("keep", "unpack", "shove", "sink", "row", "side")
CAMERAS = placed_cameras(np.random.default_rng(0))
SCENES = 1


class Twice:
    """A scene of one kind and what is where in two executions of it."""

    def __init__(self, families, kind, rng):
        self.part = None
        while self.part is None:
            try:
                plan = draw_plan(families, rng, (1.0,), (kind,))
                self.scene = build(plan, CAMERAS, rng)
                self.states = [demonstrate(self.scene, rng) for _ in range(2)]
                self.part = plan.parts[0]
            except Unreachable:
                continue
        stage = self.scene.stage
        self.poses = [[stage.link_poses(state) for state in states] for states in self.states]
        self.steps = self.scene.script.steps

    def region(self, step):
        before, now = (poses[step] for poses in self.poses)
        return rigid_with(reference(self.scene, step), before, now)

    def motions(self, step):
        before, now = (poses[step] for poses in self.poses)
        return right_motions(self.scene, reference(self.scene, step), self.region(step), before, now)

    def shown(self):
        """Numbers of the steps that pairs show."""
        return [i for i, step in enumerate(self.steps) if not step.loose]


@pytest.fixture(scope="module", params=["training", "held out"])
def scenes(request):
    rng = np.random.default_rng(0)
    families = TRAINING if request.param == "training" else HELD_OUT
    return {kind: [Twice(families, kind, rng) for _ in range(SCENES)] for kind in KINDS}


def test_what_is_kept_at_a_goal_stays_in_the_hand_and_its_arrival_is_invariant_to_the_goal(scenes):
    for twice in scenes["keep"]:
        held, target = twice.part[1:3]
        assert all(states[-1].held == held and not states[-1].gripper_open for states in twice.states)
        arrival = next(i for i in twice.shown() if twice.steps[i].thing == target)
        assert (target, "body") in twice.region(arrival)
        assert (held, "body") not in twice.region(arrival)


def test_what_lies_in_a_container_is_taken_without_it(scenes):
    for twice in scenes["unpack"]:
        held, below = twice.part[1:3]
        assert twice.region(1) == [(held, "body")]
        where = [se3.invert(poses[0][below, "body"]) @ poses[0][held, "body"] for poses in twice.poses]
        assert not np.allclose(*where)
        stage = twice.scene.stage
        for T in where:
            low = T[2, 3] - stage.footprint(held, T[:3, :3])[1]
            assert low == pytest.approx(stage.things[below].floors[0].middle[2])


def test_what_is_pushed_ends_at_its_goal_whose_pose_decides(scenes):
    for twice in scenes["shove"]:
        pushed, goal = twice.part[1:3]
        assert not any(step.gripper_open for step in twice.steps)
        first = next(i for i in twice.shown() if twice.steps[i].thing == goal)
        assert (goal, "body") in twice.region(first)
        assert (pushed, "body") not in twice.region(first)
        assert len(twice.motions(first)) == 1
        for states in twice.states:
            gone = states[-1].poses[pushed] - states[0].poses[pushed]
            assert np.linalg.norm(gone[:2, 3]) > 0.03 and gone[2, 3] == pytest.approx(0.0, abs=0.01)
            near = np.linalg.norm(states[-1].poses[pushed][:2, 3] - states[-1].poses[goal][:2, 3])
            assert near < np.linalg.norm(states[0].poses[pushed][:2, 3] - states[0].poses[goal][:2, 3])


def test_what_goes_into_a_hole_is_invariant_to_the_board(scenes):
    for twice in scenes["sink"]:
        board = twice.part[2]
        arrivals = [i for i in twice.shown() if twice.steps[i].thing == board]
        assert arrivals and all((board, "body") in twice.region(i) for i in arrivals)


def test_one_of_several_equal_joints_is_meant(scenes):
    for twice in scenes["row"]:
        assert len({moving.joint for moving in twice.scene.stage.things[twice.part[1]].moving}) >= 3
        for i in twice.shown():
            assert (twice.part[1], "body") in twice.region(i)
            assert len(twice.motions(i)) == 1


def test_what_has_sides_has_no_turns(scenes):
    for twice in scenes["side"]:
        sided = [n for n in twice.part[1:] if n >= 0 and twice.scene.stage.things[n].sided]
        assert sided and all(len(twice.scene.stage.things[n].symmetry) == 1 for n in sided)


def test_loose_steps_end_elsewhere_and_others_at_one_pose():
    rng = np.random.default_rng(1)
    twice = Twice(TRAINING, "keep", rng)
    while all(not step.loose for step in twice.steps):
        twice = Twice(TRAINING, "keep", rng)
    for i, step in enumerate(twice.steps):
        ends = [
            se3.invert(poses[i][step.thing, step.link]) @ states[i + 1].T_world_gripper
            for poses, states in zip(twice.poses, twice.states, strict=True)
        ]
        assert np.allclose(*ends, atol=1e-6) == (not step.loose)


def test_recorded_commands_are_a_little_off_what_is_reached():
    rng, off = np.random.default_rng(2), []
    for _ in range(6):
        scene = build(draw_plan(TRAINING, rng, (1.0,), ("push",)), CAMERAS, rng)
        off.append([se3.translation_distance(np.eye(4), s.T_reached_recorded) for s in scene.script.steps])
    assert any(not np.any(each) for each in off) and any(np.all(np.greater(each, 0)) for each in off)
    assert max(max(each) for each in off) < 0.015


def test_the_new_kinds_are_about_a_third():
    assert sum(SHARES.values()) == pytest.approx(1.0)
    assert 0.25 < sum(SHARES[kind] for kind in KINDS) < 0.45


def test_a_kind_that_does_not_exist_is_refused_and_the_accepted_ones_named(tmp_path):
    with pytest.raises(InvalidInput) as refusal:
        generate(GenerateConfig(tmp_path / "out", 1, kinds=("juggle",)))
    assert "kinds" in str(refusal.value) and all(kind in str(refusal.value) for kind in KINDS)
    assert not (tmp_path / "out").exists()
