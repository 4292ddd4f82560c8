"""Where cameras stand, from pictures of a printed board: on the robot's hand and beside it.

`board.py` is the board and `series.py` what was seen of it. `calibrate.py` leads from there to the cameras'
poses: what is wrong with the input is named (`diagnose.py`), OpenCV's solvers give a start (`solvers.py`),
    then
all corners decide (`refine.py`). `quality.py` says how well that went, `knocked.py` whether a camera was
moved since, `clouds.py` compares depth images. `folder.py` and `result.py` are the files, `collect.py` is the
way on a live robot.
"""
