"""`imop serve`: the policy behind a socket."""

import asyncio
import logging
import os
import signal
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from imop.serving.limits import Limits
from imop.terminal import console, status

if TYPE_CHECKING:
    from imop.evaluation.methods import Policy
    from imop.serving.server import Server

KEY = "IMOP_API_KEY"


def serve(
    demo: Path | None = None,
    demo_episode: int = 0,
    method: str = "learned",
    weights: Path | None = None,
    min_confidence: float = 0.0,
    second_try: bool = False,
    robot: Annotated[str, tyro.conf.arg(aliases=["--setup"])] = "panda",
    host: str = "127.0.0.1",
    port: int = 8000,
    workers: int | None = None,
    sessions: int = Limits.sessions,
    message_mib: int = Limits.message_bytes // 2**20,
    points: int = Limits.points,
    request_seconds: float = Limits.request_seconds,
    idle_seconds: float = Limits.idle_seconds,
) -> int:
    """Serve the policy to programs that control a robot, by openpi's protocol (docs/real_robot/serving.md).

    Every connection has an episode of its own. Ctrl-C or SIGTERM lets the steps in progress be finished; a
    second one does not. Clients have to have the key in the environment variable IMOP_API_KEY, if it is set;
    without one only programs on this machine can connect. Needs the extra serve.

    Args:
        demo: store or folder of RLBench's layout with the demonstration that every client's episode follows;
            clients may also send their own.
        demo_episode: which of its episodes.
        method: learned, replay, registration, textbook, or one's own, such as my_methods:MyPolicy.
        weights: folder that `imop train` wrote; by default the bundled weights.
        min_confidence: answer with an error below this confidence, 0 to 1.
        second_try: what failed is tried again, as in `imop eval`: an observation from which the arm is not
            where it was sent counts as a failed motion.
        robot: whose points are left out and which poses are reached: panda, iiwa14, ur5e, a set-up file
            (.toml or .json), whose workspace then counts too, or one's own, such as my_robot:MyArm.
        host: address to listen at; others than 127.0.0.1 need a key.
        port: to listen at; 0 takes a free one.
        workers: requests that are worked on at once; by default as many as there are cores.
        sessions: clients at once.
        message_mib: size of a message, in MiB.
        points: pixels of all views of an observation.
        request_seconds: time for one request; then it is ended, and with it the client's episode.
        idle_seconds: time until a client's next message has to be there.
    """
    from imop.demos.load import load_demonstration
    from imop.serving.server import Server

    limits = Limits(
        sessions=sessions,
        message_bytes=message_mib * 2**20,
        points=points,
        request_seconds=request_seconds,
        idle_seconds=idle_seconds,
    )
    shown = [] if demo is None else [load_demonstration(demo, demo_episode)]
    make = partial(make_served, method, weights, min_confidence, second_try, robot)
    key = os.environ.get(KEY)
    logging.basicConfig(format="%(asctime)s %(message)s")
    logging.getLogger("imop.serving").setLevel(logging.INFO)
    server = Server(make, shown, host, port, key, limits, workers, {"method": method})
    try:
        asyncio.run(_run(server, host))
    except asyncio.CancelledError:
        return 130
    console.print("stopped")
    return 0


def make_served(
    method: str, weights: Path | None, min_confidence: float, second_try: bool, robot: str
) -> "Policy":
    """A policy by the name of its method, that has watched nothing."""
    from imop.evaluation.methods import make_policy
    from imop.policy.one_shot import OneShotPolicy

    policy = make_policy(method, None, min_confidence, weights, robot)
    if isinstance(policy, OneShotPolicy):
        policy.recovers = second_try
    return policy


async def _run(server: "Server", host: str) -> None:
    loop, task = asyncio.get_running_loop(), asyncio.current_task()
    assert task is not None
    signals = (signal.SIGINT, signal.SIGTERM)

    def finish() -> None:
        console.print("finishing the steps in progress")
        for number in signals:
            loop.add_signal_handler(number, task.cancel)
        server.stop()

    for number in signals:
        loop.add_signal_handler(number, task.cancel)
    loading = status("loading the policy, and showing it the demonstration")
    loading.start()

    def started(port: int) -> None:
        loading.stop()
        for number in signals:
            loop.add_signal_handler(number, finish)
        console.print(f"serving at ws://{host}:{port}")

    try:
        await server.run(started)
    finally:
        loading.stop()
