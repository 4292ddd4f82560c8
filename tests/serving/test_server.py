import os
import socket
import threading
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from multiprocessing import active_children

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from imop.errors import InvalidInput
from imop.serving import Limits, Server, schema, wire
from imop.serving.limits import WorkerEnded
from imop.serving.server import is_loopback
from tests.serving.policies import CRASH, GREEDY, NAP, SLEEP, UNSURE, Refusing, Remembering, demonstrate
from tests.serving.running import Running, ask, ask_once, message, place, serving

LIMITS = Limits(message_bytes=200_000, sessions=12, session_bytes=2**30)


@pytest.fixture(scope="module")
def server():
    with serving(demonstrations=[demonstrate()], limits=LIMITS, workers=2) as running:
        yield running


@pytest.fixture(scope="module")
def hasty():
    """One that works on one request at a time, and not for long."""
    limits = Limits(request_seconds=1.5)
    with serving(demonstrations=[demonstrate()], limits=limits, workers=1) as running:
        yield running


def wait_until_free(server):
    """Sessions end a moment after their clients have left."""
    for _ in range(100):
        try:
            return place(ask_once(server, 0.5))
        except InvalidStatus:
            time.sleep(0.05)
    raise AssertionError("no session became free")


def episode(server, openings, pause=0.0):
    with server.join() as client:
        found = []
        for opening in openings:
            found.append(place(ask(client, opening)))
            time.sleep(pause)
        return found


def expected(openings):
    return [[sum(openings[: k + 1]), k + 1, 1] for k in range(len(openings))]


def test_metadata_come_first(server):
    with server.connect() as client:
        metadata = wire.unpack(client.recv())
    assert metadata["server"] == "imop" and metadata["protocol"] == schema.PROTOCOL
    assert metadata["cameras"] == ["front", "wrist"] and metadata["demonstrations"] == 1
    assert metadata["limits"]["message_bytes"] == LIMITS.message_bytes


def test_health_needs_neither_a_session_nor_a_websocket(server):
    with urllib.request.urlopen(f"http://127.0.0.1:{server.port}/healthz") as reply:
        assert reply.status == 200 and reply.read() == b"OK\n"


def test_replies_are_timed(server):
    with server.join() as client:
        assert "prev_total_ms" not in ask(client)["server_timing"]
        timing = ask(client)["server_timing"]
    assert timing["prev_total_ms"] > 0 and timing["infer_ms"] > 0 and timing["wait_ms"] >= 0


# How clients behave badly. Each is left alone with a connection that has read its metadata.
def garbage(client):
    client.send(os.urandom(1000))
    assert "InvalidInput: message" in client.recv()


def bomb(client):
    # A hundred thousand nested or counted things: little to send, much to hold.
    client.send(b"\x91" * 100_000)
    assert "InvalidInput: message" in client.recv()


def no_websocket(client):
    client.socket.sendall(b"\xff" * 1000)
    with pytest.raises(ConnectionClosed):
        client.recv()


def stall(client):
    ask(client)
    client.socket.sendall(half_a_frame()[:1000])
    time.sleep(1.0)


def leave_in_the_middle(client):
    client.socket.sendall(half_a_frame())
    client.socket.shutdown(socket.SHUT_RDWR)


def half_a_frame():
    # A masked binary frame that promises 100 kB.
    return b"\x82\xff" + (100_000).to_bytes(8, "big") + b"mask" + b"\x00" * 20_000


def misbehave(server, how):
    with server.join() as client:
        how(client)


def test_eight_clients_of_whom_five_misbehave_lose_nothing_of_the_others_episodes(server):
    bad = [garbage, bomb, no_websocket, stall, leave_in_the_middle]
    good = [[0.125 * (k + 1)] * 12 for k in range(3)]
    with ThreadPoolExecutor(8) as clients:
        episodes = [clients.submit(episode, server, openings, pause=0.02) for openings in good]
        others = [clients.submit(misbehave, server, how) for how in bad]
        assert [one.result() for one in episodes] == [expected(openings) for openings in good]
        for other in others:
            other.result()


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (b"", "InvalidInput: message: cannot be read"),
        (os.urandom(100), "InvalidInput: message"),
        ("text", "InvalidInput: message: a text"),
        (wire.pack([1]), "InvalidInput: message: a list"),
        (wire.pack({}), "InvalidInput: message: asks for nothing"),
        (message()[:-10], "InvalidInput: message: cannot be read"),
        (message(prompt="please"), "InvalidInput: prompt: is no field"),
        (message(gripper_opening=7), "InvalidInput: gripper_opening: 7"),
        (message(time_step=GREEDY), "MemoryError"),
        (message(time_step=CRASH), "WorkerEnded: request: the process that worked on it ended"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_error_is_a_text_that_names_it_after_which_the_connection_closes(server, sent, said):
    with server.join() as client:
        client.send(sent)
        text = client.recv()
        assert isinstance(text, str) and said in text.strip().splitlines()[-1]
        assert code_of(client) == 1011
    assert place(ask_once(server, 0.5)) == [0.5, 1, 1]


def test_fuzzed_messages_are_answered_or_refused_by_name(server):
    random = np.random.default_rng(0)
    for _ in range(25):
        fuzzed = bytearray(message())
        for place_of_byte in random.integers(0, len(fuzzed), random.integers(1, 6)):
            fuzzed[place_of_byte] = random.integers(256)
        cut = len(fuzzed) if random.random() < 0.7 else random.integers(len(fuzzed))
        with server.join() as client:
            client.send(bytes(fuzzed[:cut]))
            reply = client.recv()
        if isinstance(reply, str):
            assert reply.strip().splitlines()[-1].startswith("imop.errors.InvalidInput: ")
        else:
            assert "T_world_gripper" in wire.unpack(reply)


def test_fuzzed_bytes_on_the_line_harm_nobody(server):
    random = np.random.default_rng(0)
    address = ("127.0.0.1", server.port)
    beginnings = [
        b"",
        b"GET / HTTP/1.1\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: a\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
    ]
    with server.join() as client:
        for beginning in 3 * beginnings:
            with socket.create_connection(address) as stranger:
                stranger.sendall(beginning + random.bytes(200))
            with server.join() as member:
                member.socket.sendall(random.bytes(200))
            assert ask(client, 0.5)["T_world_gripper"][1, 3] > 0
        assert place(ask(client, 0.5)) == [6.5, 13, 1]


def test_low_confidence_is_told_and_the_episode_goes_on(server):
    with server.join() as client:
        ask(client, 0.5)
        assert "NoConfidentMatch: confidence: 0.25" in ask(client, time_step=UNSURE)
        assert place(ask(client, 0.5)) == [1.0, 2, 1]


def test_a_message_beyond_the_limit_is_refused_by_its_size(server):
    with server.join() as client:
        client.send(bytes(LIMITS.message_bytes + 1))
        assert code_of(client) == 1009


def test_endless_requests_give_their_workers_back(hasty):
    with ThreadPoolExecutor(4) as clients:
        endless = [clients.submit(ask_once, hasty, time_step=SLEEP) for _ in range(2)]
        behind = [clients.submit(episode, hasty, [0.5, 0.25]) for _ in range(2)]
        assert all("TimeLimitExceeded: request: took more than 1.5 s" in one.result() for one in endless)
        assert all(one.result() == expected([0.5, 0.25]) for one in behind)


def test_who_leaves_while_being_answered_frees_the_worker(server):
    for _ in range(4):
        with server.join() as client:
            client.send(message(time_step=SLEEP))
            time.sleep(0.05)
            client.socket.shutdown(socket.SHUT_RDWR)
    assert wait_until_free(server) == [0.5, 1, 1]


def test_a_page_in_a_browser_is_refused(server):
    with pytest.raises(InvalidStatus) as refused, server.connect(origin="https://example.org"):
        pass
    assert refused.value.response.status_code == 403


def status_of(server, **headers):
    """How the server answers who wants to connect."""
    try:
        with server.connect(additional_headers=headers):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def code_of(client):
    """How the server closes the connection."""
    with pytest.raises(ConnectionClosed) as closed:
        client.recv()
    return closed.value.rcvd.code


def test_keys_sessions_and_idleness():
    right = "Api-Key right"
    with serving(key="right", limits=Limits(sessions=2, idle_seconds=0.5)) as server:
        assert [status_of(server, Authorization=key) for key in ("", "Api-Key wrong", "right")] == [401] * 3
        assert status_of(server) == 401
        with ExitStack() as stack:
            headers = {"Authorization": right}
            clients = [stack.enter_context(server.connect(additional_headers=headers)) for _ in range(2)]
            assert status_of(server, Authorization=right) == 503
            for client in clients:
                client.recv()
                assert code_of(client) == 1008
        assert status_of(server, Authorization=right) == 101


def test_shutting_down_finishes_the_step_and_sends_it():
    with ExitStack() as stack:
        server = stack.enter_context(serving(demonstrations=[demonstrate()], workers=1))
        working, waiting, idle = (stack.enter_context(server.join()) for _ in range(3))
        for client in (working, waiting):
            client.send(message(0.5, NAP))
        time.sleep(0.1)
        stopping = threading.Thread(target=server.stop)
        stopping.start()
        for client in (working, waiting):
            assert place(wire.unpack(client.recv())) == [0.5, 1, 1]
        assert [code_of(client) for client in (working, waiting, idle)] == [1001] * 3
        stopping.join()
        with pytest.raises(OSError):
            status_of(server)


def test_sessions_take_turns(hasty):
    done, together = [], threading.Barrier(3)

    def go(name):
        with hasty.join() as client:
            together.wait()
            for _ in range(4):
                ask(client, 0.5, NAP)
                done.append(name)

    with ThreadPoolExecutor(3) as clients:
        for one in [clients.submit(go, name) for name in "abc"]:
            one.result()
    # Nobody gets far ahead; whose first request is late may be one turn behind.
    ahead = [done[:k].count(a) - done[:k].count(b) for k in range(13) for a in "abc" for b in "abc"]
    assert max(ahead) <= 2


def test_a_server_without_a_process_for_sessions_ends_and_says_so():
    others = set(active_children())
    with serving(demonstrations=[demonstrate()]) as server, server.join() as client:
        (host,) = set(active_children()) - others
        ask(client)
        host.kill()
        assert code_of(client) == 1001
        server.stop()
        assert isinstance(server.failure, WorkerEnded)


def test_what_the_policy_says_against_a_preloaded_demonstration_is_raised():
    with pytest.raises(InvalidInput, match="is not liked"):
        Running(Refusing, [demonstrate()], {})


@pytest.mark.parametrize(
    ("host", "alone"),
    [
        ("127.0.0.1", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("", False),
        ("robot", False),
    ],
)
def test_others_than_this_machine_need_a_key(host, alone):
    assert is_loopback(host) is alone
    if not alone:
        with pytest.raises(InvalidInput, match="key"):
            Server(Remembering, host=host)
    Server(Remembering, host=host, key="secret")


def test_limits_are_above_zero():
    with pytest.raises(InvalidInput, match="sessions"):
        Limits(sessions=0)
    with pytest.raises(InvalidInput, match="request_seconds"):
        Limits(request_seconds=float("nan"))
    with pytest.raises(InvalidInput, match="workers"):
        Server(Remembering, workers=0)


def test_array_types_are_those_of_the_protocol(server):
    with server.join() as client:
        reply = ask(client)
    assert reply["T_world_gripper"].dtype == np.float64 and reply["match"]["region"].shape == (4, 3)
