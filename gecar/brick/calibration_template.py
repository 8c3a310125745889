"""The part of main.py that keeps the sensors' calibration between runs: in a file, or in the brick's storage."""

KEEP_IN_FILE = '''def keep_calibration():
    with open("calibration.txt", "w") as file:
        for white, black in calibration:
            file.write("{} {}\\n".format(white, black))


def find_calibration():
    """Fetch the last calibration, if there is one for these sensors."""
    try:
        with open("calibration.txt") as file:
            pairs = [tuple([int(word) for word in line.split()]) for line in file]
    except (OSError, ValueError):
        return
    if len(pairs) == len(sensors) and all([len(pair) == 2 and pair[0] >= pair[1] + 10 for pair in pairs]):
        calibration.extend(pairs)
'''

KEEP_IN_STORAGE = '''def keep_calibration():
    """The brick saves it when it is turned off. One without storage asks again the next time."""
    numbers = [71, 67, len(calibration)]  # "GC": gecar's
    for white, black in calibration:
        numbers += [white, black]
    try:
        hub.system.storage(0, write=bytes(numbers))
    except (AttributeError, OSError, ValueError):
        pass


def find_calibration():
    """Fetch the last calibration, if there is one for these sensors."""
    try:
        stored = hub.system.storage(0, read=3 + 2 * len(sensors))
    except (AttributeError, OSError, ValueError):
        return
    pairs = [(stored[k], stored[k + 1]) for k in range(3, len(stored), 2)]
    if stored[:3] == bytes([71, 67, len(sensors)]) and all([pair[0] >= pair[1] + 10 for pair in pairs]):
        calibration.extend(pairs)
'''
