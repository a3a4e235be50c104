"""Formats of plots and tracks, a file each; and which writers there are."""

WRITERS = {  # kind, which is what a file ends in: module and function, asked with (tracks, path)
    "csv": "driftwise.tracking.write:write_csv",
    "parquet": "driftwise.tracking.write:write_parquet",
    "geojson": "driftwise.tracking.formats.maps:write_geojson",
    "kml": "driftwise.tracking.formats.maps:write_kml",
    "gpx": "driftwise.tracking.formats.gpx:write_gpx",
    "cat062": "driftwise.tracking.write:write_cat062",
}
