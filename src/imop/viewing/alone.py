"""An episode that nobody attends: the likeliest choice that can be done is done, until the end."""

from collections.abc import Callable

from imop.errors import ImopError
from imop.viewing.session import Session

IN_A_ROW = 3
"""So many motions may fail one after the other."""


def go_on(session: Session, most: int, tell: Callable[[str], object]) -> str:
    """Act until the episode is over; why it ended before that, or nothing if it did not.

    Args:
        session: the episode.
        most: so many actions at most.
        tell: says what happened.
    """
    failures = 0
    for _ in range(most):
        problem = session.present.problem
        while session.present.choices and session.present.way is None:
            session.reject()
        if session.present.action is None:
            return problem
        try:
            session.accept()
        except (ImopError, ConnectionError) as error:
            return str(error)
        if session.words:
            tell(session.words)
        if session.over:
            return ""
        failures = failures + 1 if session.failed else 0
        if failures == IN_A_ROW:
            return f"{IN_A_ROW} motions in a row failed: {session.words}"
    return f"not done after {most} actions"
