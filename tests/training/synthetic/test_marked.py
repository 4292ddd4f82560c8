import numpy as np

from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.families.marked import mark, telling
from imop.training.synthetic.plans import Draw


def rgba(draw):
    return draw.thing(TRAINING).part.compile().geom_rgba


def test_the_part_that_tells_is_some_of_the_thing_and_has_its_own_colour():
    found = 0
    for name in sorted(TRAINING):
        geoms = list(telling(TRAINING[name], 3))
        plain = rgba(Draw(name, 3, 1))
        rest = np.setdiff1d(np.arange(len(plain)), geoms)
        assert len(rest)
        for color in (1, 2) if geoms else ():
            colors, before = rgba(Draw(name, 3, color, mark=5)), rgba(Draw(name, 3, color))
            assert len(np.unique(colors[geoms], axis=0)) == 1
            assert np.array_equal(colors[rest], before[rest])
            found += 1
    assert found > len(TRAINING)


def test_what_has_no_such_part_stays_as_it_is():
    thing = Draw("block", 1, 2).thing(TRAINING)
    before = thing.part.compile().geom_rgba
    mark(thing, (), 3)
    assert np.array_equal(thing.part.compile().geom_rgba, before)
