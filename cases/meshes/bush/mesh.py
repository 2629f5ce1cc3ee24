"""Writes bush.msh: four rings of quadrangles, a hub, two layers of rubber and a sleeve, in mm (MSH 2.2)."""

from math import cos, pi, sin

RADII = [2, 5, 8, 12, 15]
BLOCKS = ["hub", "inner", "outer", "sleeve"]
COUNT = 96  # around; corners lie on the circles, so that areas are 0.07 % small

nodes, elements = [], []
for radius in RADII:
    for k in range(COUNT):
        angle = 2 * pi * k / COUNT
        nodes.append((radius * cos(angle), radius * sin(angle)))


def node(ring, k):
    return ring * COUNT + k % COUNT + 1


for block in range(len(BLOCKS)):
    for k in range(COUNT):
        corners = [node(block, k), node(block + 1, k), node(block + 1, k + 1), node(block, k + 1)]
        elements.append((3, block + 1, corners))
# where the layers meet
for k in range(COUNT):
    elements.append((1, 5, [node(2, k), node(2, k + 1)]))

with open("bush.msh", "w") as file:
    file.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n1 5 \"joint\"\n")
    for tag, name in enumerate(BLOCKS, 1):
        file.write(f'2 {tag} "{name}"\n')
    file.write(f"$EndPhysicalNames\n$Nodes\n{len(nodes)}\n")
    for tag, (x, y) in enumerate(nodes, 1):
        file.write(f"{tag} {x:.12g} {y:.12g} 0\n")
    file.write(f"$EndNodes\n$Elements\n{len(elements)}\n")
    for tag, (kind, group, corners) in enumerate(elements, 1):
        file.write(f"{tag} {kind} 2 {group} {group} {' '.join(map(str, corners))}\n")
    file.write("$EndElements\n")
