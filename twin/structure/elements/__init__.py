"""Finite elements: beams in the plane and in space, and the thin layer between two of them."""

from twin.structure.elements.beam import beam_mass, beam_stiffness
from twin.structure.elements.space_beam import space_element
from twin.structure.elements.thin_layer import ThinLayerElement
from twin.structure.elements.timoshenko import timoshenko_mass
