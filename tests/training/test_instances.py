import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.training.families import TRAINING
from imop.training.instances import VARIATIONS, other_instances, shares
from imop.training.plans import Draw, Plan

FEW = {name: TRAINING[name] for name in ("block", "can", "tray")}
PUSHED = ("push", 0, -1, -1)


def plan(*draws):
    return Plan(draws, tuple(draw.thing(FEW) for draw in draws), (PUSHED,))


BLOCK, TWIN, TRAY = Draw("block", 1, 2), Draw("block", 1, 2), Draw("tray", 3, 2)
RED_ONE, LIKE_IT = Draw("block", 7, 2), Draw("block", 1, 8)


def others(variation, *draws, seed=0):
    return other_instances(plan(*draws), FEW, variation, np.random.default_rng(seed))


def test_colours_change_without_shapes_and_the_reverse():
    for variation, colored, shaped in (("color", True, False), ("shape", False, True), ("both", True, True)):
        shown, asked, changed = others(variation, BLOCK, TRAY)
        before, after = (p.things[0].part.compile() for p in (shown, asked))
        assert changed == {0} and shown.draws[0] == BLOCK and asked.draws[1] == TRAY
        assert np.array_equal(before.geom_rgba, after.geom_rgba) != colored
        assert np.array_equal(before.geom_size, after.geom_size) != shaped


def test_what_is_equal_stays_equal():
    shown, asked, _ = others("both", BLOCK, TRAY, TWIN)
    assert shown.draws[0] == shown.draws[2] and asked.draws[0] == asked.draws[2] != BLOCK


def test_what_could_be_confused_with_the_other_thing_is_left_out():
    for variation in ("color", "both"):
        shown, asked, _ = others(variation, BLOCK, RED_ONE, LIKE_IT, TRAY)
        assert shown.draws == (BLOCK, TRAY) and len(asked.draws) == 2
    # Another colour tells things apart whose shape changes.
    shown, asked, _ = others("shape", BLOCK, RED_ONE, LIKE_IT, TRAY)
    assert shown.draws == (BLOCK, LIKE_IT, TRAY) and asked.draws[1:] == shown.draws[1:]


@pytest.mark.parametrize("mix", [(1, 1), (1, -1, 1, 1), (0, 0, 0, 0), (1, 0, 0, float("nan"))])
def test_a_mix_is_four_shares(mix):
    with pytest.raises(InvalidInput, match="mix"):
        shares(mix)


def test_shares_are_of_sum_one():
    assert shares((2, 1, 1, 0)) == dict(zip(VARIATIONS, (0.5, 0.25, 0.25, 0), strict=True))
