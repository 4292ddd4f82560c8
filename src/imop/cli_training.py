"""Make training data, train the verification, merge weights, draw regions (docs/training.md)."""

from pathlib import Path
from typing import Annotated

from rich.console import Console
from tyro.conf import OmitArgPrefixes
from tyro.extras import SubcommandApp

from imop.demos.store import DemonstrationStore
from imop.evaluation.regions import draw
from imop.evaluation.spread_picture import Options, draw_spreads
from imop.networks.model import load_model
from imop.terminal import console
from imop.training.data.chains import ChainConfig, chain
from imop.training.loop.metrics import MetricsOptions, validate
from imop.training.recipes.ablations import AblationsConfig
from imop.training.recipes.ablations import stages as ablations_stages
from imop.training.recipes.commands import run
from imop.training.recipes.merge import MergeConfig
from imop.training.recipes.merge import merge as merge_folders
from imop.training.recipes.protocol import ProtocolConfig
from imop.training.recipes.protocol import stages as protocol_stages
from imop.training.recipes.widen import Widening, widen_folder
from imop.training.recorded.write import RecordedConfig, write_recorded
from imop.training.synthetic.generate import GenerateConfig
from imop.training.synthetic.generate import generate as generate_shards
from imop.training.verification.cases import CasesConfig, case_files
from imop.training.verification.fit import VerificationTraining, train_verification

app = SubcommandApp()


@app.command
def generate(config: Annotated[GenerateConfig, OmitArgPrefixes]) -> int:
    """Write shards of synthetic pairs or routes. Run again, the command goes on where it was stopped.

    Args:
        config: what is generated.
    """
    generate_shards(config)
    return 0


@app.command
def recorded(config: Annotated[RecordedConfig, OmitArgPrefixes]) -> int:
    """Write shards of pairs from recorded demonstrations. They need no annotation.

    Args:
        config: which pairs of which demonstrations.
    """
    console.print(f"{write_recorded(config)} pairs in {config.out}")
    return 0


@app.command
def chains(config: Annotated[ChainConfig, OmitArgPrefixes]) -> int:
    """Write routes from shards of pairs. No new clouds are made.

    Args:
        config: which pairs.
    """
    console.print(f"{chain(config)} routes in {config.out}")
    return 0


@app.command
def cases(config: Annotated[CasesConfig, OmitArgPrefixes]) -> int:
    """Write cases for the verification network: candidates of the search, and which of them are right.

    Args:
        config: how many, of what.
    """
    case_files(config)
    return 0


@app.command
def verification(config: Annotated[VerificationTraining, OmitArgPrefixes]) -> int:
    """Train the verification network on cases; ten minutes on a CPU.

    Args:
        config: how to train.
    """
    reached = train_verification(config)
    console.print(_listed(reached), soft_wrap=True)
    return 0


@app.command
def metrics(config: Annotated[MetricsOptions, OmitArgPrefixes]) -> int:
    """Say how good the networks are on pairs that they were not trained on.

    Args:
        config: which networks, on what.
    """
    model = load_model(config.weights)
    for folder in config.shards:
        found = validate(model, folder, config.pairs)
        console.print(f"{folder.name}: {_listed(found)}", soft_wrap=True)
    return 0


@app.command
def merge(config: Annotated[MergeConfig, OmitArgPrefixes]) -> int:
    """Put weights of networks that were trained separately into one model.

    Args:
        config: which weights.
    """
    merge_folders(config)
    return 0


@app.command
def widen(config: Annotated[Widening, OmitArgPrefixes]) -> int:
    """Give older weights of the verification network inputs for evidence that they do not know.

    Args:
        config: which weights and evidence.
    """
    widen_folder(config)
    return 0


@app.command
def protocol(config: Annotated[ProtocolConfig, OmitArgPrefixes]) -> int:
    """Train as the paper does, on 100 demonstrations of each of RLBench's base tasks.

    Args:
        config: how much of everything.
    """
    run(protocol_stages(config), config.out, Console())
    return 0


@app.command
def ablations(config: Annotated[AblationsConfig, OmitArgPrefixes]) -> int:
    """Train every row of the paper's table of ablations equally. Run again, the command goes on.

    Args:
        config: how the rows are trained.
    """
    run(ablations_stages(config), config.out, Console())
    return 0


@app.command
def regions(store: Path, out: Path, count: int = 10) -> int:
    """Draw the regions and point pairs that Eq. (3) of the paper finds in a store of demonstrations.

    Args:
        store: demonstrations by `imop collect --scenes 3`.
        out: folder of the pictures.
        count: sets of demonstrations to draw.
    """
    for path in draw(DemonstrationStore.open(store), out, count):
        console.print(path)
    return 0


@app.command
def spreads(config: Annotated[Options, OmitArgPrefixes]) -> int:
    """Draw the spread: how far the region network expects each point's counterpart on other things.

    Args:
        config: what is drawn.
    """
    draw_spreads(config)
    console.print(config.out)
    return 0


def _listed(values: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3f}" for name, value in values.items())
