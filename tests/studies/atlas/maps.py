"""The maps of the atlas: for each point of two axes, and each variant, a case and what is true of it."""

import profile_maps
import straight_maps
import surface_maps
import tool_maps

MAPS = profile_maps.MAPS | straight_maps.MAPS | surface_maps.MAPS | tool_maps.MAPS
