from dataclasses import replace

import pytest

from imop.tasks.coppelia.lacks import lacks
from imop.tasks.coppelia.model import Model


def changed(model, name, **fields):
    return Model(tuple(replace(o, **fields) if o.name == name else o for o in model.objects), {})


def test_a_model_that_we_do_wholly_lacks_nothing(cupboard_model):
    assert lacks(cupboard_model) == []


@pytest.mark.parametrize(
    ("name", "fields", "word"),
    [
        ("slide", {"lead": 0.01}, "screws"),
        ("slide", {"motor": "position"}, "motors"),
        ("slide", {"motor": "velocity", "target_velocity": 0.2}, "motors"),
        ("waypoint0", {"linked": 0}, "dummies"),
    ],
)
def test_what_is_lacking_is_named_with_the_object(cupboard_model, name, fields, word):
    (said,) = lacks(changed(cupboard_model, name, **fields))
    assert word in said and said.endswith(name)


def test_a_motor_that_stands_still_is_a_brake_and_lacks_nothing(cupboard_model):
    assert lacks(changed(cupboard_model, "slide", motor="velocity", target_velocity=0.0)) == []
