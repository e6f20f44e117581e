"""The floor of measurements: files, instruments, calibration, plans."""
