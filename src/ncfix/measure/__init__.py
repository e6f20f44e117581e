"""The floor of measurements: files, instruments' observation models, calibration, plans, simulated measurements.

`reader.read` gives a `Measurement`, `instruments.observe` the instrument's view of it, `calibrate.calibrate` a
calibrated machine, `plan.plan` the poses to be measured, `instruments.simulate` a measurement that never was.
"""
