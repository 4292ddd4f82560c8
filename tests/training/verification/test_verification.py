"""Training of the verification on cases, and the cases themselves."""

import math

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.geometry.accuracy import errors
from imop.networks.model import BUNDLED, load_model
from imop.networks.verification import EVIDENCE, VerificationConfig, VerificationNetwork
from imop.policy.learned import LearnedMatcher
from imop.training.data.executed import executions
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.pairs import synthetic_executions, synthetic_scenes
from imop.training.synthetic.takes import reference
from imop.training.verification import cases
from imop.training.verification.cases import Cases, make_cases, off_goals, read_cases, write_cases
from imop.training.verification.fit import Grouped, VerificationTraining, fit, loss
from imop.training.verification.set_up import SetUp


def some(rng, cases=60):
    """Cases in which the candidate that explains the region best is right, if it explains much of it."""
    evidence, off, case = [], [], []
    for k in range(cases):
        x = rng.normal(size=(6, len(EVIDENCE))).astype(np.float32)
        evidence.append(x)
        off.append(np.where((x[:, 0] == x[:, 0].max()) & (x[:, 0] > 0.3), 0.0, 2.0).astype(np.float32))
        case.append(np.full(6, k))
    apart = se3.make(np.eye(3), rng.normal(size=(6 * cases, 3)))
    return Cases(np.concatenate(evidence), apart.astype(np.float32), *map(np.concatenate, (off, case)))


def test_what_decides_is_learned(tmp_path):
    torch.manual_seed(0)
    network = VerificationNetwork(VerificationConfig(width=16, members=2))
    reached = fit(network, some(np.random.default_rng(0), 900), VerificationTraining((), tmp_path, steps=400))
    assert reached["right"] > 0.65 * reached["possible"] > 0.5
    assert reached["calibration"] < 0.35 and abs(reached["sure"] - reached["right"]) < 0.25


def test_the_loss_by_hand():
    # Two candidates of which one is right, and one that is wrong and has nothing to choose from.
    off = torch.tensor([[0.0, 1.5], [math.inf, 0.0]])
    value = loss(torch.zeros(2, 2), off, torch.tensor([[True, True], [True, False]]))
    # Each candidate, the choice between the two, and the likeliest of each case.
    assert value.item() == pytest.approx((1 + 0.5 + 1) * math.log(2), rel=1e-5)


def test_of_two_right_candidates_the_nearer_one_is_to_be_chosen():
    off, real = torch.tensor([[0.1, 0.8]]), torch.ones(1, 2, dtype=torch.bool)
    assert loss(torch.tensor([[3.0, 2.0]]), off, real) < loss(torch.tensor([[2.0, 3.0]]), off, real)


def test_a_case_counts_once_however_many_candidates_it_has():
    few = loss(torch.tensor([[1.0], [-1.0]]), torch.full((2, 1), 2.0), torch.ones(2, 1, dtype=torch.bool))
    logits = torch.tensor([[1.0, 1.0, 1.0], [-1.0, 7.0, 7.0]])
    real = torch.tensor([[True, True, True], [True, False, False]])
    assert few.item() == pytest.approx(loss(logits, torch.full((2, 3), 2.0), real).item())


def test_the_loss_can_be_followed_where_nothing_is_right():
    logits = torch.zeros(2, 3, requires_grad=True)
    real = torch.tensor([[True, True, True], [True, True, False]])
    loss(logits, torch.full((2, 3), math.inf), real).backward()
    assert logits.grad.isfinite().all() and logits.grad[1, 2] == 0 and (logits.grad[real] > 0).all()


def test_cases_of_different_sizes_are_filled_up():
    rng = np.random.default_rng(0)
    goals = se3.make(np.eye(3), [[0, 0, 0], [0.5, 0, 0], [0.505, 0, 0]]).astype(np.float32)
    evidence = rng.normal(size=(3, len(EVIDENCE))).astype(np.float32)
    cases = Cases(evidence, goals, np.array([0.0, 3.0, np.inf], np.float32), np.array([4, 7, 7]))
    found, rival, off, real = Grouped(cases, {4, 7}).take([1, 0, 1])
    assert real.tolist() == [[True, True], [True, False], [True, True]]
    np.testing.assert_array_equal(found[1, 0], evidence[0])
    np.testing.assert_array_equal(found[2], evidence[1:])
    assert off[0].tolist() == [3.0, math.inf] and not rival.any()
    assert len(Grouped(cases, {7})) == 1


def test_candidates_near_to_a_right_pose_are_right():
    right = np.stack([np.eye(4), se3.make(se3.euler(z=2.0), (0.3, 0.0, 0.0))])
    near, far, turned = se3.make(p=(0.015, 0, 0)), se3.make(p=(0.025, 0, 0)), se3.make(se3.euler(z=0.2))
    found = off_goals(np.stack([near, far, right[1], turned]), right)
    np.testing.assert_allclose(found, [0.75, 1.25, 0.0, 0.2 / np.radians(10)], atol=1e-6)
    assert np.isinf(off_goals(right, right[:0])).all()


def test_between_two_turns_of_a_round_thing_everything_is_right():
    families = {name: TRAINING[name] for name in ("bottle", "plate")}
    example = next(
        example
        for scene in synthetic_scenes(families, "same", 4)
        for example in scene
        if len(example.pair.T_query_support) > 2
    )
    thing, link = reference(example.scene, example.step)
    T_world_thing = example.asked.poses[example.step][thing, link]
    turn = T_world_thing @ se3.make(se3.euler(z=np.radians(17.0))) @ se3.invert(T_world_thing)
    goal = example.pair.T_query_support[0] @ example.pair.T_world_goal
    position, rotation = errors(turn @ goal, example.right_poses())
    assert position < 0.01 and rotation <= np.radians(1.0) + 1e-6
    assert off_goals(goal[None], example.right_poses()) < 1


def test_cases_are_made_again_written_and_read(tmp_path):
    model = load_model(BUNDLED)
    families = {name: TRAINING[name] for name in ("block", "tray")}
    rngs = [np.random.default_rng(3) for _ in range(2)]
    made, again = (
        make_cases(model, synthetic_executions(families, (1.0, 0.0, 0.0, 0.0), 3, rng), rng, 1)
        for rng in rngs
    )
    for one, other in zip(made, again, strict=True):
        for judged, same in zip(one, other, strict=True):
            for values, as_values in zip(judged, same, strict=True):
                np.testing.assert_array_equal(values, as_values)
    write_cases(made, tmp_path / "cases-00000.npz")
    write_cases(again, tmp_path / "cases-00001.npz")
    found = read_cases(tmp_path)
    stages = [stage for case in made for stage in case]
    assert found.evidence.shape == (2 * sum(len(off) for *_, off in stages), len(EVIDENCE))
    assert found.case.max() + 1 == 2 * len(stages) and (np.diff(found.case) >= 0).all()
    assert (found.off < 1).any() and np.isfinite(found.evidence).all()
    for values, stored in zip(stages[-1], (found.evidence, found.goals, found.off), strict=True):
        np.testing.assert_array_equal(stored[-len(values) :], values)


def test_nothing_is_right_where_its_things_are_not():
    families = {name: TRAINING[name] for name in ("block", "tray")}
    scenes = synthetic_scenes(families, "same", 5)
    group = executions(next(scenes))[0]
    other = next(scenes)[0].asked.observations[0]
    matcher = LearnedMatcher(load_model(BUNDLED))
    absent, *present = cases._cases(group, matcher, SetUp(), np.random.default_rng(0), elsewhere=other)
    assert len(present) == len(group) and any((off < 1).any() for stages in present for *_, off in stages)
    assert absent and not any((off < 1).any() for *_, off in absent)


def test_as_many_cases_are_made_as_are_asked_for(tmp_path, monkeypatch):
    goals = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    case = [(np.zeros((2, len(EVIDENCE)), np.float32), goals, np.array([0.0, 2.0], np.float32))]
    monkeypatch.setattr(cases, "make_cases", lambda *given: [case] * given[-1])
    cases.case_files(cases.CasesConfig(tmp_path, 23))
    assert read_cases(tmp_path).case.max() + 1 == 23 and len(list(tmp_path.iterdir())) == 2
