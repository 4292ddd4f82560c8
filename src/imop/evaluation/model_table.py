"""How large the networks are, as a table."""

from rich.table import Table

from imop.networks.model import Model


def model_table(model: Model, title: str) -> Table:
    """Parameters of each network and of all."""
    table = Table(title=title)
    table.add_column("network")
    table.add_column("parameters", justify="right")
    counts = model.parameter_table()
    for name, count in counts.items():
        table.add_row(name, f"{count:,}")
    total = sum(counts.values())
    table.add_section()
    table.add_row("all", f"{total:,} ({total / 1e6:.1f} M)")
    return table
