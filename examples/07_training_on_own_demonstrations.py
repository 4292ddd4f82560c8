"""From recorded demonstrations to trained networks: regions and matches are found, nobody annotates them.

So short a training only shows the way; docs/training.md says how long a useful one takes.
"""

import sys
from pathlib import Path

from imop import DemonstrationStore, make_task, record_demonstration
from imop.networks.model import BUNDLED, SMALL
from imop.training.config import TrainConfig
from imop.training.loop.train import train
from imop.training.recorded.write import RecordedConfig, write_recorded

folder = Path(sys.argv[1])
store = DemonstrationStore.create(folder / "demonstrations.zarr")
for seed in range(3):  # the same things in three scenes: what stays in place by the action is the region
    store.append(record_demonstration(make_task("tabletop/open_drawer"), seed, instance_seed=0))

pairs = write_recorded(RecordedConfig(store.path, folder / "pairs", pairs=20))
print(f"{pairs} pairs of a demonstrated step and another scene that calls for it")

config = TrainConfig(
    folder / "weights", train=(folder / "pairs",), weights=BUNDLED, steps=2, batch=4, every=2, workers=0
)
train(config, SMALL)
print(f"{folder / 'weights'}: imop run --task tabletop/open_drawer --weights takes them")
