"""The diagnosis as a value, diagnosis.json and calibrated.ssv."""
