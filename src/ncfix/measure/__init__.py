"""The floor of measurements: files, instruments' observation models, calibration, plans, simulated measurements.

`reader.read` gives a `Measurement`, `observe.observe` the instrument's view of it, `calibrate.calibrate` a calibrated
machine, `plan.plan` the poses to be measured, `synthetic.simulate` a measurement that never was.
"""
