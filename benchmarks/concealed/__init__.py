"""A truth world that shares no code, integrator or parametrisation with ``gecar``, and the examination it sets.

Nothing in this folder imports ``gecar``; a test reads the sources to make sure. Start with the README beside this file.
"""
