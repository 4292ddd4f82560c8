"""The regressors as policies: the words of the demonstration say what to do; novel tasks may be learnt."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from imop.baselines.adapt import ADAPTERS, AdaptConfig, fine_tuned, tuned_adapters
from imop.baselines.batch import Targets, inputs_of
from imop.baselines.hyper import described, load_hyper_network
from imop.baselines.samples import CENTER, samples_of, seen
from imop.baselines.views import ViewsNetwork
from imop.baselines.weights import Regressor, load_network
from imop.baselines.words import numbers_of
from imop.demos.episode import digest_of
from imop.errors import CorruptData, InvalidInput
from imop.files import read, replaced
from imop.geometry import se3
from imop.geometry.perception import Perception
from imop.types import Action, Demonstration, Observation

PARTS = {"act3d": ("points",), "rvt": ("views",), "rvt_ft": ("views",), "rvt_hdt": ("views", "views_hdt")}
"""Folders of weights that each method needs."""
REGRESSORS = tuple(PARTS)
FOLDER = Path("runs/baselines")
"""Where these folders are looked for."""


class RegressorPolicy:
    """Acts by a network that was told the words of the demonstration, and sees nothing else of it.

    Args:
        network: predicts actions.
        perception: makes clouds, without the robot.
        adapt: what fits the network to a demonstration; None leaves it as it is.
    """

    def __init__(
        self,
        network: Regressor,
        perception: Perception,
        adapt: Callable[[Demonstration], tuple[Regressor, Tensor | None]] | None = None,
    ):
        self._network, self._perception, self._adapt = network, perception, adapt
        self._adapters: Tensor | None = None
        self._instruction: str | None = None

    def watch(self, demonstration: Demonstration) -> None:
        """Take the instruction, and fit the network if that is wanted; the last demonstration counts.

        Raises:
            InvalidInput: if the demonstration has no instruction, or it is to be learnt and nothing is seen.
        """
        if not demonstration.instructions:
            raise InvalidInput("instructions", "none", "a demonstration that says in words what is done")
        self._instruction = demonstration.instructions[0]
        if self._adapt is not None:
            self._network, self._adapters = self._adapt(demonstration)

    def reset(self) -> None:
        """Begin a new episode; nothing is remembered."""

    def act(self, observation: Observation) -> Action:
        """The next action.

        Raises:
            InvalidInput: if nothing was watched, or nothing is seen in the workspace.
        """
        if self._instruction is None:
            raise InvalidInput("demonstration", "none was watched", "call watch(demonstration) before act")
        inputs = inputs_of(seen(self._perception, observation), numbers_of(self._instruction))
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(0)  # ghost points are the same in every process
            if isinstance(self._network, ViewsNetwork):
                return _action(self._network.predict(inputs, self._adapters))
            return _action(self._network.predict(inputs))


def _action(found: Targets) -> Action:
    T = found.pose[0].double().numpy()
    return Action(
        se3.make(p=CENTER) @ se3.orthonormal(T),
        bool(found.gripper_open[0] > 0.5),
        bool(found.allow_collisions[0] > 0.5),
    )


class FineTuning:
    """Fits the network to a demonstration whose instruction it was not trained with; kept in a cache.

    Args:
        network: as it was trained.
        card: of its weights.
        perception: makes clouds.
        cache: folder of what was fitted before.
        config: how.
        hyper: folder of the hyper-network: adapters are fitted instead of all weights. None if all are.
    """

    def __init__(
        self,
        network: ViewsNetwork,
        card: dict[str, Any],
        perception: Perception,
        cache: Path,
        config: AdaptConfig,
        hyper: Path | None = None,
    ):
        self._network, self._perception, self._cache, self._config = network, perception, cache, config
        self._known = frozenset(card["instructions"])
        self._hyper = None if hyper is None else load_hyper_network(hyper, network, card["sha256"])
        weights = [network] if self._hyper is None else [network, self._hyper]
        self._state = repr((config, [_digest(each) for each in weights]))

    def __call__(self, demonstration: Demonstration) -> tuple[Regressor, Tensor | None]:
        """The network and adapters for this demonstration; as trained if it knows the instruction."""
        if demonstration.instructions[0] in self._known:
            return self._network, None
        key = hashlib.sha256((self._state + digest_of(demonstration)).encode()).hexdigest()[:20]
        file = self._cache / f"{key}.safetensors"
        if not file.is_file():
            content = save(self._fit(demonstration))
            with replaced(file) as temporary:
                temporary.write_bytes(content)
        try:
            return self._fitted(load(read(file)))
        except (SafetensorError, RuntimeError, KeyError) as error:
            raise CorruptData(file, f"cannot be read ({error})", "remove it, it is made again") from error

    def _fit(self, demonstration: Demonstration) -> dict[str, Tensor]:
        samples = samples_of(self._perception, demonstration)
        if self._hyper is None:
            return dict(fine_tuned(self._network, samples, self._config).state_dict())
        with torch.no_grad():
            keyframes = described(self._network, samples, np.arange(len(samples)))
            adapters = self._hyper([keyframes])
        return {"adapters": tuned_adapters(self._network, samples, adapters, self._config)}

    def _fitted(self, found: dict[str, Tensor]) -> tuple[Regressor, Tensor | None]:
        if self._hyper is not None:
            return self._network, found["adapters"]
        tuned = ViewsNetwork(self._network.config)
        tuned.load_state_dict(found)
        return tuned.eval(), None


def _digest(network: torch.nn.Module) -> str:
    return hashlib.sha256(save(dict(network.state_dict()))).hexdigest()


def make_regressor(method: str, perception: Perception, folder: Path | None = None) -> RegressorPolicy:
    """The policy of a method of `REGRESSORS`.

    Args:
        method: act3d and rvt act as trained; rvt_ft is fine-tuned, and rvt_hdt gets adapters, for
            demonstrations whose instruction was not trained.
        perception: makes clouds, without the robot.
        folder: with the weights; `FOLDER` if None.

    Raises:
        AssetMissing: if weights are missing; it names the command that makes them.
        CorruptData: if they are damaged.
    """
    folder = folder or FOLDER
    if method == "act3d":
        return RegressorPolicy(load_network(folder / "points", "points")[0], perception)
    network, card = load_network(folder / "views", "views")
    if method == "rvt":
        return RegressorPolicy(network, perception)
    assert isinstance(network, ViewsNetwork)
    hyper = folder / "views_hdt" if method == "rvt_hdt" else None
    config = ADAPTERS if method == "rvt_hdt" else AdaptConfig()
    adapt = FineTuning(network, card, perception, folder / "adapted", config, hyper)
    return RegressorPolicy(network, perception, adapt)
