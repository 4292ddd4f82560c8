"""Weights of the regressors on disk: safetensors, and a card that says where they come from."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import dacite
import torch
from safetensors.torch import load
from torch import Tensor, nn

from imop.baselines.points import PointsConfig, PointsNetwork
from imop.baselines.views import ViewsConfig, ViewsNetwork
from imop.errors import AssetMissing, CorruptData, InvalidInput
from imop.files import read
from imop.networks.descent import has_fast_bfloat16
from imop.networks.model import CARD, WEIGHTS, write_weights

_KINDS: dict[str, tuple[Any, Any]] = {
    "points": (PointsConfig, PointsNetwork),
    "views": (ViewsConfig, ViewsNetwork),
}

Regressor = PointsNetwork | ViewsNetwork


def make_network(kind: str, config: Mapping[str, Any] | None = None) -> Regressor:
    """A network with random weights.

    Args:
        kind: points or views.
        config: sizes that differ from the default ones, by name.

    Raises:
        InvalidInput: for another kind.
        ValueError: for sizes that the kind does not have, or some other error for nonsense.
    """
    if kind not in _KINDS:
        raise InvalidInput("network", kind, ", ".join(_KINDS))
    shape, network = _KINDS[kind]
    made: Regressor = network(dacite.from_dict(shape, config or {}, dacite.Config(cast=[tuple], strict=True)))
    return made


def kind_of(network: Regressor) -> str:
    """Points or views."""
    return "views" if isinstance(network, ViewsNetwork) else "points"


def count_parameters(network: nn.Module) -> int:
    """How many numbers are trained."""
    return sum(p.numel() for p in network.parameters())


def save_weights(network: nn.Module, folder: Path, card: Mapping[str, Any]) -> None:
    """Write weights and card, which is joined by the number of parameters and the weights' hash."""
    write_weights(network, folder, {**card, "parameters": count_parameters(network)})


def save_network(network: Regressor, folder: Path, card: Mapping[str, Any]) -> None:
    """Write a regressor with its kind and sizes, see `save_weights`."""
    save_weights(network, folder, {**card, "network": kind_of(network), "config": asdict(network.config)})


def read_weights(folder: Path, command: str) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Weights by name, and the card.

    Args:
        folder: what `save_weights` wrote.
        command: makes them, for the error.

    Raises:
        AssetMissing: if there are none.
        CorruptData: if they are damaged.
    """
    if not (folder / CARD).is_file():
        raise AssetMissing(str(folder / CARD), command)
    content = read(folder / WEIGHTS)
    try:
        card = json.loads(read(folder / CARD))
        whole = hashlib.sha256(content).hexdigest() == card["sha256"]
        weights = load(content)
    except Exception as error:  # damaged JSON and tensors fail in many ways
        raise CorruptData(folder, f"cannot be read ({error!r})", f"train again: {command}") from error
    if not whole:
        raise CorruptData(folder / WEIGHTS, "does not have the hash that the card names")
    return weights, card


def load_network(folder: Path, kind: str) -> tuple[Regressor, dict[str, Any]]:
    """A regressor that was saved, ready to act, and its card.

    Raises:
        AssetMissing: if there is none; it names the command that trains one.
        CorruptData: if it is damaged, or of another kind.
    """
    command = f"imop baselines train --network {kind} --stores STORE ... --out {folder}"
    weights, card = read_weights(folder, command)
    if card.get("network") != kind:
        raise CorruptData(folder, f"holds a network of kind {card.get('network')}, not {kind}", command)
    try:
        network = make_network(kind, card["config"])
        network.load_state_dict(weights)
    except Exception as error:  # nonsense in a configuration fails in many ways
        raise CorruptData(folder, f"weights and configuration do not fit ({error!r})", command) from error
    return network.eval(), card


def fast_products() -> torch.autocast:
    """Products in bfloat16 where the processor has fast instructions for it; sums stay in float32."""
    return torch.autocast("cpu", torch.bfloat16, enabled=has_fast_bfloat16())
