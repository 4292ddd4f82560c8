"""Samples by number: a number always gives the same sample, so training can be resumed anywhere."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from torch.utils.data import DataLoader, Dataset

from imop.errors import CorruptData
from imop.networks.model import ModelConfig
from imop.training.augment import augment
from imop.training.pairs import PairBatch, Sample, collate_samples, make_sample
from imop.training.shards import Shard


class PairDataset(Dataset[Sample]):
    """Augmented samples from folders of shards.

    Args:
        folders: of shards; each is drawn from equally often.
        config: how clouds become graphs.
        seed: of sources, pairs and augmentation.
        augmented: whether to augment at all; validation does not.

    Raises:
        CorruptData: if a folder has no shard, or one cannot be read.
    """

    def __init__(self, folders: Sequence[Path], config: ModelConfig, seed: int, augmented: bool = True):
        self._config, self._seed, self._augmented = config, seed, augmented
        self._shards = [_shards(folder) for folder in folders]
        self._ends = [np.cumsum([len(shard) for shard in shards]) for shards in self._shards]

    def __len__(self) -> int:
        return int(sum(ends[-1] for ends in self._ends))

    def __getitem__(self, index: int) -> Sample:
        rng = np.random.default_rng((self._seed, index))
        source = int(rng.integers(len(self._shards)))
        ends = self._ends[source]
        number = int(rng.integers(ends[-1])) if self._augmented else index % int(ends[-1])
        shard = int(np.searchsorted(ends, number, side="right"))
        pair = self._shards[source][shard][number - (int(ends[shard - 1]) if shard else 0)]
        if self._augmented:
            pair = augment(pair, rng)
        return make_sample(pair, self._config.graph, self._config.matching.max_region, rng)


def loader(dataset: PairDataset, numbers: Sequence[int], batch: int, workers: int) -> DataLoader[PairBatch]:
    """Batches of the samples with the given numbers, in order."""
    return DataLoader[Any](
        dataset,
        batch_size=batch,
        sampler=numbers,
        num_workers=workers,
        collate_fn=collate_samples,
        prefetch_factor=4 if workers else None,
        multiprocessing_context="fork" if workers else None,
    )


def _shards(folder: Path) -> list[Shard]:
    paths = sorted(folder.glob("*.npz"))
    if not paths:
        raise CorruptData(folder, "holds no shard (*.npz)", "generate training pairs into it")
    return [Shard(path) for path in paths]
