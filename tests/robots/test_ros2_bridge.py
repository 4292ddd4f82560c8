"""The ROS 2 example cannot run here: its text is sound, and its classes have the protocols' methods."""

import ast
import inspect
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest

from imop.cameras.interfaces import Camera
from imop.robots.interfaces import REASONS, MotionFailure, Robot

TREE = ast.parse((Path(__file__).parents[2] / "examples" / "ros2_bridge.py").read_text())


def methods(name):
    found = next(node for node in TREE.body if isinstance(node, ast.ClassDef) and node.name == name)
    return {node.name: node for node in found.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize(("name", "protocol"), [("MoveItRobot", Robot), ("RosCamera", Camera)])
def test_its_classes_have_the_methods_of_the_protocols(name, protocol):
    there = methods(name)
    for method, function in inspect.getmembers(protocol, inspect.isfunction):
        if method.startswith("_"):
            continue
        arguments = there[method].args
        names = [one.arg for one in (*arguments.args, *arguments.kwonlyargs)]
        assert names == list(inspect.signature(function).parameters)


def test_its_reasons_are_known():
    called = [node for node in ast.walk(TREE) if isinstance(node, ast.Call)]
    given = {
        call.args[1].value
        for call in called
        if getattr(call.func, "id", "") == "MotionResult" and isinstance(call.args[1], ast.Constant)
    }
    assert given <= set(REASONS) and get_args(MotionFailure)


@pytest.mark.parametrize(
    ("encoding", "kind", "shape"),
    [("rgb8", np.uint8, (4, 5, 3)), ("bgr8", np.uint8, (4, 5, 3)), ("16UC1", np.uint16, (4, 5))],
)
def test_its_images_are_what_was_sent_whatever_the_rows_are_padded_with(encoding, kind, shape):
    function = next(node for node in TREE.body if getattr(node, "name", "") == "pixels")
    names = {"np": np}
    exec(compile(ast.Module([function], []), "ros2_bridge", "exec"), names)
    sent = np.random.default_rng(0).integers(0, 200, shape).astype(kind)
    raw = (sent[..., ::-1] if encoding == "bgr8" else sent).reshape(4, -1)
    rows = np.ascontiguousarray(raw).view(np.uint8).reshape(4, -1)
    padded = np.concatenate([rows, np.full((4, 7), 255, np.uint8)], axis=1)
    step = padded.shape[1]
    message = SimpleNamespace(encoding=encoding, height=4, width=5, step=step, data=padded.tobytes())
    assert np.array_equal(names["pixels"](message), sent)
