"""imop: a robot arm learns a manipulation task from one demonstration, without retraining.

The public names stand in __init__.pyi; each is imported when it is first used, so that `imop --help` waits
for neither torch nor MuJoCo.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
