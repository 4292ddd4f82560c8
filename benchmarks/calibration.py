"""How exact calibrations are, which knocks are noticed, and what is said where nothing is wrong.

    python benchmarks/calibration.py --seeds 100

Corners are projected with noise, see `imop.calibration.synthetic`. Knocks are 5 mm, or 1 degree, in random
directions. Prints tables for docs/real_robot/calibration.md.
"""

import argparse
from collections import Counter
from dataclasses import replace

import numpy as np

from imop.calibration.calibrate import calibrate
from imop.calibration.knocked import moved_since
from imop.calibration.problems import NotCalibrated
from imop.calibration.result import Calibration
from imop.calibration.series import Mount
from imop.calibration.synthetic import Noise, Truth, knocked, random_poses, random_truth
from imop.geometry import se3

MOUNTS: tuple[Mount, ...] = ("world", "hand")
NOISES = {
    "exact robot": Noise(0.3),
    "robot 0.1 mm, 0.01 degrees": Noise(0.3, 0.0001, np.radians(0.01)),
    "robot 0.3 mm, 0.03 degrees": Noise(0.3, 0.0003, np.radians(0.03)),
}
KNOCKS = {"none": (0.0, 0.0), "5 mm": (0.005, 0.0), "1 degree": (0.0, np.radians(1.0))}
SHOTS = 15
# Pictures of the check, and whether the board was fixed anew before it.
CHECKS = ((1, False), (3, False), (8, True), (15, True))


def calibrated(seed: int, mount: Mount, noise: Noise, shots: int = SHOTS) -> tuple[Truth, Calibration]:
    """A random rig and its calibration."""
    rng = np.random.default_rng(seed)
    truth = random_truth(rng, mount)
    return truth, calibrate(truth.series(random_poses(rng, truth, shots), rng, noise))


def errors(truth: Truth, calibration: Calibration) -> tuple[float, float]:
    """Millimetres and degrees."""
    found = calibration.cameras["camera"].T_mount_camera
    distance = 1000 * float(se3.translation_distance(found, truth.T_mount_camera))
    return distance, float(np.degrees(se3.rotation_distance(found, truth.T_mount_camera)))


def checked(
    seed: int, truth: Truth, calibration: Calibration, noise: Noise, shots: int, anew: bool
) -> dict[str, str]:
    """What a check says after each knock."""
    said = {}
    for name, (distance, angle) in KNOCKS.items():
        rng = np.random.default_rng([seed, shots])
        now = knocked(truth, rng, distance, angle)
        if anew:
            now = replace(now, T_place_board=now.T_place_board @ se3.make(se3.euler(z=0.1), (0.01, 0.0, 0.0)))
        series = now.series(random_poses(rng, now, shots), rng, noise)
        _, problems = moved_since(calibration, series)
        said[name] = ", ".join(problem.kind for problem in problems) or "nothing"
    return said


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    arguments = parser.parse_args()
    for mount in MOUNTS:
        for name, noise in NOISES.items():
            off, warned, said = [], Counter(), {check: Counter() for check in CHECKS}
            for seed in range(arguments.seeds):
                try:
                    truth, calibration = calibrated(seed, mount, noise)
                except NotCalibrated as error:
                    warned[error.problems[0].kind + " (error)"] += 1
                    continue
                off.append(errors(truth, calibration))
                warned.update(problem.kind for problem in calibration.problems)
                for shots, anew in CHECKS:
                    for knock, what in checked(seed, truth, calibration, noise, shots, anew).items():
                        said[shots, anew][knock, what] += 1
            middle, most, worst = np.percentile(off, [50, 95, 100], axis=0)
            print(f"{mount}, {name}: {len(off)} calibrations of {SHOTS} pictures")
            print(f"  mm: median {middle[0]:.2f}, 95 % {most[0]:.2f}, most {worst[0]:.2f}")
            print(f"  degrees: median {middle[1]:.3f}, 95 % {most[1]:.3f}, most {worst[1]:.3f}")
            print(f"  said although nothing is wrong: {dict(warned) or 'nothing'}")
            for (shots, anew), counts in said.items():
                print(f"  check with {shots} pictures{', board fixed anew' if anew else ''}:")
                for (knock, what), count in sorted(counts.items()):
                    print(f"    {knock}: {what}: {count}", flush=True)


if __name__ == "__main__":
    main()
