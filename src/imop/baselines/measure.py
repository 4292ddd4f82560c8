"""How far the actions of a regressor are from demonstrated ones."""

import numpy as np
import torch
from numpy.typing import NDArray

from imop.baselines.batch import batch_of
from imop.baselines.samples import Samples
from imop.baselines.weights import Regressor, fast_products
from imop.geometry import se3

_BATCH = 16


def measure(
    network: Regressor,
    samples: Samples,
    numbers: NDArray[np.int64],
    most: int,
    adapters: torch.Tensor | None = None,
) -> dict[str, float]:
    """Errors of at most `most` samples of these numbers, evenly spread, as they were recorded.

    Returns:
        Medians of the errors of place (metres) and rotation (degrees); shares of places within 1 and 2 cm and
        of what is within 2 cm and 10 degrees; shares of right gripper states and of right collisions. Nothing
        if there are no samples.
    """
    chosen = numbers[np.linspace(0, len(numbers) - 1, min(most, len(numbers))).astype(int)]
    if not len(chosen):
        return {}
    rows = []
    for start in range(0, len(chosen), _BATCH):
        inputs, targets = batch_of(samples, chosen[start : start + _BATCH])
        torch.manual_seed(0)
        with fast_products():
            found = network.predict(inputs) if adapters is None else network.predict(inputs, adapters)  # type: ignore[call-arg]
        T_found, T_right = found.pose.double().numpy(), targets.pose.double().numpy()
        rows.append(
            np.stack(
                [
                    se3.translation_distance(T_found, T_right),
                    np.degrees(se3.rotation_distance(T_found, T_right)),
                    (found.gripper_open == targets.gripper_open).numpy(),
                    (found.allow_collisions == targets.allow_collisions).numpy(),
                ],
                axis=1,
            )
        )
    place, rotation, gripper, collisions = np.concatenate(rows).T
    return {
        "place": float(np.median(place)),
        "rotation": float(np.median(rotation)),
        "within_1cm": float(np.mean(place < 0.01)),
        "within_2cm": float(np.mean(place < 0.02)),
        "right_pose": float(np.mean((place < 0.02) & (rotation < 10))),
        "gripper": float(np.mean(gripper)),
        "collisions": float(np.mean(collisions)),
    }
