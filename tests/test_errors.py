import importlib
import inspect
import pickle
import pkgutil
from contextlib import suppress
from pathlib import Path

import pytest
from joblib import Parallel, delayed

import imop
from imop.errors import CorruptData, ImopError, MissingExtra

SAMPLES = {str: "words [in brackets]", int: 7, float: 0.25, Path: Path("a/b.zarr"), object: "unreachable"}


def kinds():
    """Every error that the package defines, after all of it that is installed was imported."""
    for module in pkgutil.walk_packages(imop.__path__, "imop."):
        with suppress(MissingExtra):  # drivers of real arms and cameras
            importlib.import_module(module.name)
    found, new = set(), {ImopError}
    while new:
        found |= new
        new = {child for kind in new for child in kind.__subclasses__()} - found
    return sorted((k for k in found if k.__module__.startswith("imop.")), key=lambda kind: kind.__name__)


def sample(kind):
    """An error made with an argument of the right type for every parameter."""
    if kind.__init__ is Exception.__init__:
        return kind("words")
    parameters = list(inspect.signature(kind).parameters.values())
    return kind(*(SAMPLES.get(p.annotation, SAMPLES[object]) for p in parameters))


def raised(error):
    raise error


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.__name__)
def test_every_error_survives_pickling(kind):
    error = sample(kind)
    error.add_note("seen by the reader")
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(error, protocol))
        assert type(again) is kind and str(again) == str(error) and again.__dict__ == error.__dict__


def test_an_error_of_a_worker_arrives_as_it_was_raised():
    error = CorruptData(Path("demos.zarr"), "torn", "record it again")
    with pytest.raises(CorruptData, match="torn") as caught:
        Parallel(n_jobs=2)(delayed(raised)(e) for e in (error, error))
    assert caught.value.path == error.path and caught.value.remedy == error.remedy
