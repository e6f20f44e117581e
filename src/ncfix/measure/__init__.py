"""Measurements: files, observation models of instruments, calibration, measurement plans, simulated measurements.

`reader.read` returns a `Measurement`, `instruments.observe` its observation model, `calibrate.calibrate` a calibrated
machine, `plan.plan` the poses to measure, `instruments.simulate` a simulated measurement.
"""
