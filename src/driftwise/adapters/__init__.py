"""driftwise behind the faces of scikit-learn, river, python-control, Stone Soup; each needs the extra of its name."""
