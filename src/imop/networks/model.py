"""The networks together: sizes, and files that hold weights and configuration."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import dacite
import torch
from safetensors.torch import load, save
from torch import Tensor, nn

from imop.errors import CorruptData
from imop.files import read, replaced
from imop.networks.backbone import BackboneConfig
from imop.networks.graph import GraphConfig
from imop.networks.matching import MatchingConfig, MatchingNetwork
from imop.networks.pose import PoseConfig, pose_network
from imop.networks.region import REGION_INPUTS, RegionConfig, RegionNetwork
from imop.networks.routing import INPUTS, RoutingConfig, RoutingNetwork
from imop.networks.verification import VerificationConfig, VerificationNetwork

VERSION = 1
CARD = "card.json"
WEIGHTS = "weights.safetensors"
NETWORKS = ("region", "matching", "routing", "verification", "pose")


ROUTE_GRAPH = GraphConfig(voxel=0.02, plane_voxel=0.08, max_points=256, grids=(), neighbours=1)


@dataclass(frozen=True)
class ModelConfig:
    """Everything that decides the shape of the networks and of what they see. The defaults are `small`.

    `graph` is for region and matching; `route_graph` for routing, which needs less detail.
    """

    graph: GraphConfig = field(default_factory=GraphConfig)
    region: RegionConfig = field(default_factory=RegionConfig)
    matching: MatchingConfig = field(default_factory=MatchingConfig)
    routing: RoutingConfig = field(default_factory=RoutingConfig)
    verification: VerificationConfig = field(default_factory=VerificationConfig)
    pose: PoseConfig = field(default_factory=PoseConfig)
    route_graph: GraphConfig = ROUTE_GRAPH


SMALL = ModelConfig()

PAPER = ModelConfig(
    GraphConfig(voxel=0.005, plane_voxel=0.02, max_points=5000, grids=(0.015, 0.03), neighbours=16),
    RegionConfig(
        BackboneConfig(REGION_INPUTS, (256, 384, 512), (2, 4, 4), group_width=16),
        stages=4,
    ),
    MatchingConfig(
        BackboneConfig(widths=(256, 384, 512), depths=(2, 3, 4), group_width=16),
        attention="graph",
        neighbours=16,
        heads=8,
        max_region=1000,
    ),
    RoutingConfig(
        BackboneConfig(INPUTS, (128, 256, 512), (2, 2, 5), group_width=16),
        width=512,
        layers=7,
        heads=8,
    ),
    route_graph=GraphConfig(voxel=0.01, plane_voxel=0.04, max_points=2000, grids=(0.03, 0.08), neighbours=16),
)
"""The paper's size, 80.8 M parameters within 2 %; how they are spread over the networks it does not say."""


class Model(nn.Module):
    """Region, matching, routing, verification, and one for the pose if the configuration wants it."""

    def __init__(self, config: ModelConfig):
        super().__init__()
        self.config = config
        self.region = RegionNetwork(config.region)
        self.matching = MatchingNetwork(config.matching)
        self.routing = RoutingNetwork(config.routing)
        self.verification = VerificationNetwork(config.verification)
        self.pose = pose_network(config.pose)

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
    config = asdict(model.config)
    known = {"version": VERSION, "config": config, "config_sha256": _hash_of(config)}
    write_weights(model, folder, {**card, **known})


def write_weights(network: nn.Module, folder: Path, card: Mapping[str, Any]) -> None:
    """Write weights.safetensors and card.json, each whole or not at all, the card last.

    Args:
        network: any.
        folder: made if missing.
        card: joined by the weights' hash.
    """
    weights = save({name: tensor.contiguous() for name, tensor in network.state_dict().items()})
    with replaced(folder / WEIGHTS) as temporary:
        temporary.write_bytes(weights)
    known = {"sha256": hashlib.sha256(weights).hexdigest()}
    with replaced(folder / CARD) as temporary:
        temporary.write_text(json.dumps({**card, **known}, indent=2) + "\n")


def part_of(weights: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The weights of the module `prefix`, by their names within it."""
    start = f"{prefix}."
    return {name.removeprefix(start): w for name, w in weights.items() if name.startswith(start)}


BUNDLED = Path(__file__).parents[1] / "weights"
"""The weights that come with the package: `small`, trained by the command in their card."""


def load_model(folder: Path = BUNDLED) -> Model:
    """Read what `save_model` wrote; nothing is unpickled.

    Raises:
        CorruptData: if a file is missing, damaged, of another version, or does not fit the configuration.
    """
    weights, config, _ = read_model(folder)
    try:
        _check_size(config, weights)
        model = Model(config)
        model.load_state_dict(weights)
    except Exception as error:  # nonsense in a configuration fails in many ways
        raise CorruptData(folder, f"weights and configuration do not fit ({error!r})") from error
    return model.eval()


def read_model(folder: Path) -> tuple[dict[str, Tensor], ModelConfig, dict[str, Any]]:
    """The weights by name, the shapes and the card that `save_model` wrote, whether or not they fit.

    Raises:
        CorruptData: if a file is missing, damaged, or of another version.
    """
    remedy = f"name a folder with {CARD} and {WEIGHTS}"
    card, content = _read_card(folder / CARD, remedy), read(folder / WEIGHTS, remedy)
    if hashlib.sha256(content).hexdigest() != card.get("sha256"):
        raise CorruptData(folder / WEIGHTS, "does not have the hash that the card names")
    try:
        config = dacite.from_dict(ModelConfig, card["config"], dacite.Config(cast=[tuple], strict=True))
        return load(content), config, card
    except Exception as error:  # nonsense in a configuration fails in many ways
        raise CorruptData(folder, f"cannot be read ({error!r})") from error


def _read_card(path: Path, remedy: str) -> dict[str, Any]:
    try:
        card = json.loads(read(path, remedy))
    except (ValueError, RecursionError) as error:
        raise CorruptData(path, f"is not JSON ({error})", remedy) from error
    if not isinstance(card, dict) or card.get("version") != VERSION:
        raise CorruptData(path, f"is not a card of version {VERSION}", remedy)
    if "config_sha256" in card and card["config_sha256"] != _hash_of(card.get("config")):
        raise CorruptData(path, "the configuration does not have the hash that the card names")
    return card


def _hash_of(config: Any) -> str:
    """SHA-256 of a configuration as JSON with sorted keys and no spaces."""
    return hashlib.sha256(json.dumps(config, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _check_size(config: ModelConfig, weights: Mapping[str, Tensor]) -> None:
    """Refuses networks of another shape than the weights, before they take memory.

    Raises:
        ValueError: if there are more layers than tensors, or a tensor has another shape.
    """
    most = max(_repetitions(asdict(config)))
    if most > len(weights):
        raise ValueError(f"{most} layers, but {len(weights)} tensors")
    with torch.device("meta"):
        shapes = {name: tensor.shape for name, tensor in Model(config).state_dict().items()}
    other = [name for name in shapes.keys() | weights if shapes.get(name) != _shape(weights.get(name))]
    if other:
        raise ValueError(f"tensor {min(other)} has another shape")


def _shape(tensor: Tensor | None) -> torch.Size | None:
    return None if tensor is None else tensor.shape


def _repetitions(config: Mapping[str, Any]) -> Iterator[int]:
    """How many times the networks repeat a part."""
    for name, value in config.items():
        if isinstance(value, dict):
            yield from _repetitions(value)
        elif name in ("layers", "stages"):
            yield value
        elif name == "depths":
            yield from value
