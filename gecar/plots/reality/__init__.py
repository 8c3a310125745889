"""Pictures of simulation beside recordings: verdicts, gaps, calibrations, signatures, motors."""
