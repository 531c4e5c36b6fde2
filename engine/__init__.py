"""Engine: interprets Programs and simulates systems, with located events and recordings."""
