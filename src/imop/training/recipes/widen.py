"""Weights from before some evidence was known, for a network that knows it.

imop training widen --weights FOLDER --out FOLDER --new claimed turned_color

What the verification network learned stays. The new evidence enters with the small random weights of a fresh
network; how it should enter, `imop training verification --further --only` learns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from imop.errors import InvalidInput
from imop.networks.model import Model, read_model, save_model
from imop.networks.verification import EVIDENCE, directions


@dataclass(frozen=True)
class Widening:
    """What to widen.

    Attributes:
        weights: folder of the former weights.
        out: folder of the new ones.
        new: names of `networks.verification.EVIDENCE` that the former weights do not know.
        seed: of the weights of the new evidence.
    """

    weights: Path
    out: Path
    new: tuple[str, ...]
    seed: int = 0


def widened(fresh: Tensor, old: Tensor, known: Sequence[int]) -> Tensor:
    """The fresh tensor (..., N) with `old` (..., K) where its last axis means what was `known`.

    What follows the known ones, such as scores of the network's own, is at the end of both.
    """
    result, rest = fresh.clone(), old.shape[-1] - len(known)
    result[..., list(known)] = old[..., : len(known)]
    if rest:
        result[..., -rest:] = old[..., len(known) :]
    return result


def widen(former: Mapping[str, Tensor], fresh: Mapping[str, Tensor], new: Sequence[str]) -> dict[str, Tensor]:
    """All weights, by name, of the former model in the shapes of a fresh one that knows `new` evidence, too.

    Raises:
        InvalidInput: if there is no such evidence.
    """
    if unknown := sorted(set(new) - set(EVIDENCE)):
        raise InvalidInput("new", f"no {', '.join(unknown)}", ", ".join(EVIDENCE))
    old = [name not in new for name in EVIDENCE]
    signs = directions()
    kinds = {
        "standardized": [i for i, was in enumerate(old) if was],
        "weights": _among([i for i, sign in enumerate(signs) if sign], old),
        "situation": _among([i for i, sign in enumerate(signs) if not sign], old),
    }
    result = {}
    for name, tensor in former.items():
        kind = next((kind for kind in kinds if kind in name), "")
        changed = name in fresh and fresh[name].shape != tensor.shape
        result[name] = widened(fresh[name], tensor, kinds[kind]) if changed else tensor
    return result


def _among(columns: Sequence[int], old: Sequence[bool]) -> list[int]:
    """Places among columns of those whose evidence was known."""
    return [place for place, column in enumerate(columns) if old[column]]


def widen_folder(config: Widening) -> None:
    """The same of a folder of weights.

    Raises:
        CorruptData: if the former weights cannot be read.
        InvalidInput: if there is no such evidence.
    """
    former, shape, card = read_model(config.weights)
    torch.manual_seed(config.seed)
    model = Model(replace(shape, verification=replace(shape.verification, evidence=len(EVIDENCE))))
    model.load_state_dict(widen(former, model.state_dict(), config.new))
    save_model(model, config.out, card)
