"""Samples by number: a number always gives the same sample, so training can be resumed anywhere."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, overload

import numpy as np
from torch.utils.data import DataLoader, Dataset

from imop.errors import CorruptData, InvalidInput
from imop.networks.model import ModelConfig
from imop.training.data.augment import augment
from imop.training.data.pairs import PairBatch, Sample, collate_samples, make_sample
from imop.training.data.route_batch import RouteBatch, RouteSample, collate_routes, make_route_sample
from imop.training.data.route_shards import RouteShard
from imop.training.data.shards import Shard

Item = TypeVar("Item", covariant=True)


class PairDataset(Dataset[Sample]):
    """Augmented samples from folders of shards.

    Args:
        folders: of shards.
        config: how clouds become graphs.
        seed: of sources, pairs and augmentation.
        augmented: whether to augment at all; validation does not.
        shares: how often each folder is drawn from; equally if none are given.

    Raises:
        CorruptData: if a folder has no shard, or one cannot be read.
        InvalidInput: if there is not one positive share for each folder.
    """

    def __init__(
        self,
        folders: Sequence[Path],
        config: ModelConfig,
        seed: int,
        augmented: bool = True,
        shares: Sequence[float] = (),
    ):
        self._config, self._augmented = config, augmented
        self._source = _Source(folders, Shard, seed, augmented, shares)

    def __len__(self) -> int:
        return len(self._source)

    def __getitem__(self, index: int) -> Sample:
        pair, rng = self._source.pick(index)
        if self._augmented:
            pair = augment(pair, rng)
        matching = self._config.matching
        return make_sample(pair, self._config.graph, matching.max_region, rng, matching.region_first)


class RouteDataset(Dataset[RouteSample]):
    """Routes from folders of shards, augmented as in `make_route_sample`.

    Args:
        folders: of shards; each is drawn from equally often.
        config: how clouds become graphs.
        seed: of sources, routes, queries and augmentation.
        augmented: whether to augment at all; validation does not.

    Raises:
        CorruptData: if a folder has no shard, or one cannot be read.
    """

    def __init__(self, folders: Sequence[Path], config: ModelConfig, seed: int, augmented: bool = True):
        self._config, self._augmented = config, augmented
        self._source = _Source(folders, RouteShard, seed, augmented)

    def __len__(self) -> int:
        return len(self._source)

    def __getitem__(self, index: int) -> RouteSample:
        route, rng = self._source.pick(index)
        return make_route_sample(route, self._config.route_graph, rng if self._augmented else None)


@overload
def loader(
    dataset: PairDataset, numbers: Sequence[int], batch: int, workers: int
) -> DataLoader[PairBatch]: ...
@overload
def loader(
    dataset: RouteDataset, numbers: Sequence[int], batch: int, workers: int
) -> DataLoader[RouteBatch]: ...
def loader(
    dataset: PairDataset | RouteDataset, numbers: Sequence[int], batch: int, workers: int
) -> DataLoader[Any]:
    """Batches of the samples with the given numbers, in order."""
    return DataLoader[Any](
        dataset,
        batch_size=batch,
        sampler=numbers,
        num_workers=workers,
        collate_fn=collate_samples if isinstance(dataset, PairDataset) else collate_routes,
        prefetch_factor=4 if workers else None,
        multiprocessing_context="fork" if workers else None,
    )


class _Items(Protocol[Item]):
    def __len__(self) -> int: ...

    def __getitem__(self, index: int, /) -> Item: ...


class _Source(Generic[Item]):
    """Everything in the shards of some folders, drawn at random or, if not `drawn`, counted through."""

    def __init__(
        self,
        folders: Sequence[Path],
        read: Callable[[Path], _Items[Item]],
        seed: int,
        drawn: bool,
        shares: Sequence[float] = (),
    ):
        self._seed, self._drawn = seed, drawn
        shares = shares or [1.0] * len(folders)
        if len(shares) != len(folders) or min(shares) <= 0:
            raise InvalidInput("shares", f"{tuple(shares)}", f"{len(folders)} positive numbers")
        self._shares = np.asarray(shares) / sum(shares)
        self._shards = [[read(path) for path in _paths(folder)] for folder in folders]
        self._ends = [np.cumsum([len(shard) for shard in shards]) for shards in self._shards]

    def __len__(self) -> int:
        return int(sum(ends[-1] for ends in self._ends))

    def pick(self, index: int) -> tuple[Item, np.random.Generator]:
        """What belongs to a sample's number, and the generator for what else is random about the sample."""
        rng = np.random.default_rng((self._seed, index))
        source = int(rng.choice(len(self._shards), p=self._shares))
        ends = self._ends[source]
        number = int(rng.integers(ends[-1])) if self._drawn else index % int(ends[-1])
        shard = int(np.searchsorted(ends, number, side="right"))
        return self._shards[source][shard][number - (int(ends[shard - 1]) if shard else 0)], rng


def _paths(folder: Path) -> list[Path]:
    paths = sorted(folder.glob("*.npz"))
    if not paths:
        raise CorruptData(folder, "holds no shard (*.npz)", "generate training data into it")
    return paths
