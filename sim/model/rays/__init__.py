"""Model of hdl.rays: rays, packets and hits, bit for bit."""
