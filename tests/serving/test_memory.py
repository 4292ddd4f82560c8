"""Memory of a server that answers often, and to many clients one after the other."""

import os
from multiprocessing import active_children

import pytest
from benchmarks.serving import family, memory

from imop.serving import wire
from imop.serving.schema import observation_fields
from tests.serving.policies import demonstrate, observe
from tests.serving.running import ask_once, serving

# Of 57 kB each: one that is kept in ten would be seen.
MESSAGE = wire.pack(observation_fields(observe(shape=(64, 64))))
MIB = 5


@pytest.mark.slow
def test_memory_is_steady_over_a_thousand_requests_and_a_hundred_clients():
    with serving(demonstrations=[demonstrate()]) as server:
        (host,) = active_children()
        with server.join() as client:
            for number in range(1200):
                client.send(MESSAGE)
                assert isinstance(client.recv(), bytes)
                if number == 200:
                    before = memory(os.getpid())
            assert memory(os.getpid()) - before < MIB
        before = memory(os.getpid())
        for _ in range(100):
            ask_once(server)
        assert memory(os.getpid()) - before < MIB
        assert len(family(host.pid)) <= 2
