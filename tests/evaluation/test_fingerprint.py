import threading

from imop.evaluation.fingerprint import own_code_digest


class OfPython(threading.local):
    """Inherits from a module that has no file."""


def test_only_modules_of_ones_own_count():
    assert own_code_digest(threading.local, own_code_digest) == []
    assert len(own_code_digest(OfPython)) == 1
