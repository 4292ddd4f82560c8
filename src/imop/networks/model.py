"""The three networks together: sizes, and files that hold weights and configuration."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import dacite
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from imop.errors import CorruptData
from imop.files import replaced
from imop.networks.graph import GraphConfig
from imop.networks.matching import MatchingConfig, MatchingNetwork
from imop.networks.region import RegionConfig, RegionNetwork
from imop.networks.routing import RoutingConfig, RoutingNetwork

VERSION = 1
CARD = "card.json"
WEIGHTS = "weights.safetensors"


@dataclass(frozen=True)
class ModelConfig:
    """Everything that decides the shape of the networks and of what they see. The defaults are `small`."""

    graph: GraphConfig = field(default_factory=GraphConfig)
    region: RegionConfig = field(default_factory=RegionConfig)
    matching: MatchingConfig = field(default_factory=MatchingConfig)
    routing: RoutingConfig = field(default_factory=RoutingConfig)


class Model(nn.Module):
    """Region, matching and routing networks."""

    def __init__(self, config: ModelConfig):
        super().__init__()
        self.config = config
        self.region = RegionNetwork(config.region)
        self.matching = MatchingNetwork(config.matching)
        self.routing = RoutingNetwork(config.routing)

    def parameter_table(self) -> dict[str, int]:
        """Number of parameters of each network."""
        return {name: sum(p.numel() for p in part.parameters()) for name, part in self.named_children()}


def save_model(model: Model, folder: Path, card: Mapping[str, Any]) -> None:
    """Write weights.safetensors and card.json, each whole or not at all, the card last.

    Args:
        model: what to save.
        folder: made if missing.
        card: data, seed, command, metrics, licence; joined by the configuration and the weights' hash.
    """
    weights = save({name: tensor.contiguous() for name, tensor in model.state_dict().items()})
    with replaced(folder / WEIGHTS) as temporary:
        temporary.write_bytes(weights)
    known = {
        "version": VERSION,
        "sha256": hashlib.sha256(weights).hexdigest(),
        "config": asdict(model.config),
    }
    with replaced(folder / CARD) as temporary:
        temporary.write_text(json.dumps({**card, **known}, indent=2) + "\n")


def load_model(folder: Path) -> Model:
    """Read what `save_model` wrote; nothing is unpickled.

    Raises:
        CorruptData: if a file is missing, damaged, of another version, or does not fit the configuration.
    """
    try:
        card = json.loads((folder / CARD).read_text())
        weights = (folder / WEIGHTS).read_bytes()
    except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise CorruptData(
            folder, f"cannot be read ({error})", f"a folder with {CARD} and {WEIGHTS}"
        ) from error
    if card.get("version") != VERSION:
        raise CorruptData(folder / CARD, f"has version {card.get('version')}, not {VERSION}")
    if hashlib.sha256(weights).hexdigest() != card.get("sha256"):
        raise CorruptData(folder / WEIGHTS, "does not have the hash that the card names")
    try:
        config = dacite.from_dict(ModelConfig, card["config"], dacite.Config(cast=[tuple], strict=True))
        model = Model(config)
        model.load_state_dict(load(weights))
    except (KeyError, dacite.DaciteError, SafetensorError, RuntimeError, TypeError) as error:
        raise CorruptData(folder, f"weights and configuration do not fit ({error})") from error
    return model.eval()
