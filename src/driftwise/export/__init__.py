"""Estimators as C for controllers: `est.export("folder")`, ``driftwise export``."""
