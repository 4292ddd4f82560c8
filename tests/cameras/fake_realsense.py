"""What the RealSense driver calls of pyrealsense2: one camera whose frames say when they were taken."""

import types

import numpy as np

SCALE = 0.00025


class State:
    """What a test wants of the camera."""

    def __init__(self):
        self.stamps, self.coeffs, self.domain, self.serial = [], [0.0] * 5, "global_time", "123"
        self.stopped, self.taken = False, []
        self.rgb = np.arange(48 * 64 * 3, dtype=np.uint32).reshape(48, 64, 3).astype(np.uint8)
        self.raw = np.full((48, 64), 4000, np.uint16)


def realsense_module():
    """The module, and the state of its camera."""
    module, state = types.ModuleType("pyrealsense2"), State()

    class config:
        def enable_device(self, serial):
            self.serial = serial

        def enable_stream(self, stream_type, width, height, format, framerate):
            self.size = width, height

    class intrinsics:
        width, height, fx, fy, ppx, ppy = 64, 48, 60.0, 61.0, 31.0, 24.5

        @property
        def coeffs(self):
            return state.coeffs

    class profile:
        def get_device(self):
            return self

        first_depth_sensor = as_video_stream_profile = get_device

        def get_depth_scale(self):
            return SCALE

        def get_stream(self, stream_type):
            return self

        def get_intrinsics(self):
            return intrinsics()

    class frames:
        def __init__(self, stamp, data=None):
            self.stamp, self.data = stamp, data

        def get_frame_timestamp_domain(self):
            return state.domain

        def get_timestamp(self):
            return 1000 * self.stamp

        def get_color_frame(self):
            return frames(self.stamp, state.rgb)

        def get_depth_frame(self):
            return frames(self.stamp, state.raw)

        def get_data(self):
            return self.data

    class pipeline:
        def start(self, config):
            if config.serial != state.serial:
                raise RuntimeError("No device connected")
            return profile()

        def try_wait_for_frames(self, timeout_ms):
            if not state.stamps:
                return False, None
            state.taken.append(state.stamps.pop(0))
            return True, frames(state.taken[-1])

        def stop(self):
            state.stopped = True

    class align:
        def __init__(self, align_to):
            pass

        def process(self, frames):
            return frames

    module.stream = types.SimpleNamespace(depth="depth", color="color")
    module.format = types.SimpleNamespace(z16="z16", rgb8="rgb8")
    module.timestamp_domain = types.SimpleNamespace(hardware_clock="hardware_clock")
    for one in (config, pipeline, align):
        setattr(module, one.__name__, one)

    def project(intrin, point):
        x, y, z = point
        grown = 1 + intrin.coeffs[0] * (x * x + y * y) / z**2
        return [intrin.fx * grown * x / z + intrin.ppx, intrin.fy * grown * y / z + intrin.ppy]

    module.rs2_project_point_to_pixel = project
    return module, state
