"""`imop setup`: says what is wrong with a set-up."""

from contextlib import suppress
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from imop.errors import ImopError, MissingExtra
from imop.terminal import console, status


def setup(
    action: Positional[Literal["check"]],
    file: Positional[Path],
    seen: Path | None = None,
    episode: int = 0,
    out: Path = Path("runs/setup.png"),
) -> int:
    """Say what is wrong with a set-up, and draw what the self-filter leaves of the robot.

    Exit code 1 if anything is wrong that a policy would suffer from.

    Args:
        action: check.
        file: the set-up, .toml or .json (docs/real_robot/setup.md).
        seen: store or folder with a recording of this set-up, whose first observation is compared with it.
        episode: which episode of the recording.
        out: PNG file for the picture; needs --seen and the extra viz.
    """
    from imop.demos.load import load_demonstration
    from imop.setup.arm import SetupArm, arm_of
    from imop.setup.check import check_setup
    from imop.setup.file import load_setup

    found = load_setup(file)
    observation = None if seen is None else load_demonstration(seen, episode).keyframes[0].observation
    arm: SetupArm | None = None
    with status(f"checking {file}"):
        with suppress(ImopError):  # that is a finding
            arm = arm_of(found)
        findings = check_setup(found, observation, arm)
    for finding in findings:
        console.print(str(finding), soft_wrap=True)
    errors = sum(finding.severity == "error" for finding in findings)
    if observation is not None and arm is not None:
        try:
            from imop.setup.picture import draw_filtered

            draw_filtered(found, arm, observation, out)
            console.print(out)
        except MissingExtra as error:
            console.print(f"no picture: {error}")
    console.print(f"{file}: {errors} errors, {len(findings) - errors} warnings")
    return 1 if errors else 0
