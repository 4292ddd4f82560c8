import pytest

from imop.errors import InvalidInput
from imop.evaluation.methods import make_policy

MODULE = """
import functools
from imop.evaluation.replay import ReplayPolicy

def after(number):
    return ReplayPolicy()

def again():
    return ReplayPolicy()

partial = functools.partial(after, 3)
"""


@pytest.fixture(autouse=True)
def module(tmp_path, monkeypatch):
    (tmp_path / "methods_of_mine.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)


def test_a_function_makes_a_policy():
    assert type(make_policy("methods_of_mine:again")).__name__ == "ReplayPolicy"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("imop:OneShotPolicy", "needs arguments"),
        ("methods_of_mine:after", "needs arguments"),
        # Its source is not found by what it is, so an edit would go unnoticed.
        ("methods_of_mine:partial", "is a partial"),
        ("expert", "expert in eval"),
    ],
)
def test_what_cannot_be_called_without_arguments_is_refused(name, told):
    with pytest.raises(InvalidInput, match=told):
        make_policy(name)
