import subprocess
import sys

import numpy as np
import pytest

from imop.errors import InvalidInput, NoConfidentMatch
from imop.serving import Client, Limits, ServerError
from tests.serving.policies import CRASH, UNSURE, Remembering, demonstrate, observe
from tests.serving.running import serving


@pytest.fixture(scope="module")
def port():
    with serving(
        demonstrations=[demonstrate()], limits=Limits(points=1000), metadata={"method": "own"}
    ) as server:
        yield server.port


def place(action):
    return action.T_world_gripper[:3, 3].tolist()


def test_it_acts_as_the_policy_itself_would(port):
    there = Remembering()
    there.watch(demonstrate())
    with Client(port=port) as here:
        for opening in (0.5, 0.25, 1.0):
            a, b = here.act(observe(opening)), there.act(observe(opening))
            assert np.array_equal(a.T_world_gripper, b.T_world_gripper)
            assert (a.gripper_open, a.allow_collisions, a.confidence, a.reachable) == (
                b.gripper_open,
                b.allow_collisions,
                b.confidence,
                b.reachable,
            )
            assert np.array_equal(a.match.p_query, b.match.p_query)
        assert here.timing["infer_ms"] > 0 and here.metadata["method"] == "own"


def test_watching_and_resetting_take_effect_with_the_next_observation(port):
    with Client(port=port) as client:
        client.act(observe(0.5))
        client.reset()
        assert place(client.act(observe(0.25))) == [0.25, 1, 1]
        client.watch(demonstrate())
        client.watch(demonstrate())
        assert place(client.act(observe(0.25))) == [0.25, 1, 2]
        assert place(client.act(observe(0.25))) == [0.5, 2, 2]
        client.watch(demonstrate())
        assert place(client.act(observe(0.25))) == [0.25, 1, 3]


def test_errors_are_those_of_the_policy(port):
    with Client(port=port) as client:
        with pytest.raises(NoConfidentMatch) as unsure:
            client.act(observe(time_step=UNSURE))
        assert (unsure.value.confidence, unsure.value.required) == (0.25, 0.5)
        client.act(observe())
        with pytest.raises(InvalidInput) as refused:
            client.act(observe(shape=(40, 60)))
        assert (refused.value.field, refused.value.problem) == ("views", "4800 pixels")
        with pytest.raises(ServerError, match="make a new Client"):
            client.act(observe())


def test_what_ends_a_session_is_named(port):
    with Client(port=port) as client, pytest.raises(ServerError) as failed:
        client.act(observe(time_step=CRASH))
    assert failed.value.kind == "WorkerEnded"


def test_no_server_and_a_wrong_key_are_named():
    with serving(key="right") as server:
        with pytest.raises(ServerError, match="401: wrong or missing key"):
            Client(port=server.port, key="wrong")
        Client("ws://127.0.0.1", server.port, key="right").close()
    with pytest.raises(ServerError, match="refused"):
        Client(port=server.port)


def test_a_client_needs_neither_torch_nor_scipy():
    code = (
        "import sys, imop.serving as s; s.Client; print([m for m in ('torch', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
