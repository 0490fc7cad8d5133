"""Keys of link and scene files fitted to measured natural frequencies: `ffrobot fit`."""
