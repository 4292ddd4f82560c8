import pytest

from imop.errors import InvalidInput
from imop.evaluation.trials import DEMONSTRATION_SEED, suite_trials


def test_scenes_that_would_be_those_of_demonstrations_are_refused_before_any_is_tried():
    last = DEMONSTRATION_SEED - 2
    (trials,) = suite_trials("tabletop", "all", ("lid_off_pot",), 2, last, 0).values()
    assert [trial.seed for trial in trials] == [last, last + 1]
    with pytest.raises(InvalidInput, match="seed"):
        suite_trials("tabletop", "all", ("lid_off_pot",), 3, last, 0)
