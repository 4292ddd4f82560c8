import pytest

from imop.errors import InvalidInput
from imop.tasks.coppelia.reader import read_model
from imop.tasks.rlbench.edits import reworded
from imop.tasks.rlbench.waypoints import read_words
from tests.tasks.coppelia.conftest import cupboard


def test_other_words_on_a_waypoint_change_nothing_else():
    model = read_model(cupboard())
    changed = reworded(model, "waypoint0", "close_gripper(0.2)")
    assert read_words(changed["waypoint0"].extension).opening == 0.2
    assert [o.name for o in changed.objects if o not in model.objects] == ["waypoint0"]
    with pytest.raises(InvalidInput):
        reworded(model, "waypoint9", "")
