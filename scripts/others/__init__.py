"""What the scripts share that hold Candelabra's pictures against those of other renderers."""
