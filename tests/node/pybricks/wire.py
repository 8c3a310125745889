import json

import bridge


def call(name, *values):
    return json.loads(bridge.call(json.dumps((name,) + values)))  # noqa: RUF005 - MicroPython has no starred tuples
