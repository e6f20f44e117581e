"""Motions and a machine meet here: corrected motions, the text that says them, and the proof of both."""
