"""Truth generator with concealed physics: recordings of an electric driveline with backlash."""
