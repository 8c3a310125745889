"""Pictures of simulation and recordings: verdicts, gaps, calibrations, signatures, motors."""
