"""ParaView 5.11.0 of Debian 12 loads no Python plugin: it imports inspect.getargspec, which its Python 3.11 lacks.
With this folder in PYTHONPATH it does. Later ParaViews need nothing of this."""

import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec
