"""What other methods learn from the same recordings, beside laws that are written.

python -m benchmarks.rivals runs/cases runs/invention       # after benchmarks.invention

What the nominal equations of motion leave over is regressed on the robot's state: a torque at each shaft (Newton and
Euler, as `benchmarks.concealed.comparators.sparse` has them), and by how much more than in the simulation the body
runs ahead of its wheels and turns faster than they do. What was learned acts inside the simulation, as a torque on the
shafts and a speed of the body, on whole drives, open loop. What it gives is kept within what it was taught.

- ``sindy``: PySINDy, polynomials of degree 2 of all variables, STLSQ with ridge 0.05; the threshold of `THRESHOLDS`
  that recordings left out like best. Brunton, Proctor, Kutz, PNAS 113 (2016) 3932; de Silva et al., JOSS 5 (2020) 2104.
- ``network``: a perceptron, two layers of 32 tanh, stopped early (scikit-learn), the decay of `DECAYS` that
  recordings left out like best. It reads what laws read at the same places.
- ``symbolic``: gplearn with its own settings (1,000 programs, 20 generations, tournament 20), sine and cosine among its
  functions, on `SYMBOLIC_ROWS` rows.
- ``formula``: what `gecar discover` writes as a description (`gecar.reality.invent.formula`).

Judged on motion alone, wheel angles, pose and yaw rate, for all methods alike: these rivals have no port for the
battery's voltage or the colour sensor's reading.
"""
