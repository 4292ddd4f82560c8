"""Arrows point one way: types <- geometry <- demos <- networks <- policy <- the rest."""

import ast
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "imop"
BASE = {"types", "errors", "extras", "files"}
ALLOWED = {
    "errors": set(),
    "extras": {"errors"},
    "files": {"errors"},
    "plugins": {"errors"},
    "types": {"errors"},
    "geometry": BASE,
    "demos": BASE | {"geometry"},
    "networks": BASE | {"geometry", "demos"},
    "baselines": BASE | {"geometry", "demos", "networks", "robots"},
    "policy": BASE | {"geometry", "demos", "networks"},
    "robots": BASE | {"geometry"},
    "cameras": BASE | {"geometry"},
    "setup": BASE | {"geometry", "demos", "robots", "cameras", "sim", "terminal"},
    "sim": BASE | {"geometry", "robots", "cameras"},
    "calibration": BASE | {"geometry", "demos", "robots", "cameras", "sim", "setup", "plugins", "terminal"},
    "tasks": BASE | {"geometry", "robots", "sim", "plugins"},
    "training": BASE | {"geometry", "demos", "networks", "policy", "robots", "sim"},
    "evaluation": BASE
    | {
        "geometry",
        "demos",
        "networks",
        "policy",
        "baselines",
        "training",
        "robots",
        "setup",
        "sim",
        "tasks",
        "plugins",
    },
}
ALLOWED["terminal"] = set()
ALLOWED["recording"] = ALLOWED["calibration"] | {"calibration", "tasks"}
ALLOWED["importing"] = ALLOWED["recording"] | {"recording"}
ALLOWED["reproduce"] = ALLOWED["evaluation"] | {"evaluation", "terminal"}
ALLOWED["viewing"] = ALLOWED["reproduce"] | {"cameras", "setup", "serving"}
ALLOWED["serving"] = BASE | {"geometry", "demos", "policy", "evaluation", "terminal"}

COMMANDS = ("cli", "cli_baselines", "cli_data", "cli_training")
TRAINING = {
    "data": set(),
    "loop": {"data"},
    "recorded": {"data"},
    "synthetic": {"data"},
    "verification": {"data", "recorded", "synthetic"},
    "recipes": {"data"},
}
"""Packages of `training`, and which others they know; all may read its configurations."""


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module] if node.module != "imop" else [f"imop.{a.name}" for a in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        yield from (name.split(".")[1] for name in names if name.startswith("imop."))


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_follow_the_arrows(path):
    package = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    if package in ("__init__", *COMMANDS):
        return
    forbidden = set(imports(path)) - ALLOWED[package] - {package}
    assert not forbidden, f"{path} imports {forbidden}"


def test_nobody_imports_the_command_line():
    assert not [p for p in SOURCE.rglob("*.py") if set(COMMANDS) & set(imports(p)) and p.name != "cli.py"]


@pytest.mark.parametrize("package", TRAINING)
def test_the_parts_of_the_training_know_few_others(package):
    used = set()
    for path in (SOURCE / "training" / package).rglob("*.py"):
        used |= set(re.findall(r"imop\.training\.(\w+)", path.read_text()))
    assert used <= TRAINING[package] | {package, "ablation", "config"}


@pytest.mark.parametrize("package", ["policy", "networks"])
def test_policies_name_no_task_and_no_privileged_field(package):
    words = ("open_drawer", "stack_cubes", "lid_off_pot", "rubbish_in_bin", "instance_ids", "instance_names")
    words += ("object_name", "T_world_object", "joint_velocities", ".task", ".ids")
    for path in (SOURCE / package).rglob("*.py"):
        found = [word for word in words if word in path.read_text()]
        assert not found, f"{path}: {found}"
