"""The regressors that the policy is compared with (docs/baselines.md)."""

from typing import Annotated

from tyro.conf import OmitArgPrefixes
from tyro.extras import SubcommandApp

from imop.baselines.adapt import Fold
from imop.baselines.adapt import adapt as fine_tune
from imop.baselines.hyper import HyperConfig, train_hyper
from imop.baselines.train import RegressorConfig, read_stores
from imop.baselines.train import train as train_regressor
from imop.terminal import console

app = SubcommandApp()


@app.command
def train(config: Annotated[RegressorConfig, OmitArgPrefixes]) -> int:
    """Train a regressor on recorded demonstrations. Run again, the command goes on.

    Args:
        config: how to train.
    """
    config.check()
    train_regressor(config, read_stores(config.stores, config.cache, console), console=console)
    return 0


@app.command
def adapt(config: Annotated[Fold, OmitArgPrefixes]) -> int:
    """Fine-tune all weights on one demonstration of each novel task, to see what that does to base tasks.

    Args:
        config: what is fine-tuned on what.
    """
    fine_tune(config, console)
    return 0


@app.command
def hyper(config: Annotated[HyperConfig, OmitArgPrefixes]) -> int:
    """Train the hyper-network that makes adapters from a demonstration. Run again, the command goes on.

    Args:
        config: how to train.
    """
    train_hyper(config, read_stores(config.stores, config.cache, console), console)
    return 0
