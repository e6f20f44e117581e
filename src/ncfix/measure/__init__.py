"""The floor of measurements: files, instruments, calibration, plans. Empty so far."""
