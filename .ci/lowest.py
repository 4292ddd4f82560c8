"""Prints constraints.txt with the lowest versions that pyproject.toml allows, where it names any.

PyTorch stays as it is: its lowest version would bring gigabytes of CUDA.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def pins(text: str, sign: str) -> dict[str, str]:
    """Version by name of lines such as "name==1.0"; names as package indices normalise them."""
    found = re.findall(rf"^([\w-]+){sign}([\w.]+)", text, flags=re.MULTILINE)
    return {name.lower().replace("_", "-"): version for name, version in found}


project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
extras = project["optional-dependencies"]
asked = [*project["dependencies"], *extras["sim"], *extras["viz"], *extras["train"], *extras["calibrate"]]
tested = pins((ROOT / "constraints.txt").read_text(), "==")
lowest = tested | pins("\n".join(asked), ">=") | {"torch": tested["torch"]}
print("\n".join(f"{name}=={version}" for name, version in lowest.items()))
