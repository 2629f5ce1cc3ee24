"""Writes bush.inp: three rings of hexahedra (C3D8), a hub, rubber and a sleeve, 10 mm long, in mm."""

from math import cos, pi, sin

RADII = [2, 5, 12, 15]
BLOCKS = ["hub", "rubber", "sleeve"]
COUNT, LENGTH = 72, 10


def node(level, ring, k):
    return (level * len(RADII) + ring) * COUNT + k % COUNT + 1


with open("bush.inp", "w") as file:
    file.write("*HEADING\nA bush, in mm\n*NODE\n")
    for level in range(2):
        for ring, radius in enumerate(RADII):
            for k in range(COUNT):
                angle = 2 * pi * k / COUNT
                x, y = radius * cos(angle), radius * sin(angle)
                file.write(f"{node(level, ring, k)}, {x:.12g}, {y:.12g}, {level * LENGTH}\n")
    label = 1
    for ring, name in enumerate(BLOCKS):
        file.write(f"*ELEMENT, TYPE=C3D8, ELSET={name}\n")
        for k in range(COUNT):
            below = [node(0, ring, k), node(0, ring + 1, k), node(0, ring + 1, k + 1), node(0, ring, k + 1)]
            above = [corner + len(RADII) * COUNT for corner in below]
            file.write(", ".join(map(str, [label, *below, *above])) + "\n")
            label += 1
    # the bore of the hub: sides between the nodes 4, 1, 5, 8
    file.write("*SURFACE, NAME=bore\nhub, S6\n")
