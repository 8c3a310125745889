"""A truth world that shares no code, integrator or parametrisation with ``gecar``, and the examination it sets.

Nothing in this folder imports ``gecar``; only the runner asks it for workers. A test reads the sources to make sure.
Start with the README beside this file.
"""
