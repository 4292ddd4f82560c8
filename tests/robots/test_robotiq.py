"""The Robotiq gripper, on a socket that answers as the URCap does."""

import socketserver
import threading

import pytest

from imop.robots.robotiq import RobotiqGripper


class Fingers:
    """Registers of a gripper that moves by 40 of 255 whenever it is asked for its position or object."""

    def __init__(self):
        self.value = {"ACT": 0, "STA": 0, "POS": 3, "PRE": 3, "OBJ": 3, "GTO": 0, "SPE": 0, "FOR": 0}
        self.blocked, self.deaf = 255, False

    def answer(self, line):
        word, name, *rest = line.split()
        if word == "SET":
            self.value[name] = int(rest[0])
            if name == "POS":
                self.value["POS"], self.value["PRE"] = self.at, int(rest[0])
            if name == "ACT" and rest[0] == "1":
                self.value["STA"] = 3
            return "?" if self.deaf else "ack"
        if name == "OBJ":
            self._step()
        return f"{name} {self.value[name]}"

    @property
    def at(self):
        return self._at

    _at = 3

    def _step(self):
        goal = min(self.value["PRE"], self.blocked)
        self._at += max(-40, min(40, goal - self._at))
        self.value["POS"] = self._at
        self.value["OBJ"] = 0 if self._at != goal else 2 if goal != self.value["PRE"] else 3


@pytest.fixture
def fingers(monkeypatch):
    monkeypatch.setattr("imop.robots.robotiq.POLL", 0.001)
    monkeypatch.setattr("imop.robots.robotiq.TIMEOUT", 2.0)
    state = Fingers()

    class Handler(socketserver.StreamRequestHandler):
        def handle(self):
            for line in self.rfile:
                self.wfile.write(f"{state.answer(line.decode())}\n".encode())

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        state.port = server.server_address[1]
        yield state
        server.shutdown()


def test_it_is_activated_and_goes_where_it_is_told(fingers):
    gripper = RobotiqGripper("127.0.0.1", fingers.port)
    assert fingers.value["STA"] == 3
    for opening in (0.0, 1.0, 0.4):
        assert gripper.move(opening, lambda: False).done
        assert gripper.opening() == pytest.approx(opening, abs=0.01)
    gripper.close()


def test_a_thing_between_the_fingers_is_no_failure(fingers):
    gripper = RobotiqGripper("127.0.0.1", fingers.port)
    fingers.blocked = 150
    assert gripper.move(0.0, lambda: False).done
    assert gripper.opening() == pytest.approx(1 - 150 / 255)


def test_a_stop_ends_the_motion(fingers):
    gripper = RobotiqGripper("127.0.0.1", fingers.port)
    assert gripper.move(0.0, lambda: fingers.at > 50).reason == "stopped"
    assert fingers.value["GTO"] == 0 and fingers.at < 200


def test_who_does_not_answer_is_a_connection_error(fingers):
    gripper = RobotiqGripper("127.0.0.1", fingers.port)
    fingers.deaf = True
    with pytest.raises(ConnectionError, match="SET"):
        gripper.move(0.0, lambda: False)
    with pytest.raises(ConnectionError, match="127"):
        RobotiqGripper("127.0.0.1", 1)
