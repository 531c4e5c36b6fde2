"""Exchange formats: A2L, calibration pages, CAN databases, CMake projects and FMUs."""
