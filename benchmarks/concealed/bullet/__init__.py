"""A third truth world: PyBullet's 3D bodies and contacts, driven by the motors and gears of the second."""
