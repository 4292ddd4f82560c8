"""The buttons of a session as letters in a terminal: nothing moves before somebody says so."""

from collections.abc import Callable

from imop.errors import ImopError
from imop.viewing.session import Session
from imop.viewing.words import report

QUESTION = "y: do it, n: next candidate, l: look again, q: quit > "


def attend(session: Session, ask: Callable[[str], str], tell: Callable[[str], object]) -> bool:
    """Ask before every motion until the episode is over; whether it got there.

    Anything but the letters asks again, and so does what fails: then it is said.

    Args:
        session: the episode.
        ask: puts a question and returns the answer.
        tell: says something.
    """
    while not session.over:
        tell(report(session.present))
        answer = ask(QUESTION).strip().lower()
        if answer == "q":
            return False
        act = {"y": session.accept, "n": session.reject, "l": session.look}.get(answer)
        if act is None:
            continue
        try:
            act()
        except (ImopError, ConnectionError) as error:
            tell(str(error))
        if session.words:
            tell(session.words)
    return True
