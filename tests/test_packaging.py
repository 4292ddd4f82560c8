"""The base alone does what a policy needs; what is missing beyond it is named with its extra."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from imop.demos.store import DemonstrationStore
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration

PYPROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
MODULES = {
    "sim": ("mujoco", "ompl", "toppra", "frankik", "gymnasium"),
    "arms": ("mink",),
    "viz": ("matplotlib", "av"),
    "train": ("lightning_fabric", "tensorboard"),
    "baselines": ("open3d",),
    "cluster": ("ray",),
    "view": ("viser", "websockets"),
    "calibrate": ("cv2",),
    "serve": ("msgpack", "websockets"),
    "import": ("rosbags", "pyarrow"),
    "franka": ("franky",),
    "universal_robots": ("rtde_control", "rtde_receive", "dashboard_client"),
    "realsense": ("pyrealsense2",),
}
# What brings a module of another name.
DISTRIBUTIONS = {"cv2": "opencv_python_headless", "rtde_control": "ur_rtde", "rtde_receive": "ur_rtde"}
DISTRIBUTIONS["dashboard_client"] = "ur_rtde"
# Modules that need an extra though their package is the base.
DRIVERS = {
    "imop.robots.franka": "franka",
    "imop.robots.universal_robots": "universal_robots",
    "imop.cameras.realsense": "realsense",
}
EVERY = tuple(module for modules in MODULES.values() for module in modules)
# Imports every module; prints which extra it lacks, or a dash.
EVERY_MODULE = """
import importlib, pkgutil, imop
from imop.errors import MissingExtra
for module in pkgutil.walk_packages(imop.__path__, "imop.", onerror=lambda name: None):
    try:
        importlib.import_module(module.name)
        print(module.name, "-")
    except MissingExtra as error:
        print(module.name, error.extra)
"""


def python(code: str, *arguments: str, without: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    """Run code in another process, where the modules `without` seem not to be installed."""
    hide = f"import sys; sys.modules.update(dict.fromkeys({without!r}));"
    return subprocess.run([sys.executable, "-c", hide + code, *arguments], capture_output=True, text=True)


def imop(*arguments: str, without: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    return python("from imop.cli import main; main()", *arguments, without=without)


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "demos.zarr"
    made = DemonstrationStore.create(path)
    made.append(record_demonstration(make_task("tabletop/lid_off_pot"), 1, 0))
    return path


@pytest.fixture(scope="module")
def base_only() -> dict[str, str]:
    """Which extra each module lacks where no extra is installed."""
    done = python(EVERY_MODULE, without=EVERY)
    assert done.returncode == 0, done.stderr
    return dict(line.split() for line in done.stdout.splitlines())


@pytest.mark.parametrize(
    "package", ["cameras", "cli", "demos", "geometry", "networks", "policy", "robots", "types"]
)
def test_the_base_is_all_that_a_policy_needs(base_only, package):
    lacking = {m: e for m, e in base_only.items() if m.split(".")[1] == package and m not in DRIVERS}
    assert lacking
    assert set(lacking.values()) == {"-"}


@pytest.mark.parametrize(
    ("module", "extra"),
    [
        ("imop.evaluation.predict", "-"),
        ("imop.evaluation.picture", "viz"),
        ("imop.evaluation.video", "viz"),
        ("imop.evaluation.appearance", "sim"),
        ("imop.serving.client", "serve"),
        ("imop.serving.server", "serve"),
        ("imop.serving.command", "-"),
        ("imop.training.config", "-"),
        ("imop.setup.arm", "-"),
        ("imop.setup.picture", "viz"),
        ("imop.training.synthetic.stage", "sim"),
        ("imop.viewing.cases", "-"),
        ("imop.viewing.draw", "-"),
        ("imop.viewing.simulated", "sim"),
        ("imop.viewing.window", "view"),
        ("imop.viewing.on_robot", "-"),
        ("imop.setup.drivers", "-"),
        *DRIVERS.items(),
    ],
)
def test_what_is_beyond_the_base_names_its_extra(base_only, module, extra):
    assert base_only[module] == extra


@pytest.mark.parametrize(
    ("module", "extra"), [("toppra", "sim"), ("gymnasium", "sim"), ("av", "viz"), ("tensorboard", "train")]
)
def test_a_single_missing_module_is_named_with_its_extra(module, extra):
    done = python(EVERY_MODULE, without=(module,))
    assert done.returncode == 0, done.stderr
    lacking = dict(line.split() for line in done.stdout.splitlines())
    assert {lacking[name] for name in lacking if name not in DRIVERS} == {"-", extra}


def test_extras_bring_the_modules_that_they_are_named_for():
    extras = PYPROJECT["project"]["optional-dependencies"]
    for name, modules in MODULES.items():
        required = " ".join(extras[name]).replace("-", "_")
        assert all(DISTRIBUTIONS.get(module, module) in required for module in modules)
    assert set(MODULES) == {name for name in extras if name not in ("all", "dev", "docs")}


def test_a_policy_predicts_recorded_data_with_the_base_alone(store, tmp_path):
    arguments = ("--demo", str(store), "--query", str(store), "--out", str(tmp_path))
    done = imop("predict", *arguments, without=EVERY)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "result.json").exists()
    assert "imop[viz]" in done.stdout
    assert imop("check", str(store), without=EVERY).returncode == 0


@pytest.mark.parametrize("verb", [("run", "--task", "tabletop/lid_off_pot"), ("eval",), ("tasks",)])
def test_verbs_that_need_a_simulator_say_so(verb):
    done = imop(*verb, without=("mujoco",))
    assert done.returncode == 2
    assert "mujoco is not installed" in done.stderr


def test_public_names_without_their_extra_say_so():
    done = python("import imop; imop.make_env", without=("mujoco",))
    assert "MissingExtra" in done.stderr


@pytest.mark.parametrize("code", ["import imop", "from imop.cli import main; main(['--help'])"])
def test_names_and_help_wait_for_nothing_heavy(code):
    heavy = ("torch", "numpy", "scipy", "zarr", "mujoco", "matplotlib", "av", "gymnasium", "small_gicp")
    done = python(f"import atexit; atexit.register(lambda: print(set({heavy}) & set(sys.modules))); {code}")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "set()"
