"""What the sensors' noise alone does to recordings, and what residuals hold beyond it."""
