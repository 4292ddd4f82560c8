"""Weights of networks that were trained separately, put into one model.

imop training merge --out DIR --pairs runs/pairs --routing runs/routing
"""

import json
from dataclasses import dataclass
from pathlib import Path

import dacite
from safetensors import SafetensorError
from safetensors.torch import load_file

from imop.errors import CorruptData
from imop.networks.model import CARD, NETWORKS, WEIGHTS, Model, ModelConfig, part_of, save_model


@dataclass(frozen=True)
class MergeConfig:
    """What is put together.

    Attributes:
        out: folder for the whole model.
        pairs: folder with the weights of the region, matching and pose networks.
        routing: folder with the weights of the routing network; None leaves it untrained.
        verification: folder with those of the verification network; None takes those beside the pairs'.
    """

    out: Path
    pairs: Path
    routing: Path | None = None
    verification: Path | None = None


def merge(config: MergeConfig) -> Model:
    """The model of all folders, written to `config.out`; its card holds their cards.

    Each folder gives only its own networks, so the others in it may have any shape.

    Raises:
        CorruptData: if a file cannot be read or does not fit its configuration.
    """
    taken = dict.fromkeys(("region", "matching", "pose", "graph"), config.pairs)
    taken["verification"] = config.verification or config.pairs
    if config.routing is not None:
        taken |= {"routing": config.routing, "route_graph": config.routing}
    cards = {folder: _card(folder) for folder in dict.fromkeys(taken.values())}
    try:
        parts = {name: cards[folder]["config"].get(name) for name, folder in taken.items()}
        known = {name: part for name, part in parts.items() if part is not None}
        model = Model(dacite.from_dict(ModelConfig, known, dacite.Config(cast=[tuple], strict=True)))
        for name in taken.keys() & NETWORKS:
            network = getattr(model, name)
            if network is not None:  # least squares have no weights
                network.load_state_dict(part_of(load_file(taken[name] / WEIGHTS), name))
    except (KeyError, dacite.DaciteError, SafetensorError, RuntimeError, TypeError, OSError) as error:
        raise CorruptData(config.pairs, f"weights and configuration do not fit ({error})") from error
    rest = {
        folder.name: {k: v for k, v in card.items() if k not in ("config", "sha256", "version")}
        for folder, card in cards.items()
    }
    save_model(model, config.out, {"parts": rest})
    return model.eval()


def _card(folder: Path) -> dict[str, dict[str, object]]:
    try:
        card: dict[str, dict[str, object]] = json.loads((folder / CARD).read_text())
    except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise CorruptData(folder / CARD, f"cannot be read ({error})") from error
    return card
