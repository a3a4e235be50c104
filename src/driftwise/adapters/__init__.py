"""driftwise behind the faces of scikit-learn, river and python-control; each needs the extra of its name."""
