"""The fakes have the parameters of the real packages, where those are installed."""

import importlib
import inspect
import re

import pytest

from tests.cameras.fake_realsense import realsense_module
from tests.robots.fakes import Controller, franky_module, ur_modules

FAKES = {"franky": franky_module(), "pyrealsense2": realsense_module()[0], **ur_modules(Controller())}
CLASSES = [
    (package, name)
    for package, module in FAKES.items()
    for name, one in vars(module).items()
    if inspect.isclass(one) and not issubclass(one, Exception)
]


def signatures(function):
    """Names of the parameters of each overload, of a function that pybind11 made."""
    lines = re.findall(r"^(?:\d+\. )?\w+\(self: [^)\n]*.*$", function.__doc__ or "", re.MULTILINE)
    return [set(re.findall(r"(\w+): ", line)) for line in lines]


@pytest.mark.parametrize(("package", "name"), CLASSES)
def test_the_real_class_takes_what_the_fake_takes(package, name):
    real = pytest.importorskip(package, reason=f"{package} is not installed")
    fake, real = getattr(FAKES[package], name), getattr(real, name)
    for method, function in inspect.getmembers(fake, inspect.isfunction):
        if method.startswith("_") and method != "__init__":
            continue
        wanted = set(inspect.signature(function).parameters) - {"self"}
        found = signatures(getattr(real, method))
        assert any(wanted <= names for names in found), f"{method}{sorted(wanted)}: {found}"
    for attribute, value in vars(fake).items():
        if isinstance(value, property):
            assert hasattr(real, attribute), attribute


def test_the_real_exceptions_are_franky_s():
    franky = pytest.importorskip("franky", reason="franky is not installed")
    for name in ("ControlException", "NetworkException", "CommandException"):
        assert issubclass(getattr(franky, name), franky.Exception)
    assert importlib.import_module("franky").RealtimeConfig.Ignore
