from itertools import product

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.instances import VARIATIONS, other_instances, shares
from imop.training.synthetic.plans import Draw, Plan

FEW = {name: TRAINING[name] for name in ("block", "can", "tray")}
PUSHED = ("push", 0, -1, -1)


def plan(*draws):
    return Plan(draws, tuple(draw.thing(FEW) for draw in draws), (PUSHED,))


BLOCK, TWIN, TRAY = Draw("block", 1, 2), Draw("block", 1, 2), Draw("tray", 3, 2)
RED_ONE, LIKE_IT = Draw("block", 7, 2), Draw("block", 1, 8)


def plain(draw):
    return draw._replace(mark=None)


def others(variation, *draws, seed=0):
    return other_instances(plan(*draws), FEW, variation, np.random.default_rng(seed))


def test_colours_change_without_shapes_and_the_reverse():
    for variation, colored, shaped in (("color", True, False), ("shape", False, True), ("both", True, True)):
        shown, asked, changed = others(variation, BLOCK, TRAY)
        before, after = (p.things[0].part.compile() for p in (shown, asked))
        assert changed == {0} and plain(shown.draws[0]) == BLOCK
        assert np.array_equal(before.geom_rgba, after.geom_rgba) != colored
        assert np.array_equal(before.geom_size, after.geom_size) != shaped


def test_what_is_equal_stays_equal():
    shown, asked, _ = others("both", BLOCK, TRAY, TWIN)
    assert shown.draws[0] == shown.draws[2] and asked.draws[0] == asked.draws[2] != BLOCK


def test_what_could_be_confused_with_the_other_thing_is_left_out_or_told_by_a_part():
    told = 0
    for variation, seed in product(("color", "both"), range(10)):
        shown, asked, _ = others(variation, BLOCK, RED_ONE, LIKE_IT, TRAY, seed=seed)
        if shown.draws[0].mark is None:
            assert shown.draws == (BLOCK, TRAY) and len(asked.draws) == 2
            continue
        told += 1
        for plans in (shown, asked):
            blocks = plans.draws[:3]
            # They differ in the colour of the part alone, in each of the scenes.
            assert len({plain(draw) for draw in blocks}) == 1 and len({draw.mark for draw in blocks}) == 3
        assert [d.mark for d in shown.draws] == [d.mark for d in asked.draws]
        assert asked.draws[0].color != BLOCK.color and shown.draws[3] == asked.draws[3] == TRAY
    assert 0 < told < 20


def test_where_there_is_none_of_its_kind_something_else_becomes_one():
    found = [others("both", BLOCK, TRAY, seed=seed)[0].draws for seed in range(10)]
    assert {draws[1].family for draws in found if draws[0].mark is not None} == {"block"}
    assert {draws[1] for draws in found if draws[0].mark is None} == {TRAY}


def test_another_colour_tells_things_apart_whose_shape_changes():
    asked = []
    for seed in range(10):
        shown, other, _ = others("shape", BLOCK, RED_ONE, LIKE_IT, TRAY, seed=seed)
        assert shown.draws == (BLOCK, LIKE_IT, TRAY) and other.draws[2] == TRAY
        asked.append(other.draws)
    # What had the same shape keeps it, or changes it in the same way.
    assert {draws[1].sizes in (None, draws[0].sizes) for draws in asked} == {True}
    assert len({draws[1].sizes is None for draws in asked}) == 2


@pytest.mark.parametrize("mix", [(1, 1), (1, -1, 1, 1), (0, 0, 0, 0), (1, 0, 0, float("nan"))])
def test_a_mix_is_four_shares(mix):
    with pytest.raises(InvalidInput, match="mix"):
        shares(mix)


def test_shares_are_of_sum_one():
    assert shares((2, 1, 1, 0)) == dict(zip(VARIATIONS, (0.5, 0.25, 0.25, 0), strict=True))
