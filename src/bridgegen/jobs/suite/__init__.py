"""Many scenario files with all their variations: found, run, judged, compared between drivers."""
