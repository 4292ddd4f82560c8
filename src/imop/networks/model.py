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
from torch import Tensor, nn

from imop.errors import CorruptData
from imop.files import replaced
from imop.networks.backbone import BackboneConfig
from imop.networks.graph import POINT_FEATURES, GraphConfig
from imop.networks.matching import MatchingConfig, MatchingNetwork
from imop.networks.pose import PoseConfig, pose_network
from imop.networks.region import GRIPPER_FEATURES, RegionConfig, RegionNetwork
from imop.networks.routing import INPUTS, RoutingConfig, RoutingNetwork

VERSION = 1
CARD = "card.json"
WEIGHTS = "weights.safetensors"
NETWORKS = ("region", "matching", "routing", "pose")


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
    pose: PoseConfig = field(default_factory=PoseConfig)
    route_graph: GraphConfig = ROUTE_GRAPH


SMALL = ModelConfig()

PAPER = ModelConfig(
    GraphConfig(voxel=0.005, plane_voxel=0.02, max_points=5000, grids=(0.015, 0.03), neighbours=16),
    RegionConfig(
        BackboneConfig(POINT_FEATURES + GRIPPER_FEATURES, (256, 384, 512), (2, 4, 4), group_width=16),
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
    """Region, matching and routing networks, and one for the pose if the configuration wants it."""

    def __init__(self, config: ModelConfig):
        super().__init__()
        self.config = config
        self.region = RegionNetwork(config.region)
        self.matching = MatchingNetwork(config.matching)
        self.routing = RoutingNetwork(config.routing)
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
