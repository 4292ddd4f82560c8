"""A line on the terminal that says how a training is going; nothing where there is no terminal."""

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
from rich.progress import TimeRemainingColumn as Remaining
from rich.text import Text


class _Speed(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text("" if task.speed is None else f"{task.speed:.1f} steps/s")


class TrainingProgress(Progress):
    """Step, speed, time that is left, and losses.

    Args:
        console: where to.
        done: steps taken before.
        steps: steps in all.
    """

    def __init__(self, console: Console, done: int, steps: int):
        columns = (MofNCompleteColumn(), BarColumn(), _Speed(), Remaining(), TextColumn("{task.description}"))
        super().__init__(*columns, console=console, disable=not console.is_terminal, speed_estimate_period=60)
        self._line = self.add_task("", total=steps, completed=done)

    def step(self, losses: dict[str, float]) -> None:
        """One more step was taken, with these losses."""
        shown = ", ".join(f"{name} {value:.3f}" for name, value in losses.items())
        self.update(self._line, advance=1, description=shown)

    def report(self, line: str) -> None:
        """A line that stays."""
        self.console.print(line, soft_wrap=True, highlight=False)
