"""The service: samples from the sensor bus in, estimates, bands and alarms out, for months."""
