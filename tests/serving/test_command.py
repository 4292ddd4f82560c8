import socket

import pytest

from imop.cli import main


def refusal(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["serve", *arguments])
    assert ended.value.code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--host", "0.0.0.0"], "host: 0.0.0.0 can be reached by others, and there is no key"),
        (["--demo", "nowhere"], "nowhere"),
        (["--port", "99999"], "port: 99999; accepted: 0 .. 65535"),
        (["--host", "192.0.2.1"], "host: 192.0.2.1 can be reached"),
        (["--sessions", "0"], "sessions: 0; accepted: a number above 0"),
        (["--workers", "0"], "workers: 0"),
        (["--request-seconds", "-1"], "request_seconds: -1"),
    ],
)
def test_what_cannot_be_served_is_said_in_one_line(capsys, monkeypatch, arguments, said):
    monkeypatch.delenv("IMOP_API_KEY", raising=False)
    error = refusal(capsys, *arguments)
    assert said in error and len(error.splitlines()) == 1


def test_a_port_that_is_taken_is_named_before_anything_is_loaded(capsys):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert f"port: cannot listen at 127.0.0.1:{port}" in refusal(capsys, "--port", str(port))
