"""The policy in one process, the robot in another: a server, and a client that needs numpy only."""

import re
import subprocess
import sys
from pathlib import Path

from imop import DemonstrationStore, make_env, make_task, record_demonstration, to_array
from imop.serving.client import Client

TASK = "tabletop/open_drawer"
store = DemonstrationStore.create(Path(sys.argv[1]) / "shown.zarr")
store.append(record_demonstration(make_task(TASK), seed=100, instance_seed=0))

# In a terminal: imop serve --demo shown.zarr
command = [sys.executable, "-m", "imop.cli", "serve", "--demo", str(store.path), "--port", "0"]
with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
    address = next(found[0] for line in server.stdout if (found := re.search(r"ws://\S+", line)))
    with Client(address, port=None) as policy:
        env = make_env(TASK)
        env.reset(seed=1, options={"instance_seed": 0})
        done = False
        while not done:
            action = policy.act(env.observation)
            print(f"confidence {action.confidence:.2f}, {policy.timing['infer_ms']:.0f} ms")
            _, _, terminated, truncated, info = env.step(to_array(action))
            done = terminated or truncated
    server.terminate()
print("success" if info["success"] else "failed")
